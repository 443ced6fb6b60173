"""A step of a heavy cloth by every solver, and the proven distance to a minimiser."""

# Stiffness of the cloths [N/m], gravity [m/s²], and the converged frames before the step [s].
STIFFNESSES = (1e3, 1e4, 1e5)
GRAVITY = 9.81
FRAME, FRAMES = 1 / 30, 15
