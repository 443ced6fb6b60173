"""Draw docs/architecture.svg from the imports: `make drawing`.

Each room of the house is a panel, and each package or module of it a box that stands above
everything it imports. An arrow points from a box to what it imports; where a chain of arrows leads
there as well, it is left out. Between rooms all imports together are one arrow.
"""

import ast
import functools
import re
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

ROOT = Path(__file__).parents[1]
DRAWING = ROOT / "docs" / "architecture.svg"
COLOURS = {
    "plumbob": "#8a4a9f",
    "bench": "#c4500c",
    "verify": "#a8761b",
    "crosscheck": "#0b7a5b",
    "reference": "#0b62a8",
    "process": "#57606a",
    "text": "#57606a",
}
ROOMS = list(COLOURS)  # from the top
GROUND = ("process", "text")  # the ground floors, folders of `plumbob/`
WIDTH, BOX, ROW, GAP, MARGIN, HEAD = 1180, 22, 58, 10, 16, 44
LETTER = 6.6  # the width of one [px]
TEXT = {"font_family": "DejaVu Sans, sans-serif", "font_size": 11, "fill": "#22272e"}
TITLE = TEXT | {"font_size": 14, "font_weight": "bold"}
ARROW = {"fill": "none", "stroke": "#8b949e", "stroke_width": 0.8, "marker_end": "url(#head)"}

# These rooms are packages of `plumbob`; here they are panels beside it.
FOLDERS = r"^plumbob\.(?=(bench|verify|crosscheck|reference|process|text)\b)"

Graph = dict[str, set[str]]


def folder(room: str) -> Path:
    """Return the folder of a room."""
    return ROOT / "plumbob" / room if room in GROUND else ROOT / room


def modules(room: str) -> Iterator[tuple[Path, str]]:
    """Yield each file of a room with its dotted name."""
    for path in sorted(folder(room).rglob("*.py")):
        parts = (room, *path.relative_to(folder(room)).with_suffix("").parts)
        if room != "plumbob" or parts[1] not in GROUND:
            yield path, ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


@functools.cache
def imports(path: Path, name: str) -> tuple[str, ...]:
    """Return the dotted names that a module imports, relative ones resolved."""
    package = name.split(".") if path.stem == "__init__" else name.split(".")[:-1]
    found: list[str] = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            above = package[: len(package) - node.level + 1] if node.level else []
            stem = [*above, *(node.module.split(".") if node.module else [])]
            found += [".".join([*stem, alias.name]) for alias in node.names]
    return tuple(re.sub(FOLDERS, "", name) for name in found)


def box(name: str) -> str | None:
    """Return the package or module directly below a room that a dotted name lies in."""
    room, *rest = name.split(".")
    if room not in ROOMS or not rest:
        return None
    place = folder(room) / rest[0]
    exists = place.is_dir() or place.with_suffix(".py").exists()
    return f"{room}/{rest[0]}" if exists else None


def graph(room: str) -> Graph:
    """Return what each box of a room imports within it."""
    found: Graph = {}
    for path, name in modules(room):
        own = box(name)
        if own is not None:
            others = {box(other) for other in imports(path, name) if other.startswith(room)}
            found.setdefault(own, set()).update(one for one in others - {own} if one)
    return found


def crossings(room: str, other: str) -> int:
    """Return how many modules of one room import from another."""
    return sum(
        any(used.split(".")[0] == other for used in imports(path, name))
        for path, name in modules(room)
    )


def depth(arrows: Graph, name: str, above: tuple[str, ...] = ()) -> int:
    """Return the length of the longest chain of imports below a box, cycles cut."""
    below = [depth(arrows, one, (*above, name)) for one in sorted(arrows[name]) if one not in above]
    return 1 + max(below) if below else 0


def reachable(arrows: Graph, name: str) -> set[str]:
    """Return all boxes that a chain of arrows leads to."""
    seen: set[str] = set()
    ahead = [name]
    while ahead:
        new = arrows[ahead.pop()] - seen
        seen |= new
        ahead += new
    return seen


def reduced(arrows: Graph) -> Graph:
    """Return the arrows without those that a chain of others replaces; cycles keep theirs."""
    ahead = {name: reachable(arrows, name) for name in arrows}
    return {
        name: {
            one
            for one in below
            if not any(one in ahead[other] and name not in ahead[other] for other in below - {one})
        }
        for name, below in arrows.items()
    }


def rows(arrows: Graph) -> list[list[str]]:
    """Return the boxes from the top, those that import the longest chains first."""
    depths = {name: depth(arrows, name) for name in arrows}
    layers = [
        sorted(name for name in arrows if depths[name] == k)
        for k in range(max(depths.values()), -1, -1)
    ]
    return [line for layer in layers if layer for line in broken(layer)]


def broken(layer: list[str]) -> list[list[str]]:
    """Return a layer in as many lines as it needs."""
    lines: list[list[str]] = [[]]
    for name in layer:
        if sum(width(one) + GAP for one in [*lines[-1], name]) > WIDTH - 4 * MARGIN:
            lines.append([])
        lines[-1].append(name)
    return lines


def width(name: str) -> float:
    """Return the width of a box [px]."""
    return LETTER * 1.1 * len(name.split("/")[1]) + 14


def ordered(lines: list[list[str]], arrows: Graph) -> list[list[str]]:
    """Return the lines with boxes near those above that point at them."""
    place: dict[str, float] = {}
    result = []
    for line in lines:
        from_above = {
            name: [place[one] for one in sorted(place) if name in arrows[one]] for name in line
        }
        middle = {name: sum(at) / len(at) if at else 0.5 * WIDTH for name, at in from_above.items()}
        line = sorted(line, key=lambda name: (middle[name], name))
        place |= {name: x + 0.5 * width(name) for name, x in spread(line).items()}
        result.append(line)
    return result


