"""Motions to be played on a page: an arm on its curve, cloths beside each other, errors in colour.

A scene becomes HTML that holds its own data, quantised to 16 bits; `SCRIPT` plays all scenes of a
page and asks nothing of the network. Errors are those measured, not read off what is drawn.
"""

import base64
import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup
from numpy.typing import NDArray

from ..figures.style import COLOURS
from ..text import visible

Floats = NDArray[np.float64]

_HERE = Path(__file__).parent


def squeezed(script: str) -> str:
    """Return a script without indents and comments, which a page need not carry."""
    lines = (line.strip() for line in script.splitlines())
    return "".join(f"{line}\n" for line in lines if line and not line.startswith("//"))


SCRIPT = squeezed((_HERE / "motion.js").read_text(encoding="utf-8"))
STYLE = (_HERE / "motion.css").read_text(encoding="utf-8")
# The largest whole number of 16 bits; the errors of points have 8.
_FULL, _SHADES = 65535, 255
# Digits of an error that are written.
_DIGITS = 3


class Moving(NamedTuple):
    """How one solver moves.

    Attributes:
        label: how it is written.
        positions: [m], shape (frame, point, 3).
        errors: of the whole in each frame [m], (frame,).
        distances: of each point from where it should be [m], (frame, point); None for an arm.
    """

    label: str
    positions: Floats
    errors: Floats
    distances: Floats | None = None


class Scene(NamedTuple):
    """What moves, by one or more solvers, all with the same frames.

    Attributes:
        name: within the page.
        title: what it is called.
        shows: what is to be seen.
        motions: by solver; the first ones are shown first.
        seconds: from frame to frame [s].
        measure: what the error is, as in "distance to the target".
        view: where the camera stands: azimuth and height [rad].
        panes: how many are shown beside each other.
        curve: what an arm follows [m], (point, 3); None for a cloth.
        marked: points that are pinned.
    """

    name: str
    title: str
    shows: str
    motions: Sequence[Moving]
    seconds: float
    measure: str
    view: tuple[float, float]
    panes: int = 1
    curve: Floats | None = None
    marked: Sequence[int] = ()

    def checked(self) -> "Scene":
        """Return the scene if all its motions have the same frames and points.

        Raises:
            ValueError: if they have not, or a marked point is none.
        """
        shape = np.shape(self.motions[0].positions)
        for one in self.motions:
            shapes = [
                np.shape(one.positions),
                np.shape(one.errors),
                np.shape(() if one.distances is None else one.distances),
            ]
            wanted = [shape, shape[:1], shape[:2] if one.distances is not None else (0,)]
            if len(shape) != 3 or shape[2] != 3 or 0 in shape or shapes != wanted:
                raise ValueError(f"motions: expected arrays of {wanted}, got {shapes}")
        if self.curve is not None and np.shape(self.curve)[1:] != (3,):
            raise ValueError(f"curve: expected points, got {np.shape(self.curve)}")
        if any(not 0 <= i < shape[1] for i in self.marked):
            raise ValueError(f"marked: expected numbers of {shape[1]} points, got {self.marked}")
        return self


def fragment(scene: Scene) -> Markup:
    """Return a scene as a part of a page that has `STYLE` and `SCRIPT`."""
    low, high = decades(scene)
    return Markup(
        _environment()
        .get_template("motion.html")
        .render(
            scene=scene,
            data=Markup(json.dumps(data_of(scene), separators=(",", ":"), allow_nan=False)),
            labels=[visible(one.label) for one in scene.motions],
            panes=range(min(scene.panes, len(scene.motions))),
            frames=len(scene.motions[0].positions),
            ticks=["≤ " * (k == low) + length(10.0**k) for k in range(low, high + 1)],
        )
    )


def page(scene: Scene) -> str:
    """Return a page that shows a scene and nothing else."""
    template = _environment().get_template("motion_page.html")
    return template.render(
        scene=scene,
        fragment=fragment(scene),
        style=Markup(STYLE),
        script=Markup(SCRIPT),
        colours=COLOURS,
    )


def _environment() -> Environment:
    return Environment(
        loader=FileSystemLoader(_HERE),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def data_of(scene: Scene) -> dict[str, Any]:
    """Return a scene as what `SCRIPT` reads: numbers, and arrays as base64; no name is in it."""
    every = [np.asarray(one.positions, dtype=float).reshape(-1, 3) for one in scene.motions]
    every += [] if scene.curve is None else [np.asarray(scene.curve, dtype=float)]
    low = np.min([np.nanmin(np.where(np.isfinite(e), e, np.nan), axis=0) for e in every], axis=0)
    high = np.max([np.nanmax(np.where(np.isfinite(e), e, np.nan), axis=0) for e in every], axis=0)
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
                "at": _packed(one.positions, low, size),
                "errors": [_rounded(float(e)) for e in one.errors],
                "shades": "" if one.distances is None else _shades(one.distances, ends),
            }
            for one in scene.motions
        ],
    }


def _packed(points: Floats, low: Floats, size: float) -> str:
    """Return points as 16 bits a coordinate, little end first; one that is none as the least."""
    with np.errstate(invalid="ignore"):
        scaled = np.nan_to_num(np.round((np.asarray(points) - low) / size * _FULL))
    return base64.b64encode(np.clip(scaled, 0, _FULL).astype("<u2").tobytes()).decode()


def _shades(distances: Floats, ends: tuple[int, int]) -> str:
    """Return distances by their logarithm, as 8 bits each, from the first decade to the last."""
    low, high = ends
    with np.errstate(divide="ignore", invalid="ignore"):
        share = (np.log10(distances) - low) / (high - low)
    whole = np.nan_to_num(np.round(_SHADES * share), nan=_SHADES, posinf=_SHADES, neginf=0)
    return base64.b64encode(np.clip(whole, 0, _SHADES).astype(np.uint8).tobytes()).decode()


def decades(scene: Scene) -> tuple[int, int]:
    """Return the powers of ten that the colours go from and to, at most four decades."""
    found = [one.errors if one.distances is None else one.distances for one in scene.motions]
    values = np.concatenate([np.ravel(part) for part in found])
    values = values[np.isfinite(values) & (values > 0)]
    if not values.size:
        return -4, 0
    high = max(-8, min(2, math.ceil(math.log10(float(values.max())))))
    low = math.floor(math.log10(float(np.quantile(values, 0.1))))
    return max(high - 4, min(low, high - 2)), high


def _rounded(value: float) -> float | None:
    return float(f"{value:.{_DIGITS}g}") if math.isfinite(value) else None


def length(metres: float) -> str:
    """Return a length in words, two digits of it."""
    for unit, size in (("m", 1.0), ("mm", 1e-3), ("µm", 1e-6), ("nm", 1e-9)):
        if metres >= 0.999 * size:
            digits = float(f"{metres / size:.2g}")
            return f"{digits:.0f} {unit}" if digits >= 10 else f"{digits:g} {unit}"
    return "< 1 nm" if metres > 0.0 else "0"
