"""All solutions of poses of six hinges: how many each solver lists, misses and makes up."""

# The task of records.
BRANCHES = "branches"
# Random starts of the search at a target.
STARTS = 128
# A solution within EXACT [m] and [rad] of the target must be listed; beyond TOLERANCE a solution is
# false. Near singular poses, solvers without a last polish stay between the two tolerances.
EXACT, TOLERANCE = 1e-9, 1e-6
# Solutions are the same within this [rad]: near singular poses an error moves angles by its root.
SAME = 1e-3
# More solutions of six joints are members of a continuum (Primrose 1986).
LARGEST_COUNT = 16
