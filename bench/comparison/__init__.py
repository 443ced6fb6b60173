"""Compare runs and revisions: faster, slower, more or less accurate; and follow many runs."""
