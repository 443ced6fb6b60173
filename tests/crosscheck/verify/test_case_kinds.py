"""Cases of whole kinds: zeros, springs pressed together, far coordinates, far rotations, losses.

The programs are written in loops and quaternions of their own, apart from the reference.
"""

from functools import cache

import numpy as np
import pytest

from plumbob.crosscheck.verify.functions import FunctionContestant
from plumbob.crosscheck.verify.greeting import Greeting, Step
from plumbob.crosscheck.verify.judgement import Verdict
from plumbob.crosscheck.verify.verify import DISCIPLINES, judge_cases

FORCES, ENERGY, STEP, MOTION = (
    "mass_spring_forces", "energy", "mass_spring_step", "mass_spring_motion",
)  # fmt: skip
PRECISIONS = {"double": np.float64, "single": np.float32}


@cache
def all_cases(task, precision="double"):
    return DISCIPLINES[task].cases(Greeting(1, (task,), precision=precision), "", 0, False)


def judged(task, function, cases, **declared):
    contestant = FunctionContestant({task: function}, Greeting(1, (task,), **declared))
    return judge_cases(contestant, task, "", cases)


def wrong_cases(report):
    return {one.case.name for one in report.judgements if one.verdict >= Verdict.WRONG}


# ---- mass-spring systems


class Springs:
    """Springs in a loop, with a rest length, a damper and a pull that may be misread."""

    def __init__(
        self, kind=np.float64, rest=lambda r: r, damper=lambda stretch: 1.0,
        pull=lambda stretch: stretch, factor=1.0,
    ):  # fmt: skip
        self.kind, self.rest, self.damper, self.pull = kind, rest, damper, pull
        self.factor = factor

    def pulls(self, inputs, x):
        """Yield the ends, the direction from the first to the second, and the stretch."""
        for s, (i, j) in enumerate(inputs["springs"]):
            d = x[j] - x[i]
            length = np.sqrt(d @ d)
            yield s, i, j, d / length, length - self.kind(self.rest(inputs["rest_lengths"][s]))

    def forces(self, **inputs):
        x, v, m, g, k, c = (
            np.asarray(inputs[name], dtype=self.kind)
            for name in (
                "positions", "velocities", "masses", "gravity", "stiffnesses", "dampings",
            )
        )  # fmt: skip
        f = m[:, None] * g
        for s, i, j, u, stretch in self.pulls(inputs, x):
            damper = c[s] * self.kind(self.damper(stretch)) * ((v[j] - v[i]) @ u)
            pair = (k[s] * self.kind(self.pull(stretch)) + damper) * u
            f[i] += pair
            f[j] -= pair
        return f

    def energy(self, **inputs):
        stiffnesses = inputs["stiffnesses"].astype(self.kind)
        springs = self.pulls(inputs, inputs["positions"].astype(self.kind))
        parts = [0.5 * stiffnesses[s] * self.pull(stretch) ** 2 for s, *_, stretch in springs]
        return {"elastic": float(sum(parts))}

    def step(self, **inputs):
        """Symplectic Euler."""
        h, x, v, m = (self.kind(inputs[n]) for n in ("h", "positions", "velocities", "masses"))
        v[inputs["pinned"]] = 0.0
        change = h * self.forces(**{**inputs, "positions": x, "velocities": v}) / m[:, None]
        change[inputs["pinned"]] = 0.0
        v = v + change
        return {"positions": x + h * v, "velocities": self.kind(self.factor) * v}

    def motion(self, steps, **inputs):
        frames = []
        for _ in range(steps):
            inputs |= self.step(**inputs)
            frames.append((inputs["positions"], inputs["velocities"]))
        return dict(
            zip(("positions", "velocities"), map(np.array, zip(*frames, strict=True)), strict=True)
        )


TASKS = {FORCES: "forces", ENERGY: "energy", STEP: "step", MOTION: "motion"}
DECLARED = {"step": Step("symplectic", damper="explicit", pins="eliminated")}
NAMES = (
    "two particles in flight", "one spring", "one spring, compressed", "one damped spring",
    "damped pendulum", "damped pendulum, compressed", "one spring of rest length zero",
    "three particles, some numbers zero",
)  # fmt: skip
ZEROS = {*NAMES[-2:]}
MISREADINGS = {
    "a rest length of 0 is 1": ({"rest": lambda r: r or 1.0}, ZEROS),
    "dampers in tension only": ({"damper": lambda stretch: stretch > 0.0}, {NAMES[5]}),
    "dampers in compression only": ({"damper": lambda stretch: stretch < 0.0}, {NAMES[4]}),
    "springs in tension only": ({"pull": lambda stretch: max(stretch, 0.0)}, {NAMES[2], NAMES[5]}),
    "springs in compression only": ({"pull": lambda stretch: min(stretch, 0.0)}, {NAMES[1]}),
}


def report_of_springs(task, precision="double", **misread):
    springs = Springs(PRECISIONS[precision], **misread)
    cases = [case for case in all_cases(task) if case.name in NAMES]
    return judged(task, getattr(springs, TASKS[task]), cases, precision=precision, **DECLARED)


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("task", TASKS)
def test_right_springs_are_right(task, precision):
    report = report_of_springs(task, precision)
    assert report.verdict is Verdict.RIGHT
    assert len(report.judgements) == len(NAMES)


@pytest.mark.parametrize("misreading", MISREADINGS)
@pytest.mark.parametrize("task", TASKS)
def test_zeros_and_both_signs_of_a_stretch_are_asked(task, misreading):
    misread, names = MISREADINGS[misreading]
    if task != ENERGY or "damper" not in misread:
        assert names <= wrong_cases(report_of_springs(task, **misread))


def test_energies_that_are_infinite_somewhere_are_wrong_and_named():
    def strain(rest_lengths, **inputs):
        scaled = inputs["stiffnesses"] / np.maximum(rest_lengths, 1e-300) ** 2
        return Springs().energy(rest_lengths=rest_lengths, **{**inputs, "stiffnesses": scaled})

    def infinite(**inputs):
        is_zero = inputs["rest_lengths"].min() == 0.0
        return {"elastic": np.inf} if is_zero else strain(**inputs)

    cases = [case for case in all_cases(ENERGY) if case.name in NAMES]
    assert judged(ENERGY, infinite, cases).verdict is Verdict.WRONG


def report_of_factor(factor, **step):
    springs = Springs(damper=lambda stretch: 0.0, factor=factor)
    cases = [case for case in all_cases(STEP) if case.name in NAMES]
    return judged(STEP, springs.step, cases, step=Step("symplectic", **step))


def test_a_factor_of_velocities_that_is_not_declared_is_a_loss_per_second():
    report = report_of_factor(0.99)
    assert report.verdict is Verdict.RIGHT_EXCEPT
    (words,) = {str(words) for one in report.judgements for words in one.complaints}
    assert "multiplied by 0.99" in words
    assert "18% of every speed" in words  # h is 0.05 s, and 0.99^20 is 0.82
    assert report_of_factor(1.0).verdict is Verdict.RIGHT


def test_a_factor_of_velocities_that_is_declared_is_right():
    report = report_of_factor(0.99, damper="global_factor", damping_factor=0.99)
    assert report.verdict is Verdict.RIGHT
