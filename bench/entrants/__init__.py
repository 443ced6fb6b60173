"""Solvers and problems of users: opened by the doors of `verify`, measured as peers are."""
