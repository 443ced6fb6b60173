"""A chain of ten ball joints: accuracy and iterations of every inverse-kinematics solver."""

from ...problems.chains import BEYOND

__all__ = ["BEYOND", "CHAIN"]

# The task of records.
CHAIN = "chain"
