"""Kernels on one pose, and the same kernels on a tile of poses side by side.

A kernel that is to run on tiles reads and writes poses through the functions below. What all poses
share, such as a skeleton's offsets, it reads as ever.
"""

from ...quaternion import load_quaternion, load_vector, made_unit, store_quaternion, store_vector
from ..compiled import bind
from ..digest import PythonKernel
from .lanes import (
    LANES,
    all_within,
    load_lanes,
    load_quaternions,
    load_vectors,
    store_lanes,
    store_quaternions,
    store_vectors,
)

__all__ = ["LANES", "in_lanes"]

# Rows of a pose's positions (joint, 3) and rotations (joint, 4); of unit quaternions (joint, 4),
# which on tiles are in a scratch array (joint, 4, LANES).
load_position, store_position = load_vector, store_vector
load_rotation, store_rotation = load_quaternion, store_quaternion
load_unit, store_unit = load_quaternion, store_quaternion

_ON_TILES = {
    "load_position": load_vectors,
    "store_position": store_vectors,
    "load_rotation": load_quaternions,
    "store_rotation": store_quaternions,
    "load_unit": load_lanes,
    "store_unit": store_lanes,
    "made_unit": bind(made_unit, within=all_within),
}


def in_lanes(kernel: PythonKernel) -> PythonKernel:
    """Return a kernel on one pose as a kernel on a tile of LANES poses; every pose the same bits.

    Positions and rotations get a leading axis, (LANES, joint, ...); unit quaternions lie in a
    scratch array, (joint, 4, LANES).
    """
    names = kernel.__code__.co_names
    return bind(kernel, **{name: _ON_TILES[name] for name in names if name in _ON_TILES})
