"""Robots and characters from files of others, read by both engines."""
