"""Known deviations of Pinocchio 4.1 and MuJoCo 4.0 in reading files, detected from the file.

A test reproduces each deviation with a minimal file.
"""

import math
from pathlib import Path
from xml.etree.ElementTree import Element

from ..engines.file_kind import MJCF, URDF, file_kind, xml_root

JOINTS = ("joint", "freejoint")
ORIENTATIONS = ("quat", "axisangle", "euler", "xyaxes", "zaxis")

OUTER_ROOT = "a first body without a joint is put at the world's origin"
ROTATED_ROOT = "a free body that the file shows at x, turned by R, is shifted by x - R x"
CLASS_ANCHOR = "the anchor (pos) that a joint has from its default class is not read"
SHARED_REF = "the ref of one of several joints of a body is not read"
FRAME = "a <frame> is passed over with the joints and bodies in it"
INCLUDE = "included files are not read"
NAMELESS = "bodies without a name are passed over, or taken for each other"

FIXED_AXES = "the capitals of an eulerseq are not read as fixed axes"
COMPILERS = "several <compiler>, or one behind <worldbody>, do not hold for the whole file"
LONG_AXIS = "the axis of an axisangle is not scaled to length 1"
FREE_ANCHOR = "the pos of a free joint, which has no anchor, shifts the body"
PLANE = "the axis of a planar joint is not read"
QUATERNION = "the quat_xyzw of an origin is not read"


def known_deviations(path: Path, engine: str = "Pinocchio") -> list[str]:
    """Return a sentence for each known deviation of an engine on a file."""
    try:
        kind, root = file_kind(path), xml_root(path)
        deviations = DEVIATIONS[kind, engine](root) if (kind, engine) in DEVIATIONS else {}
    except (ValueError, OSError):
        return []
    return [sentence for sentence, is_affected in deviations.items() if is_affected]


def _of_planes(root: Element) -> dict[str, bool]:
    axes = [joint.find("axis") for joint in root.iterfind("joint[@type='planar']")]
    xyz = [_numbers("1 0 0" if axis is None else axis.get("xyz", "1 0 0")) for axis in axes]
    return {PLANE: any(x or y or z < 0.0 for x, y, z in xyz)}


def _of_origins(root: Element) -> dict[str, bool]:
    return {QUATERNION: root.find("joint/origin[@quat_xyzw]") is not None}


def _of_characters(root: Element) -> dict[str, bool]:
    tags = [*(child.tag for child in root), "worldbody"]
    axes = [_numbers(e.get("axisangle", ""))[:3] for e in root.iter() if _has(e, "axisangle")]
    first = root.find("worldbody/body")
    defaults = root.findall(".//default/joint")
    bodies = [
        (body, [child for child in body if child.tag in JOINTS]) for body in root.iter("body")
    ]
    moving = ("body", *JOINTS)
    return {
        OUTER_ROOT: first is not None
        and _has(first, "pos", *ORIENTATIONS)
        and all(child.tag not in JOINTS for child in first),
        ROTATED_ROOT: any(
            _has(body, *ORIENTATIONS)
            and any(joint.tag == "freejoint" or joint.get("type") == "free" for joint in joints)
            for body, joints in bodies
        ),
        CLASS_ANCHOR: any(_has(joint, "pos") for joint in defaults),
        SHARED_REF: any(
            len(joints) > 1 and any(_has(joint, "ref") for joint in (*defaults, *joints))
            for _, joints in bodies
        ),
        FRAME: any(
            frame.find(f".//{tag}") is not None for frame in root.iter("frame") for tag in moving
        ),
        INCLUDE: root.find(".//include") is not None,
        NAMELESS: any(not body.get("name") for body, _ in bodies),
        FIXED_AXES: any(not e.get("eulerseq", "x").islower() for e in root.iter("compiler")),
        COMPILERS: tags.count("compiler") > 1 or "compiler" in tags[tags.index("worldbody") :],
        LONG_AXIS: any(abs(math.hypot(*axis) - 1.0) > 1e-12 for axis in axes),
        FREE_ANCHOR: any(
            joint.get("type") == "free" and _has(joint, "pos") for joint in root.iter("joint")
        ),
    }


DEVIATIONS = {
    (MJCF, "Pinocchio"): _of_characters,
    (URDF, "Pinocchio"): _of_planes,
    (URDF, "MuJoCo"): _of_origins,
}


def _numbers(text: str) -> list[float]:
    return [float(word) for word in text.split()]


def _has(element: Element, *attributes: str) -> bool:
    return any(name in element.attrib for name in attributes)
