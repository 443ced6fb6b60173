"""One cloth for every engine: work against precision, stability."""
