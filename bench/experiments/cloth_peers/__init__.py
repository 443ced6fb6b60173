"""The same cloth for every engine: steps to the minimiser, motions to the truth, stability."""

# The tasks of its records.
ONE_STEP, MOTION = "work of a step", "work of a motion"
STABILITY, LIU, MISSING = "stability", "Liu 2013", "missing"
# Errors of a step to which time is measured. A minimiser rounded to single precision is 1e-5 off,
# so engines in single precision can reach the last, the error of a solved step.
TARGETS = {"1e-2": 1e-2, "1e-4": 1e-4}
SOLVED = "1e-4"
# Errors of a motion, relative to the distance moved, to which time is measured.
MOTION_TARGETS = {"10 %": 0.1, "1 %": 0.01}
NEAR = "1 %"
# Errors to which iterations are counted.
DECADES = tuple(f"1e-{power}" for power in range(1, 9))
