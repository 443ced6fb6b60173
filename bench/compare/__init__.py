"""Compare runs and revisions: faster, slower, more or less accurate."""
