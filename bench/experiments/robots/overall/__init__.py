"""All robots at once: who solves how much in what time, and where."""
