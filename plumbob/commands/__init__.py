"""The commands: what each is asked and what it prints; the work is done elsewhere."""
