"""The commands: their options and output; the work is done elsewhere."""
