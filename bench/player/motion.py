"""Motions to be played on a page: an arm on its curve, cloths beside each other, errors in colour.

A scene becomes HTML with its data, quantised to 16 bits; `SCRIPT` plays all scenes of a page
without any request. Errors are measured, not read off the drawing.
"""

import base64
import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from plumbob.text.html import environment
from plumbob.text.printable import visible

from ..figures.style import COLOURS

Floats = NDArray[np.float64]

_FOLDER = Path(__file__).parent


def squeezed(script: str) -> str:
    """Return a script without indentation and comments."""
    lines = (line.strip() for line in script.splitlines())
    return "".join(f"{line}\n" for line in lines if line and not line.startswith("//"))


SCRIPT = squeezed((_FOLDER / "motion.js").read_text(encoding="utf-8"))
STYLE = (_FOLDER / "motion.css").read_text(encoding="utf-8")
# The largest whole numbers of a coordinate, in 16 bits, and of the shade of an error, in 8.
_MAX_COORDINATE, _MAX_SHADE = 65535, 255


class Moving(NamedTuple):
    """The motion of a solver."""

    label: str  # name of the solver
    positions: Floats  # [m], (frame, point, 3)
    errors: Floats  # of each frame [m], (frame,)
    # of each point from its right position [m], (frame, point); None for an arm
    distances: Floats | None = None


class Scene(NamedTuple):
    """Motions of solvers with the same frames."""

    name: str  # within the page
    title: str  # heading
    shows: str  # a sentence on its contents
    motions: Sequence[Moving]  # by solver; the first are shown first
    seconds: float  # from frame to frame [s]
    measure: str  # name of the error, such as "distance to the target"
    view: tuple[float, float]  # azimuth and height of the camera [rad]
    panes: int = 1  # number of motions beside each other
    curve: Floats | None = None  # that an arm follows [m], (point, 3); None for a cloth
    marked: Sequence[int] = ()  # pinned points

    def checked(self) -> "Scene":
        """Return the scene if all its motions have the same frames and points.

        Raises:
            ValueError: if they have not, or a marked point does not exist.
        """
        shape = np.shape(self.motions[0].positions)
        for motion in self.motions:
            distances = () if motion.distances is None else motion.distances
            shapes = [np.shape(array) for array in (motion.positions, motion.errors, distances)]
            expected = [shape, shape[:1], (0,) if motion.distances is None else shape[:2]]
            if len(shape) != 3 or shape[2] != 3 or 0 in shape or shapes != expected:
                raise ValueError(f"motions: expected arrays of {expected}, got {shapes}")
        if self.curve is not None and np.shape(self.curve)[1:] != (3,):
            raise ValueError(f"curve: expected points, got {np.shape(self.curve)}")
        if any(not 0 <= i < shape[1] for i in self.marked):
            raise ValueError(f"marked: expected numbers of {shape[1]} points, got {self.marked}")
        return self

    def points(self) -> Floats:
        """Return all positions and the curve, (point, 3), without positions far away.

        An exploding motion would make the others too small to see. Far is more than the size of the
        smallest motion from its middle.
        """
        arrays = [np.asarray(motion.positions, float).reshape(-1, 3) for motion in self.motions]
        arrays = [array[np.isfinite(array).all(axis=-1)] for array in arrays]
        smallest = min(arrays, key=lambda array: float(np.ptp(array, axis=0).max()))
        low, high = smallest.min(axis=0), smallest.max(axis=0)
        points = np.concatenate(arrays if self.curve is None else [*arrays, self.curve])
        is_near = np.abs(points - (low + high) / 2) <= (high - low).max()
        return np.asarray(points[is_near.all(axis=-1)])


