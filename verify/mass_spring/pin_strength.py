"""Measure how strongly pins are held that give way a little, by their momentum.

Springs and dampers conserve momentum: what gravity adds and the free particles lack, the pins have.
Over their velocity it is their mass, or it tells the penalty or the springs that hold them.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from plumbob.reference.arguments import FloatArray
from plumbob.text.sentence import Sentence

from .honest import Option
from .problem import SpringProblem

# The honest pins that have a strength, by the first word of `StepModel.pins`: each gets the words
# of another. Weightless pins are heavy, but no gravity acts on them.
KINDS = {"heavy": "heavy", "weightless": "heavy", "penalty": "penalty", "springs": "springs"}
# The least mass [kg] of pins that hold, and the share of their momentum that may be lost.
LEAST_MASS, ACCURACY = 1e2, 1e-2
# A problem, and the outputs of an answer to it.
PinnedAnswer = tuple[SpringProblem, Mapping[str, Any]]


def measured_pins(pins: Sequence[Option], answers: Sequence[PinnedAnswer]) -> list[Option]:
    """Return honest pins, of each kind with the strength that answers show."""
    answers = [(p, outputs) for p, outputs in answers if p.pinned.size]
    patterns = {option.fields["pins"].split()[0]: option for option in pins}
    measured = [
        _with_strength(patterns[name], kind, strength)
        for kind, name in KINDS.items()
        if name in patterns and (strength := _strength(kind, answers))
    ]
    replaced = {option.sentence.template for option in measured}
    return [*(o for o in pins if o.sentence.template not in replaced), *measured]


def _with_strength(pattern: Option, kind: str, strength: float) -> Option:
    """Return a choice of pins with another strength."""
    digits = f"{strength:.4g}".replace("e+0", "e").replace("e+", "e")
    message, pins = Sentence(pattern.sentence.template, {"strength": digits}), f"{kind} {digits}"
    return pattern._replace(sentence=message, fields={"pins": pins})


def _strength(kind: str, answers: Sequence[PinnedAnswer]) -> float | None:
    """Return the mass [kg], penalty [kg] or stiffness [N/m] of pins, None if no number fits all."""
    for name in ("velocities", "positions"):
        rows = [_momenta(kind, p, outputs, name) for p, outputs in answers if name in outputs]
        pull, momentum = np.array(rows).reshape(-1, 2, 3).swapaxes(0, 1).reshape(2, -1)
        square = float(pull @ pull)
        if not np.isfinite(rows).all() or square == 0.0:
            continue
        strength = float(pull @ momentum) / square
        is_exact = np.abs(pull * strength - momentum).max() <= ACCURACY * np.abs(momentum).max()
        scale = answers[0][0].h ** 2 if kind == "springs" else 1.0
        if is_exact and strength * scale >= LEAST_MASS:
            return strength
    return None


def _momenta(
    kind: str, p: SpringProblem, outputs: Mapping[str, Any], name: str
) -> tuple[FloatArray, FloatArray]:
    """Return the pins' momentum per unit of their strength, and that which they have [kg m/s]."""
    v = outputs[name] if name == "velocities" else (outputs[name] - p.positions) / p.h
    free = np.setdiff1d(np.arange(p.count), p.pinned)
    taken = p.h * p.constant[free].sum(0) - p.masses[free] @ (v - p.velocities)[free]
    if kind != "weightless":
        taken = taken + p.h * p.constant[p.pinned].sum(0)
    if kind in ("penalty", "springs"):
        taken = taken - p.masses[p.pinned] @ v[p.pinned]
    scale = p.h**2 if kind == "springs" else 1.0
    return scale * v[p.pinned].sum(0), taken
