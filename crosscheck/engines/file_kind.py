"""Detect the format of a file from its name and its root element."""

import re
from pathlib import Path
from xml.etree import ElementTree

from plumbob.reference.formats.source import read_bytes, xml_encoding

URDF, MJCF, BVH = "URDF", "MJCF", "BVH"
# The content of an <include> in other files, not a model by itself.
FRAGMENT = "fragment"
# The root element, after a declaration, a document type and comments; possessive, to read a file
# without a root element once.
FIRST = re.compile(r"(?:<\?.*?\?>|<!--.*?-->|<![A-Za-z].*?>|\s++)*+<([^\s<>/!?]+)", re.DOTALL)
BY_SUFFIX = {".urdf": URDF, ".bvh": BVH}
BY_ROOT = {"robot": URDF, "mujoco": MJCF, "mujocoinclude": FRAGMENT}
XML = (".xml", ".mjcf")


def xml_root(path: Path) -> ElementTree.Element:
    """Return the root element of an XML file; white space before the declaration is allowed.

    Raise a ValueError if the file cannot be opened, or is not well-formed.
    """
    try:
        return ElementTree.fromstring(read_bytes(path).lstrip())
    except ElementTree.ParseError as error:
        raise ValueError(str(error)) from None


def file_kind(path: Path) -> str:
    """Return URDF, MJCF, BVH or FRAGMENT, or "" for other formats.

    An MJCF file without <worldbody> and <include> is a fragment; a <robot> without a <link> is
    another format. Raise a ValueError if the file cannot be read.
    """
    suffix = path.suffix.lower()
    if suffix in BY_SUFFIX or suffix not in XML:
        return BY_SUFFIX.get(suffix, "")
    content = read_bytes(path)
    text = content.decode(xml_encoding(content), errors="replace")
    root = FIRST.match(text)
    kind = BY_ROOT.get(root[1], "") if root else ""
    if kind == MJCF and not ("<worldbody" in text or "<include" in text):
        return FRAGMENT
    return "" if kind == URDF and "<link" not in text else kind
