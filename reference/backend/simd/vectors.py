"""Functions on vector registers: arrays in the interpreter, instructions in compiled kernels.

*Lanes* are the same joint of eight poses side by side, or eight springs. A kernel on tuples of
components also runs on lanes. `in_lanes` replaces the functions that read and write a pose by
functions on tiles. Data shared by all poses, such as a skeleton's offsets, stay unchanged. No
operation mixes lanes: every pose gets the same bits as by itself. A *tile* is as many poses of a
batch as there are lanes, (lane, joint, component). A *scratch* array, (joint, component, lane),
holds unit quaternions in the order of the registers.

A *row* is four right-hand sides of an unknown, a row of an array (unknown, 4), which is loaded,
changed and stored whole. Three right-hand sides leave the fourth at zero.
"""

import numpy as np

from ...quaternion import load_quaternion, load_vector, made_unit, store_quaternion, store_vector
from ..compiled import PythonKernel, compiled_in, rebuilt

# Doubles in a register of AVX-512, or two of AVX.
LANES = 8

in_vector_registers = compiled_in("plumbob.reference.backend.simd.instructions")


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
def load_entries(values, s):
    """Return the entries from s on of an array as lanes."""
    return values[s : s + LANES].copy()


@in_vector_registers
def gather_vectors(x, ends, s, end):
    """Return the rows of x (particle, 4) at one end of the springs from s on as three lanes."""
    return tuple(x[ends[s : s + LANES, end], :3].T.copy())


@in_vector_registers
def scatter_vectors(x, ends, s, end, value):
    """Add three lanes to the rows that `gather_vectors` reads, one after the other."""
    np.add.at(x[:, :3], ends[s : s + LANES, end], np.transpose(value))


@in_vector_registers
def square_root(value):
    """Return the root of every lane."""
    return np.sqrt(value)


@in_vector_registers
def larger(value, other):
    """Return the larger of two in every lane."""
    return np.where(value >= other, value, other)


@in_vector_registers
def all_within(value, bound):
    """Return whether |value| <= bound in every lane; NaN is not."""
    return bool((np.abs(value) <= bound).all())


@in_vector_registers
def load_row(y, i):
    """Return row i of an array (unknown, 4)."""
    return y[i].copy()


@in_vector_registers
def store_row(y, i, row):
    """Write row i of an array (unknown, 4)."""
    y[i] = row


@in_vector_registers
def scale_row(factor, row):
    """Return factor * row."""
    return factor * row


@in_vector_registers
def subtract_scaled(row, factor, other):
    """Return row - factor * other."""
    return row - factor * other


@in_vector_registers
def dot_rows(a, b):
    """Return the scalar product of two rows, added in pairs."""
    products = a * b
    return (products[0] + products[2]) + (products[1] + products[3])


@in_vector_registers
def prefetch(values, i):
    """Load an entry to be read soon into the cache; the index may be out of range."""


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
    "made_unit": rebuilt(made_unit, within=all_within),
}


def in_lanes(kernel: PythonKernel) -> PythonKernel:
    """Return a kernel on a pose as a kernel on a tile of LANES poses, with the same bits.

    Positions and rotations get a leading axis, (LANES, joint, ...); unit quaternions lie in a
    scratch array, (joint, 4, LANES).
    """
    names = kernel.__code__.co_names
    return rebuilt(kernel, **{name: _ON_TILES[name] for name in names if name in _ON_TILES})
