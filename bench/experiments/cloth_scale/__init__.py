"""Cloths of a thousand particles and more: factorisations, solves, memory."""
