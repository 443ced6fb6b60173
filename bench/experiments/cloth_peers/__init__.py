"""One cloth for every engine: work against precision, stability."""

# What a record is about.
ONE_STEP, MOTION, NEEDED = "work of a step", "work of a motion", "iterations of a step"
STABILITY, LIU, MISSING = "stability", "Liu 2013", "missing"
