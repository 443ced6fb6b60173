"""Solvers of ours and of others as the bench calls them, one adapter a file."""
