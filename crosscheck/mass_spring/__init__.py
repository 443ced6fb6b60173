"""Comparisons of mass-spring systems with MuJoCo and closed forms."""
