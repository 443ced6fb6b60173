"""Laws of a pose that a solver answers: local rotations, positions, or both."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from plumbob.reference import rotation
from plumbob.reference.arguments import FloatArray, IndexArray

from ..case import Case
from ..greeting import Greeting
from ..judgement import Finding, Verdict
from ..sentence import sentence
from . import laws, rounding
from .predictions import forward, with_effector_of

# Below this share of the size, in single precision, rotations that a helper rounds to the identity
# let positions and rotations part: one dead angle a joint.
DEAD_JOINTS = 4.0


@dataclass(frozen=True, eq=False)
class Posed:
    """An answer as the laws see it.

    Attributes:
        start: positions of all joints before the solve [m].
        path: joints from the root to the effector.
        local: their local rotations, normalised, with those of the start where none is a number
            that matters; or None.
        raw: their local rotations as they came, or None.
        given: their positions, or None [m].
        placed: where their rotations put the joints, by the reference; or None [m].
    """

    start: FloatArray
    path: IndexArray
    local: FloatArray | None
    raw: FloatArray | None
    given: FloatArray | None
    placed: FloatArray | None

    @property
    def positions(self) -> FloatArray:
        """Where the joints are: by the rotations if there are any [m]."""
        found = self.placed if self.placed is not None else self.given
        assert found is not None
        return found

    @property
    def finite(self) -> bool:
        """Whether the joints of the path are somewhere."""
        return bool(np.isfinite(self.positions[self.path]).all())

    @cached_property
    def drift(self) -> float:
        """How far rotations are off unit length at most."""
        if self.raw is None:
            return 0.0
        off = np.abs(np.linalg.norm(self.raw, axis=-1) - 1.0)
        return float(np.nanmax(off[self.path], initial=0.0))

    @property
    def comparable(self) -> Mapping[str, Any]:
        """What variants are compared with; the effector's own rotation moves nothing above it."""
        found: dict[str, Any] = {}
        if self.given is not None:
            found["positions"] = self.given
        if self.local is not None:
            found["local_rotations"], found["placed"] = self.local, self.placed
        return found

    def distance(self, case: Case) -> float:
        """Return how far the effector is from its target [m]."""
        return float(np.linalg.norm(self.positions[self.path[-1]] - case.inputs["target"]))


def understood(values: Mapping[str, Any], inputs: Mapping[str, Any], facts: Mapping[str, Any]
               ) -> Posed:  # fmt: skip
    """Return an answer as the laws see it."""
    raw, given = values.get("local_rotations"), values.get("positions")
    local, placed = None, None
    if raw is not None:
        local = with_effector_of(np.array(raw), inputs)
        lengths = np.linalg.norm(local, axis=-1, keepdims=True)
        with np.errstate(all="ignore"):
            local = local / lengths
        placed, _ = forward(inputs, local=local)
    start = facts["start"]
    return Posed(start, facts["path"], local, raw, given, placed)


def all_of(posed: Posed, case: Case, greeting: Greeting) -> list[Finding]:
    """Return the findings that hold for every pose, whatever its target."""
    found = []
    if posed.local is not None:
        found += rotation_laws(posed, case, greeting)
    if posed.given is not None:
        found += position_laws(posed, case, greeting)
    if posed.local is not None and posed.given is not None:
        found += agreement(posed, case, greeting)
    if posed.local is None and posed.given is None:
        told = sentence("The answer has neither rotations nor positions.")
        found.append(Finding("numbers", Verdict.BROKEN, np.inf, 0.0, "", told))
    return found


def rotation_laws(posed: Posed, case: Case, greeting: Greeting) -> list[Finding]:
    """Return the findings of local rotations: numbers, norms, joints that have to stay."""
    assert posed.raw is not None
    assert posed.local is not None
    bound = rounding.rotations(greeting.epsilon, len(posed.raw))
    found = []
    lengths = np.linalg.norm(posed.raw, axis=-1)
    usable = np.isfinite(lengths) & (lengths > 0.0)
    effector = case.inputs["effector"]
    if not usable.all():
        found.append(_unusable(usable, posed, effector, bound))
    if not np.isfinite(posed.local).all():
        return found
    if usable.any():
        found.append(laws.unit(np.where(usable, lengths, 1.0), bound))
    start = case.inputs["local_rotations"]
    theirs = np.where(usable[:, None], posed.raw / np.where(usable, lengths, 1.0)[:, None], start)
    moved = laws.angles(theirs, start / np.linalg.norm(start, axis=-1, keepdims=True))
    moved[posed.path[:-1]] = 0.0
    return [*found, _untouched(moved, bound, effector)]


