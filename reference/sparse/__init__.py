"""Sparse Cholesky factorisation, P A P' = L L', made for the matrices of cloths and networks.

`dissection` finds the order P, `symbolic` the pattern of L and `multifrontal` its entries;
`triangular` solves, with the right-hand sides in vector registers. `factor` is the interface.
"""

from .factor import CholeskyFactor, NotPositiveDefiniteError

__all__ = ["CholeskyFactor", "NotPositiveDefiniteError"]
