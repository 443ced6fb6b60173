"""The kinematic part of an MJCF file, MuJoCo's own format.

Joint 0 of the articulation is the world. Bodies follow depth first in the order of the file, and
the coordinates equal those of MuJoCo's qpos. Every body becomes a joint with its name and pose. A
body with several joints becomes one joint for each, named "body/joint", except that the last one
has the name of the body; if its anchor is not the body's origin, a fixed joint with the name of the
body follows. A body without a name is called "body#3" by its index, a joint without one "hinge1" by
its type and its index in the body.

`home` is the configuration in the file, with each joint at its `ref`. A free joint moves in the
world's frame. MuJoCo limits the total angle of a ball; here its tilt and its twist about z are each
limited by that angle, which allows all that MuJoCo does, and more. Frames, nested defaults and
includes from one folder are supported. Elements that do not affect forward kinematics, such as
sites, keyframes and equality constraints, are ignored. Elements that generate bodies (replicate,
attach, composite, flexcomp) are refused, except for a replicate without bodies, which is ignored
with a warning.
"""

from pathlib import Path

from .. import xml
from ..robot import Robot
from .bodies import robot
from .include import include_files, refuse_includes

__all__ = ["parse", "read"]


def read(path: str | Path, *, root: str | Path | None = None) -> Robot:
    """Return the robot or character that a file describes.

    Args:
        path: of the file.
        root: the folder that must contain all included files after symbolic links are resolved;
            that of the file if None.

    Raises:
        ValueError: naming file, line and element, if it cannot be read, is not an MJCF file,
            includes one from outside the root, or has elements that generate bodies.
    """
    element = xml.read(path)
    include_files(element, Path(path), root)
    return robot(element, str(path))


def parse(text: str) -> Robot:
    """Return the robot that a text describes, which can include no files; see `read`."""
    root = xml.parse(text, "MJCF")
    refuse_includes(root)
    return robot(root, "MJCF")
