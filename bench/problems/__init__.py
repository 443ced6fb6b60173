"""Named problems: the same name and size give the same numbers on every machine."""
