"""Degenerate cases: the length of zero by which a textbook without guards divides."""

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference import rotation
from plumbob.reference.arguments import FloatArray
from plumbob.text.sentence import Sentence

from ..case import Case
from ..judgement import Finding
from ..laws import LAWS, finding
from .predictions import forward

# Shorter than this share of the reach counts as zero.
TINY = 1e-9


class Division(NamedTuple):
    """A place where a solver divides by zero."""

    cause: str  # a key of the table `divisions` in `laws.toml`
    link: int  # the place of a joint in the path


def forgiven(case: Case, method: str, failure: Sentence, *, is_law: bool = False) -> Finding:
    """Return the reservation about an unusable answer to a degenerate case, with its guard.

    The failure is a phrase, or (`is_law`) the whole sentence of a broken law.
    """
    path = case.facts["path"]
    x, target = forward(case.inputs)[0][path], case.inputs["target"]
    divisions = DIVISIONS.get(method, _no_division)(x, target, TINY * case.facts["reach"])
    division = next(divisions, Division("unknown", 0))
    joint, child = path[division.link], path[min(division.link + 1, len(path) - 1)]
    values: Mapping[str, Any] = {"joint": joint, "child": child, "about": case.about}
    cause = Sentence(LAWS["divisions"][division.cause]["sentence"], values)
    key = "numbers, degenerate, of a law" if is_law else "numbers, degenerate"
    return finding(key, index=int(joint), failure=failure, cause=cause)


def _no_division(x: FloatArray, target: FloatArray, tiny: float) -> Iterator[Division]:
    """Yield nothing: the method is unknown."""
    yield from ()


def _ccd(x: FloatArray, target: FloatArray, tiny: float) -> Iterator[Division]:
    """Yield the zero lengths of the first sweep of CCD."""
    for k in range(len(x) - 2, -1, -1):
        arm, direction = x[-1] - x[k], target - x[k]
        if np.linalg.norm(arm) < tiny:
            yield Division("arm", k)
        elif np.linalg.norm(direction) < tiny:
            yield Division("direction", k)
        elif _parallel(arm, direction):
            yield Division("same direction" if arm @ direction > 0.0 else "opposite direction", k)
        x[k + 1 :] = x[k] + rotation.rotate(rotation.between(arm, direction), x[k + 1 :] - x[k])


def _fabrik(x: FloatArray, target: FloatArray, tiny: float) -> Iterator[Division]:
    """Yield the zero lengths of the first two passes of FABRIK, and of the rotations after them."""
    before, root = np.diff(x, axis=0), x[0].copy()
    lengths = np.linalg.norm(before, axis=1)
    x[-1] = target
    for k in range(len(x) - 2, -1, -1):
        if np.linalg.norm(x[k] - x[k + 1]) < tiny:
            yield Division("backward pass", k)
        x[k] = _pulled(x[k + 1], x[k], lengths[k])
    x[0] = root
    for k in range(len(lengths)):
        x[k + 1] = _pulled(x[k], x[k + 1], lengths[k])
    for k, link in enumerate(np.diff(x, axis=0)):
        if lengths[k] < tiny:
            yield Division("link", k)
        elif _parallel(before[k], link):
            yield Division("link direction", k)


def _parallel(a: FloatArray, b: FloatArray) -> bool:
    """Return whether two directions are the same or opposite, up to rounding."""
    size = float(np.linalg.norm(a) * np.linalg.norm(b))
    return bool(np.linalg.norm(np.cross(a, b)) <= TINY * size)


def _pulled(fixed: FloatArray, moved: FloatArray, length: float) -> FloatArray:
    """Return where a joint comes that is pulled to a distance from another."""
    line = moved - fixed
    return fixed + line * length / max(float(np.linalg.norm(line)), 1e-300)


DIVISIONS = {"ccd": _ccd, "fabrik": _fabrik}