def fragment(scene: Scene) -> Markup:
    """Return a scene as a part of a page with `STYLE` and `SCRIPT`."""
    low, high = decades(scene)
    template = environment(_FOLDER).get_template("motion.html")
    text = template.render(
        scene=scene,
        data=Markup(json.dumps(data_of(scene), separators=(",", ":"), allow_nan=False)),
        labels=[visible(motion.label) for motion in scene.motions],
        panes=range(min(scene.panes, len(scene.motions))),
        frames=len(scene.motions[0].positions),
        ticks=["≤ " * (k == low) + length(10.0**k) for k in range(low, high + 1)],
    )
    return Markup(text)


def page(scene: Scene) -> str:
    """Return a page with this scene only."""
    return (
        environment(_FOLDER)
        .get_template("motion_page.html")
        .render(
            scene=scene,
            fragment=fragment(scene),
            style=Markup(STYLE),
            script=Markup(SCRIPT),
            colours=COLOURS,
        )
    )


def data_of(scene: Scene) -> dict[str, Any]:
    """Return a scene as the data for `SCRIPT`: numbers, and arrays as base64; no names."""
    points = scene.points()
    low, high = points.min(axis=0), points.max(axis=0)
    size = float((high - low).max()) or 1.0
    ends = decades(scene)
    return {
        "points": int(np.shape(scene.motions[0].positions)[1]),
        "seconds": scene.seconds,
        "extent": [round(float(x), 4) for x in (high - low) / size],
        "view": [round(float(x), 4) for x in scene.view],
        "decades": ends,
        "curve": "" if scene.curve is None else _packed(scene.curve, low, size),
        "marked": [int(i) for i in scene.marked],
        "motions": [
            {
                "at": _packed(motion.positions, low, size),
                "errors": [float(f"{e:.3g}") if math.isfinite(e) else None for e in motion.errors],
                "shades": "" if motion.distances is None else _shades(motion.distances, ends),
            }
            for motion in scene.motions
        ],
    }


def _packed(points: Floats, low: Floats, size: float) -> str:
    """Return coordinates as 16 bits each, little-endian, non-finite values as 0."""
    with np.errstate(invalid="ignore"):
        scaled = np.nan_to_num(np.round((np.asarray(points) - low) / size * _MAX_COORDINATE))
    return base64.b64encode(np.clip(scaled, 0, _MAX_COORDINATE).astype("<u2").tobytes()).decode()


def _shades(distances: Floats, ends: tuple[int, int]) -> str:
    """Return the logarithms of distances as 8 bits each, from the first decade to the last."""
    low, high = ends
    with np.errstate(divide="ignore", invalid="ignore"):
        shades = np.round(_MAX_SHADE * (np.log10(distances) - low) / (high - low))
    shades = np.nan_to_num(shades, nan=_MAX_SHADE, posinf=_MAX_SHADE, neginf=0)
    return base64.b64encode(np.clip(shades, 0, _MAX_SHADE).astype(np.uint8).tobytes()).decode()


def decades(scene: Scene) -> tuple[int, int]:
    """Return the powers of ten between which the colours lie, at most four decades."""
    arrays = [m.errors if m.distances is None else m.distances for m in scene.motions]
    errors = np.concatenate([np.ravel(array) for array in arrays])
    errors = errors[np.isfinite(errors) & (errors > 0)]
    if not errors.size:
        return -4, 0
    high = max(-8, min(2, math.ceil(math.log10(float(errors.max())))))
    low = math.floor(math.log10(float(np.quantile(errors, 0.1))))
    return max(high - 4, min(low, high - 2)), high


def length(metres: float) -> str:
    """Return a length in words, to two digits."""
    if metres >= 1e3:
        return "> 1 km"
    for unit, size in (("m", 1.0), ("mm", 1e-3), ("µm", 1e-6), ("nm", 1e-9)):
        if metres >= 0.999 * size:
            digits = float(f"{metres / size:.2g}")
            return f"{digits:.0f} {unit}" if digits >= 10 else f"{digits:g} {unit}"
    return "< 1 nm" if metres > 0.0 else "0"
