"""Comparisons of mass-spring systems with MuJoCo and closed forms."""

from .balances import balance_residual

__all__ = ["balance_residual"]