def _unusable(usable: Any, posed: Posed, effector: int, bound: float) -> Finding:
    """Return the finding of rotations that are no numbers; the effector's own may not matter."""
    bad = int(np.argmin(usable))
    assert posed.local is not None
    only = bad == effector and np.isfinite(posed.local).all()
    told = sentence("The local rotation of joint {joint} is not a number or zero.", joint=bad)
    verdict = Verdict.RIGHT_BUT if only else Verdict.BROKEN
    return Finding("numbers", verdict, np.inf, bound, "", told, bad)


def _untouched(moved: FloatArray, bound: float, effector: int) -> Finding:
    joint = int(np.argmax(moved))
    if joint == effector:
        told = sentence(
            "It rotates the effector itself by {error:.2g} rad, which brings the effector nowhere "
            "but moves what is below.",
            error=moved[joint],
        )
        verdict = Verdict.RIGHT_BUT
    else:
        told = sentence(
            "It rotates joint {joint}, which is not on the path from the root to the effector.",
            joint=joint,
        )
        verdict = Verdict.WRONG
    return laws.bounded(
        "joints off the path", moved[joint], bound, "rad", told, verdict=verdict, where=joint
    )


def position_laws(posed: Posed, case: Case, greeting: Greeting) -> list[Finding]:
    """Return the findings of positions: numbers, the root's place, link lengths, branches."""
    x = posed.given
    assert x is not None
    size = case.facts["size"]
    bound = rounding.positions(greeting.epsilon, len(x), size, posed.drift)
    if not np.isfinite(x).all():
        return [laws.no_numbers("numbers", x.sum(axis=-1), bound)]
    parents, offsets = case.inputs["parents"], case.inputs["offsets"]
    moved = float(np.linalg.norm(x[0] - offsets[0]))
    told = sentence("The root has moved by {error:.2g} m.", error=moved)
    found = [laws.bounded("root in place", moved, bound, "m", told, where=0)]
    found.append(_lengths(x, parents, offsets, bound))
    found.append(_branches(x, parents, offsets, bound))
    return found


def _lengths(x: FloatArray, parents: IndexArray, offsets: FloatArray, bound: float) -> Finding:
    lengths = np.linalg.norm(x[1:] - x[parents[1:]], axis=-1)
    off = np.abs(lengths - np.linalg.norm(offsets[1:], axis=-1))
    worst = int(np.argmax(off)) + 1 if len(off) else 0
    error = off[worst - 1] if len(off) else 0.0
    first = int(np.argmax(off > bound)) + 1 if (off > bound).any() else worst
    told = sentence(
        "The link to joint {joint} has another length than its offset, by {error:.2g} m.",
        joint=worst,
        error=error,
    )
    return laws.bounded("link lengths", error, bound, "m", told, where=first)


def _branches(x: FloatArray, parents: IndexArray, offsets: FloatArray, bound: float) -> Finding:
    """Return whether the children of a joint keep their distances: they rotate as one body."""
    error, joint = 0.0, 0
    for j in range(2, len(parents)):
        for other in np.flatnonzero(parents[:j] == parents[j]):
            was = np.linalg.norm(offsets[j] - offsets[other])
            off = abs(float(np.linalg.norm(x[j] - x[other]) - was))
            if off > error:
                error, joint = off, j
    told = sentence(
        "Joint {joint} does not keep its distance from another child of the same parent: it is "
        "{error:.2g} m off. A parent rotates all its children as one body.",
        joint=joint,
        error=error,
    )
    return laws.bounded("branches", error, 2.0 * bound, "m", told, where=joint)


def agreement(posed: Posed, case: Case, greeting: Greeting) -> list[Finding]:
    """Return whether positions are where the rotations put the joints."""
    assert posed.given is not None
    assert posed.placed is not None
    errors = np.linalg.norm(posed.given - posed.placed, axis=-1)
    if not np.isfinite(errors).all():
        return []
    size = case.facts["size"]
    bound = 2.0 * rounding.positions(greeting.epsilon, len(errors), size, posed.drift)
    worst = int(np.argmax(errors))
    dead = DEAD_JOINTS * rounding.DEAD_ANGLE[greeting.precision] * case.facts["reach"]
    told = sentence(
        "Joint {joint} is {error:.2g} m from where the answer's rotations put it.",
        joint=worst,
        error=errors[worst],
    )
    verdict = Verdict.RIGHT_BUT if errors[worst] <= dead else Verdict.WRONG
    off = errors > bound
    first = int(np.argmax(off)) if off.any() else worst
    return [
        laws.bounded(
            "rotations agree with positions", errors[worst], bound, "m", told,
            verdict=verdict, where=first,
        )
    ]  # fmt: skip


def apart_in_worlds(posed: Posed, base: Posed, world: Sequence[Any]) -> float:
    """Return how far an answer is from another one brought into its world [m]."""
    Q, scale, shift = world
    if not (posed.finite and base.finite):
        return np.nan
    moved = scale * rotation.rotate(Q, base.positions[base.path]) + shift
    return float(np.abs(posed.positions[posed.path] - moved).max())
