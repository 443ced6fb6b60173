"""What a file of a robot, a character or a motion is, told by its name and its first element."""

import re
from pathlib import Path
from xml.etree import ElementTree

from reference.formats.source import LARGEST

URDF, MJCF, BVH = "URDF", "MJCF", "BVH"
# What takes the place of <include> in other files, and is no model by itself.
FRAGMENT = "fragment"
# The first element, behind a declaration, a document type and comments.
FIRST = re.compile(r"\s*(?:<\?.*?\?>|<!--.*?-->|<![A-Za-z].*?>|\s+)*<([^\s<>/!?]+)", re.DOTALL)
BY_SUFFIX = {".urdf": URDF, ".bvh": BVH}
BY_ROOT = {"robot": URDF, "mujoco": MJCF, "mujocoinclude": FRAGMENT}
XML = (".xml", ".mjcf")


def xml_root(path: Path) -> ElementTree.Element:
    """Return the root element of an XML file, white space before the declaration left out.

    Raises:
        ValueError: if it cannot be opened, or is not well-formed.
    """
    try:
        return ElementTree.fromstring(path.read_bytes().lstrip())
    except (OSError, ElementTree.ParseError) as error:
        raise ValueError(str(error)) from None


def file_kind(path: Path) -> str:
    """Return URDF, MJCF, BVH or FRAGMENT, "" if it is none of these.

    An XML file of MJCF that neither holds nor includes a <worldbody> is a fragment; one whose root
    is a <robot> without a <link> is none of these.

    Raises:
        OSError: if it cannot be opened.
    """
    suffix = path.suffix.lower()
    if suffix in BY_SUFFIX or suffix not in XML:
        return BY_SUFFIX.get(suffix, "")
    with path.open("rb") as file:
        text = file.read(LARGEST).decode(errors="replace").removeprefix("\ufeff")
    found = FIRST.match(text)
    kind = BY_ROOT.get(found[1], "") if found else ""
    if kind == MJCF and not ("<worldbody" in text or "<include" in text):
        return FRAGMENT
    return "" if kind == URDF and "<link" not in text else kind
