"""The lab's cloth at three stiffnesses: convergence of every step solver."""

# The tasks of its records.
ONE_STEP, FEW, DAMPERS = "one step", "few iterations", "dampers"
