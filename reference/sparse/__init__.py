"""Sparse Cholesky factorisation, P A P' = L L', made for the matrices of cloths and networks.

`dissection` and `minimum_degree` find the order P, `elimination_tree` and `supernodes` the pattern
of L, `multifrontal` with `dense` its values; `triangular` solves, with `sides` in vector registers.
`factor` is the door.
"""

from .factor import CholeskyFactor, NotPositiveDefiniteError

__all__ = ["CholeskyFactor", "NotPositiveDefiniteError"]
