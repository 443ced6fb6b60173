"""Known deviations of Pinocchio 4.1 from MuJoCo in reading MJCF, detected from the file.

A test reproduces each deviation with a minimal file.
"""

from pathlib import Path
from xml.etree.ElementTree import Element

from ..engines.file_kind import MJCF, file_kind, xml_root

JOINTS = ("joint", "freejoint")
ORIENTATIONS = ("quat", "axisangle", "euler", "xyaxes", "zaxis")

OUTER_ROOT = "a first body without a joint is put at the world's origin"
ROTATED_ROOT = "a free body that the file shows at x, turned by R, is shifted by x - R x"
CLASS_ANCHOR = "the anchor (pos) that a joint has from its default class is not read"
SHARED_REF = "the ref of one of several joints of a body is not read"
FRAME = "a <frame> is passed over with the joints and bodies in it"
INCLUDE = "included files are not read"
NAMELESS = "bodies without a name are passed over, or taken for each other"


def known_deviations(path: Path) -> list[str]:
    """Return a sentence for each known deviation that affects a file; none for a URDF."""
    try:
        if file_kind(path) != MJCF:
            return []
        root = xml_root(path)
    except (ValueError, OSError):
        return []
    return [sentence for sentence, is_affected in _deviations(root).items() if is_affected]


def _deviations(root: Element) -> dict[str, bool]:
    """Return whether each deviation affects the file of a root element."""
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
    }


def _has(element: Element, *attributes: str) -> bool:
    return any(name in element.attrib for name in attributes)
