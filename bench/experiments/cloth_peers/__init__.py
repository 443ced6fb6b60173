"""One cloth for every engine: work against precision, stability."""

# What a record is about.
ONE_STEP, MOTION, NEEDED = "work of a step", "work of a motion", "iterations of a step"
STABILITY, LIU, MISSING = "stability", "Liu 2013", "missing"
# Errors whose iterations are counted; those whose time is; the one at which a step is solved.
DECADES = tuple(f"1e-{power}" for power in range(1, 9))
TARGETS = ("1e-3", "1e-6")
SOLVED = TARGETS[-1]
