"""Solvers for robots as the bench calls them, one file each, the only one to import its engine."""
