"""Files of other programs, read into our models: the only door for files in the reference."""

from . import bvh, mjcf, urdf
from .obj import Mesh, parse_obj, read_obj
from .source import FormatWarning

__all__ = ["FormatWarning", "Mesh", "bvh", "mjcf", "parse_obj", "read_obj", "urdf"]
