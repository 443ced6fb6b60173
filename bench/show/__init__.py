"""Animations, pictures and pages of the named scenes, by Plumbob's solvers and the user's."""
