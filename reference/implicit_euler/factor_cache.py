"""Factors made before any step and kept: each matrix once, each pattern analysed once.

While an integrator holds a factor, others find it here: for the same system and h as it is; for
another h or stiffness its order and structure, which follow from the pattern alone. Nothing of a
result depends on what was found.
"""

import hashlib
from typing import Any
from weakref import WeakValueDictionary

import numpy as np

from ..mass_spring import MassSpring
from ..sparse.linear_solver import Factor, factorize
from .objective import global_matrix

# By digests of the matrix, and of its pattern alone.
_same: WeakValueDictionary[bytes, Factor] = WeakValueDictionary()
_alike: WeakValueDictionary[bytes, Factor] = WeakValueDictionary()


def global_factor(system: MassSpring, h: float) -> Factor:
    """Return the factor of M + h² L.

    Raises:
        NotPositiveDefiniteError: if it is singular to rounding, masses being too small.
    """
    return prefactored(global_matrix(system, h))


def hessian_factor(system: MassSpring) -> Factor:
    """Return the factor of M in the pattern of the Hessians of g, to be refactorised for each."""
    springs = system.dampers_apart.free_blocks
    M = springs.matrix(np.zeros((len(system.dampers_apart.springs), 3, 3)))
    M.data[springs.diagonal] = np.repeat(system.free_masses, 3)
    return prefactored(M)


def prefactored(matrix: Any) -> Factor:
    """Return the factor of a sparse CSC matrix, found or made from one that is alike, or made anew.

    Raises:
        NotPositiveDefiniteError: if the matrix is not positive definite.
    """
    digest = hashlib.blake2b(matrix.indptr)
    digest.update(matrix.indices)
    pattern = digest.digest()
    digest.update(matrix.data)
    factor = _same.get(digest.digest())
    if factor is None:
        alike = _alike.get(pattern)
        factor = factorize(matrix) if alike is None else alike.refactorize(matrix)
        _same[digest.digest()] = _alike[pattern] = factor
    return factor


def forget() -> None:
    """Find no factor again of those alive now."""
    _same.clear()
    _alike.clear()
