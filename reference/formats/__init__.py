"""Files of other programs, read into our models: the only door for files in the reference."""

from .obj import Mesh, parse_obj, read_obj

__all__ = ["Mesh", "parse_obj", "read_obj"]
