"""Robots and characters from files: the reference reads them itself, and so do the engines."""