def spread(line: list[str]) -> dict[str, float]:
    """Return the left edges of boxes in a line, evenly over the width [px]."""
    total = sum(width(name) for name in line)
    gap = (WIDTH - 2 * MARGIN - total) / (len(line) + 1)
    edges, x = {}, MARGIN + gap
    for name in line:
        edges[name] = x
        x += width(name) + gap
    return edges


def element(parent: ElementTree.Element, tag: str, text: str = "", **attributes: object) -> None:
    """Add an element; numbers are rounded, `class_` is the class."""
    values = {
        key.rstrip("_").replace("_", "-"): f"{value:.1f}"
        if isinstance(value, float)
        else f"{value}"
        for key, value in attributes.items()
    }
    ElementTree.SubElement(parent, tag, values).text = text or None


def draw_room(svg: ElementTree.Element, room: str, top: float) -> float:
    """Draw a room from a height on; return where it ends [px]."""
    arrows = reduced(graph(room))
    lines = ordered(rows(arrows), arrows)
    end = top + HEAD + ROW * len(lines) - (ROW - BOX) + MARGIN
    colour = COLOURS[room]
    element(
        svg, "rect", x=MARGIN / 2, y=top, width=WIDTH - MARGIN, height=end - top, rx=8,
        fill=colour, fill_opacity=0.06,
    )  # fmt: skip
    element(svg, "text", f"{room}/", x=2 * MARGIN, y=top + 22, **TITLE)
    corner = {
        name: (x, top + HEAD + ROW * i)
        for i, line in enumerate(lines)
        for name, x in spread(line).items()
    }
    for name in sorted(arrows):
        for other in sorted(arrows[name]):
            draw_arrow(svg, corner, name, other)
    for name, (x, y) in sorted(corner.items()):
        draw_box(svg, name, x, y, colour)
    return end


def draw_arrow(
    svg: ElementTree.Element, corner: dict[str, tuple[float, float]], name: str, other: str
) -> None:
    """Draw an arrow from the foot of a box to the head of another."""
    (x0, y0), (x1, y1) = corner[name], corner[other]
    x0, x1, y0 = x0 + 0.5 * width(name), x1 + 0.5 * width(other), y0 + BOX
    if y1 > y0:
        bend = 0.5 * (y1 - y0)
        path = f"M{x0:.1f} {y0:.1f}C{x0:.1f} {y0 + bend:.1f} {x1:.1f} {y1 - bend:.1f}"
    else:  # a cycle: from foot to foot
        y1 += BOX
        path = f"M{x0:.1f} {y0:.1f}C{x0:.1f} {y0 + BOX:.1f} {x1:.1f} {y1 + BOX:.1f}"
    element(svg, "path", d=f"{path} {x1:.1f} {y1:.1f}", **ARROW)


def draw_box(svg: ElementTree.Element, name: str, x: float, y: float, colour: str) -> None:
    """Draw a package or a module."""
    is_package = (ROOT / name).is_dir()
    label = name.split("/")[1] + ("/" if is_package else "")
    edge = {"stroke": colour, "stroke_width": 1.8 if is_package else 0.7}
    weight = {"font_weight": "bold"} if is_package else {}
    element(svg, "rect", x=x, y=y, width=width(name), height=BOX, rx=4, fill="#ffffff", **edge)
    middle = {"x": x + 0.5 * width(name), "y": y + 15, "text_anchor": "middle"}
    element(svg, "text", label, **middle, **TEXT, **weight)


def drawing() -> str:
    """Return the drawing as SVG text."""
    svg = ElementTree.Element("svg", xmlns="http://www.w3.org/2000/svg")
    element(svg, "title", "The house of Plumbob, drawn from its imports")
    defs = ElementTree.SubElement(svg, "defs")
    marker = ElementTree.SubElement(
        defs, "marker", id="head", viewBox="0 0 8 8", refX="7", refY="4", markerWidth="7",
        markerHeight="7", orient="auto", markerUnits="userSpaceOnUse",
    )  # fmt: skip
    element(marker, "path", d="M0 0L8 4L0 8z", fill="#8b949e")
    top = float(MARGIN)
    for i, room in enumerate(ROOMS):
        top = draw_room(svg, room, top)
        if i + 1 < len(ROOMS):
            draw_passage(svg, ROOMS[: i + 1], ROOMS[i + 1], top)
            top += 46
    height = top + MARGIN
    svg.set("viewBox", f"0 0 {WIDTH} {height:.0f}")
    svg.set("width", f"{WIDTH}")
    svg.set("height", f"{height:.0f}")
    ElementTree.indent(svg, " ")
    return ElementTree.tostring(svg, encoding="unicode") + "\n"


def draw_passage(svg: ElementTree.Element, above: list[str], room: str, top: float) -> None:
    """Draw the arrow of all imports of a room by those above it."""
    x = 0.5 * WIDTH
    path = f"M{x:.1f} {top + 4:.1f}V{top + 38:.1f}"
    element(svg, "path", d=path, **ARROW | {"stroke_width": 3})
    counts = [f"{crossings(one, room)} modules of {one}/" for one in above]
    text = " and ".join(counts) + f" import from {room}/"
    element(svg, "text", text, x=x + 14, y=top + 25, **TEXT)


if __name__ == "__main__":
    DRAWING.write_text(drawing(), encoding="utf-8")
