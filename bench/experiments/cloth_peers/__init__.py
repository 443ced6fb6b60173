"""The same cloth for every engine: work against precision, stability."""

# The tasks of its records.
ONE_STEP, MOTION, NEEDED = "work of a step", "work of a motion", "iterations of a step"
STABILITY, LIU, MISSING = "stability", "Liu 2013", "missing"
# Errors to which iterations are counted; those to which time is measured; that of a solved step.
DECADES = tuple(f"1e-{power}" for power in range(1, 9))
TARGETS = ("1e-3", "1e-6")
SOLVED = TARGETS[-1]
