"""Compare two revisions or two runs: what got faster, slower, more or less right; and over time."""
