"""Solvers for robots as the bench calls them, a file each, which alone imports its engine."""
