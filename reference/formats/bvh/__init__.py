"""BVH, the Biovision hierarchy: motions of a skeleton, which every animation program opens.

The joints come in the order of the file, depth first. An end site is a joint without channels that
is named after its parent, with " end" added; one at its parent's very place adds nothing and is
left out. Rotation channels turn in their own order, R = R_1 R_2 R_3, about axes that move along.
Position channels take the place of the OFFSET, axis by axis, as animation programs write them (a
program that adds the two reads the same from a file whose root has the OFFSET zero). Lengths are in
the unit of the file, angles in degrees in it and in quaternions here.
"""

from .motion import Motion
from .reader import parse, read
from .writer import format, write

__all__ = ["Motion", "format", "parse", "read", "write"]
