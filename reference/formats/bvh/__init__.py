"""BVH, the Biovision hierarchy: motions of a skeleton, a common format of animation programs.

The joints follow the order of the file, depth first. An end site becomes a joint without channels,
named after its parent with " end" added; an end that coincides with its parent is left out.
Rotation channels compose in their order, R = R_1 R_2 R_3, about moving axes. Position channels
replace the OFFSET, axis by axis, as animation programs write them; a program that adds the two
reads the same from a file whose root has OFFSET zero. Lengths are in the unit of the file; angles
are in degrees in the file and become quaternions.
"""

from .reader import Motion, parse, read
from .writer import format, write

__all__ = ["Motion", "format", "parse", "read", "write"]
