"""Solvers as the bench calls them, one file each; our own need no more than their names."""
