"""The lab's cloth at three stiffnesses: convergence of every step solver."""

# What a record is about.
SWING, ONE_STEP, FEW, DAMPERS = "swing", "one step", "few iterations", "dampers"
