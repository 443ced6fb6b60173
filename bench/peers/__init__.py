"""Solvers of ours and of others as the bench calls them, an adapter each."""
