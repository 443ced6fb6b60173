"""Lanes: the same joint of eight poses side by side, in vector registers.

A kernel on tuples of components also runs on lanes: `in_lanes` exchanges the functions that read
and write one pose for those that read and write a tile. In the interpreter a component in lanes is
an array; compiled it is a vector register, and reading and writing are the instructions in
`lane_instructions.py`. No operation mixes lanes: every pose gets the same bits as by itself.

A *tile* is as many poses of a batch as there are lanes, (lane, joint, component). A *scratch*
array, (joint, component, lane), holds unit quaternions in the order of the registers.
"""

import numpy as np

from ..compiled import compiled_in

# A row of doubles that fills an AVX-512 register, or two of AVX.
LANES = 8

in_vector_registers = compiled_in("plumbob.reference.backend.simd.lane_instructions")


@in_vector_registers
def load_vectors(tile, j):
    """Return row j of the poses of a tile (lane, joint, 3) as a tuple of lanes."""
    return tuple(tile[:, j].T.copy())


@in_vector_registers
def load_quaternions(tile, j):
    """Return row j of the poses of a tile (lane, joint, 4) as a tuple of lanes."""
    return tuple(tile[:, j].T.copy())


@in_vector_registers
def store_vectors(tile, j, value):
    """Write a tuple of lanes, or of floats for all, into row j of a tile (lane, joint, 3)."""
    tile[:, j, 0], tile[:, j, 1], tile[:, j, 2] = value


@in_vector_registers
def store_quaternions(tile, j, value):
    """Write a tuple of lanes, or of floats for all, into row j of a tile (lane, joint, 4)."""
    tile[:, j, 0], tile[:, j, 1], tile[:, j, 2], tile[:, j, 3] = value


@in_vector_registers
def load_lanes(scratch, j):
    """Return row j of a scratch array (joint, 4, lane) as a tuple of lanes."""
    return tuple(scratch[j].copy())


@in_vector_registers
def store_lanes(scratch, j, value):
    """Write a tuple of lanes, or of floats for all, into row j of an array (joint, 4, lane)."""
    scratch[j, 0], scratch[j, 1], scratch[j, 2], scratch[j, 3] = value


@in_vector_registers
def all_within(value, bound):
    """Return whether |value| <= bound in every lane; NaN is not."""
    return bool((np.abs(value) <= bound).all())
