"""The kinematic part of an MJCF file, MuJoCo's own format.

Joint 0 of the articulation is the world. Bodies follow depth first in the order of the file, and
the coordinates are those of MuJoCo's qpos, one for one. Every body gives a joint of its own name
and pose. A body that has several joints gives one for each, named "body/joint", of which the last
is the body's own; where the last anchor is not the body's origin, a fixed joint is added for that.
A body without a name is called "body#3" after its number, and a joint without one "hinge1" after
its type and its place among the body's.

`ref` is folded into the frames: `home` is where the file shows the robot, with each joint at its
`ref`. A free joint moves in the world's frame. The limit of a ball, which MuJoCo sets on its whole
angle, becomes one of the same size on its tilt and one on its twist about z: this allows all that
MuJoCo does, and more. Frames, nested defaults, and includes from within one folder are followed.
Sites, keyframes, equality constraints and all else that forward kinematics has no use for is passed
over. What makes bodies by a rule (replicate, attach, composite, flexcomp) is refused, but for a
replicate without bodies, which is passed over with a warning.
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
        root: the folder that included files must be in, links followed; the file's own if None.

    Raises:
        ValueError: naming file, line and element, if it cannot be read, is not an MJCF file,
            includes one from outside the root, or makes bodies by a rule.
    """
    element = xml.read(path)
    include_files(element, Path(path), root)
    return robot(element, str(path))


def parse(text: str) -> Robot:
    """Return the robot or character that a text describes, which can include no files.

    Raises:
        ValueError: as for `read`.
    """
    root = xml.parse(text, "MJCF")
    refuse_includes(root)
    return robot(root, "MJCF")
