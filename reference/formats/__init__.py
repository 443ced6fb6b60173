"""Readers and writers of URDF, MJCF, BVH and OBJ, the only part of the reference to open files."""

from . import bvh, mjcf, urdf
from .obj import Mesh, parse_obj, read_obj
from .source import FormatWarning

__all__ = ["FormatWarning", "Mesh", "bvh", "mjcf", "parse_obj", "read_obj", "urdf"]
