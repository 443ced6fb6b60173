"""Scenes in motion: by our solvers or by yours, as animations, pictures, pages and BVH."""
