"""All solutions of poses of six hinges: how many each solver lists, misses and makes up."""

# The task of records.
BRANCHES = "branches"
# Random starts of the search at a target.
STARTS = 128
# A solution is right within this [m] and [rad], which solvers without a last polish reach, and is
# the same as another within this [rad]: near singular poses a tolerance moves angles by its root.
TOLERANCE, SAME = 1e-6, 1e-3
# More solutions of six joints are members of a continuum (Primrose 1986).
LARGEST_COUNT = 16
