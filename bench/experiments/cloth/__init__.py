"""The lab's cloth at three stiffnesses: convergence of every step solver."""
