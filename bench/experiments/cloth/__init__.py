"""The lab's cloth at three stiffnesses: convergence of every step solver."""

# The tasks of its records.
SWING, ONE_STEP, FEW, DAMPERS = "swing", "one step", "few iterations", "dampers"
