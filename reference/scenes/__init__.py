"""Named scenes: each function returns a model and its initial state."""

from .grids import grid_cloth, grid_triangles, hanging_rope, lab_cloth, lattice, net
from .meshes import cloth_from_mesh
from .networks import random_network
from .skeletons import ball_chain, lab_arm

__all__ = [
    "ball_chain", "cloth_from_mesh", "grid_cloth", "grid_triangles", "hanging_rope", "lab_arm",
    "lab_cloth", "lattice", "net", "random_network",
]  # fmt: skip
