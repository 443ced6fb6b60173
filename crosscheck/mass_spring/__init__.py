"""Mass-spring systems: our forces, steps, motions and rests beside MuJoCo's and closed forms."""

from .balances import balance_residual

__all__ = ["balance_residual"]
