"""Known deviations of Pinocchio 4.1 from MuJoCo in reading MJCF, detected from the file.

A test reproduces each deviation with a minimal file.
"""

from collections.abc import Callable
from pathlib import Path
from xml.etree.ElementTree import Element

from ..engines.file_kind import MJCF, file_kind, xml_root

JOINTS = ("joint", "freejoint")
DEFAULTS = ".//default/joint"
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
        root = xml_root(path) if file_kind(path) == MJCF else Element("robot")
    except (ValueError, OSError):
        return []
    return [sentence for sentence, affects in DEVIATIONS.items() if affects(root)]


def _outer_root(root: Element) -> bool:
    body = root.find("worldbody/body")
    return body is not None and not _joints(body) and _has(body, "pos", *ORIENTATIONS)


def _rotated_root(root: Element) -> bool:
    return any(
        _has(body, *ORIENTATIONS)
        and any(joint.tag == "freejoint" or joint.get("type") == "free" for joint in _joints(body))
        for body in root.iter("body")
    )


def _shared_ref(root: Element) -> bool:
    by_class = any(_has(joint, "ref") for joint in root.iterfind(DEFAULTS))
    return any(
        len(joints) > 1 and (by_class or any(_has(joint, "ref") for joint in joints))
        for joints in map(_joints, root.iter("body"))
    )


def _joints(body: Element) -> list[Element]:
    return [child for child in body if child.tag in JOINTS]


def _has(element: Element, *attributes: str) -> bool:
    return any(name in element.attrib for name in attributes)


DEVIATIONS: dict[str, Callable[[Element], bool]] = {
    OUTER_ROOT: _outer_root,
    ROTATED_ROOT: _rotated_root,
    CLASS_ANCHOR: lambda root: any(_has(joint, "pos") for joint in root.iterfind(DEFAULTS)),
    SHARED_REF: _shared_ref,
    FRAME: lambda root: any(
        frame.find(f".//{tag}") is not None
        for frame in root.iter("frame")
        for tag in ("body", *JOINTS)
    ),
    INCLUDE: lambda root: root.find(".//include") is not None,
    NAMELESS: lambda root: any(not body.get("name") for body in root.iter("body")),
}
