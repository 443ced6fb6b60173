"""A cache of factors: each matrix is factorised once and each pattern analysed once.

A factor stays in the cache as long as an integrator uses it. Integrators for the same system and h
share a factor. With another h or stiffness they share its ordering and symbolic structure, which
depend only on the sparsity pattern. Results do not depend on the contents of the cache.
"""

import hashlib
from typing import Any
from weakref import WeakValueDictionary

import numpy as np

from ..mass_spring import MassSpring
from ..sparse import CholeskyFactor, NotPositiveDefiniteError
from .objective import effective_stiffnesses, global_matrix

# Factors by the digest of their matrix and by the digest of its sparsity pattern.
_by_matrix: WeakValueDictionary[tuple[bytes, bool], CholeskyFactor] = WeakValueDictionary()
_by_pattern: WeakValueDictionary[bytes, CholeskyFactor] = WeakValueDictionary()


class GlobalMatrixSolver:
    """A step solver that factorises M + h² L once for all steps."""

    single_precision = False  # whether the factor is rounded to single precision

    def __init__(self, system: MassSpring, h: float) -> None:
        self._factor = global_factor(system, h, self.single_precision)


def global_factor(system: MassSpring, h: float, single: bool = False) -> CholeskyFactor:
    """Return the factor of M + h² L; an error if masses are too small beside h² k."""
    try:
        return prefactored(global_matrix(system, h), single)
    except NotPositiveDefiniteError:
        stiffest = float((h * h * effective_stiffnesses(system, h)).max(initial=0.0))
        raise NotPositiveDefiniteError(
            "masses, stiffnesses, h: expected M + h² L positive definite to rounding, got masses "
            f"from {system.masses[system.free].min():g} kg and h² k up to {stiffest:g} kg"
        ) from None


def hessian_factor(system: MassSpring) -> CholeskyFactor:
    """Return the factor of M stored in the sparsity pattern of the Hessian of g."""
    springs = system.with_separate_dampers.free_blocks
    M = springs.matrix(np.zeros((len(system.with_separate_dampers.springs), 3, 3)))
    M.data[springs.diagonal] = np.repeat(system.free_masses, 3)
    return prefactored(M)


def prefactored(matrix: Any, single: bool = False) -> CholeskyFactor:
    """Return the factor of a sparse CSC matrix from the cache, or factorise the matrix.

    `single` rounds the factor to single precision if it stays in range. Only the rounded factor
    then stays in memory.
    """
    digest = hashlib.blake2b(matrix.indptr)
    digest.update(matrix.indices)
    pattern = digest.digest()
    digest.update(matrix.data)
    key = digest.digest(), single
    factor = _by_matrix.get(key)
    if factor is None and single:
        factor = prefactored(matrix).in_single_precision()
    elif factor is None:
        analysed = _by_pattern.get(pattern)
        factor = CholeskyFactor(matrix) if analysed is None else analysed.refactorize(matrix)
    _by_matrix[key] = _by_pattern[pattern] = factor
    return factor


def clear() -> None:
    """Empty the cache."""
    _by_matrix.clear()
    _by_pattern.clear()
