"""The energy of a swinging cloth under six integrators."""

# Particles along a side, and the dampings of the springs [N s/m].
SIZE = 5
DAMPINGS = {"undamped": 0.0, "damped": 0.2}
