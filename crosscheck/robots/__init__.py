"""Comparisons of robots and characters that the reference and an engine each read from files."""
