"""Cases of whole kinds: zeros, springs pressed together, far coordinates, far rotations, losses.

The programs are written in loops and quaternions of their own, apart from the reference.
"""

from functools import cache

import numpy as np
import pytest

from plumbob.verify.functions import FunctionContestant
from plumbob.verify.greeting import Greeting, Step
from plumbob.verify.judgement import Verdict
from plumbob.verify.verify import DISCIPLINES, judge_cases, verify

pytestmark = pytest.mark.usefixtures("verdict_alone")

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


@pytest.mark.sample("forces")
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


# ---- robots


def product(a, b):
    return np.concatenate([
        [a[0] * b[0] - a[1:] @ b[1:]], a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:])
    ])  # fmt: skip


def rotated(q, v):
    return v + 2.0 * np.cross(q[1:], np.cross(q[1:], v) + q[0] * v)


def same(q, slides):
    return q


def slides_wrapped(q, slides):
    return np.where(slides, (q + np.pi) % (2.0 * np.pi) - np.pi, q)


def all_wrapped(q, slides):
    return (q + np.pi) % (2.0 * np.pi) - np.pi


def short_way(q):
    return q if q[0] >= 0.0 else -q


class Arm:
    """Robots by quaternions, with coordinates and errors of rotations that may be misread."""

    def __init__(self, kind=np.float64, read=same, sign=short_way, signs=same, axis=lambda a: a):
        self.kind, self.read, self.sign, self.axis = kind, read, sign, axis
        self.canonical = signs

    def tool(self, inputs, q):
        """Return the tool's position and quaternion, and its Jacobian."""
        numbers = {
            n: inputs[n].astype(self.kind)
            for n in ("origins", "orientations", "axes", "tool_position", "tool_rotation")
        }
        frames, axes = [], []
        for j, parent in enumerate(inputs["parents"]):
            x, r = frames[parent] if parent >= 0 else (np.zeros(3), np.eye(4)[0])
            x = x + rotated(r, numbers["origins"][j])
            r = product(r, numbers["orientations"][j])
            axis = numbers["axes"][j]
            axes.append(rotated(r, self.axis(axis) if inputs["slides"][j] else axis))
            if inputs["slides"][j]:
                x = x + q[j] * axes[j]
            else:
                r = product(r, np.append(np.cos(q[j] / 2), np.sin(q[j] / 2) * axis))
            frames.append((x, r))
        x, r = frames[inputs["effector"]]
        x, r = x + rotated(r, numbers["tool_position"]), product(r, numbers["tool_rotation"])
        J, j = np.zeros((6, len(q)), dtype=self.kind), inputs["effector"]
        while j >= 0:
            is_slide = inputs["slides"][j]
            J[:3, j] = axes[j] if is_slide else np.cross(axes[j], x - frames[j][0])
            J[3:, j] = 0.0 if is_slide else axes[j]
            j = inputs["parents"][j]
        return x, r / np.sqrt(r @ r), J

    def jacobian(self, q, slides, **inputs):
        return self.tool(inputs | {"slides": slides}, self.read(self.kind(q), slides))[2]

    def velocities(self, linear_velocity, angular_velocity, **inputs):
        twist = np.append(linear_velocity, angular_velocity)
        return np.linalg.pinv(self.jacobian(**inputs), 1e-5) @ twist

    def error(self, inputs, q, position, quaternion):
        x, r, J = self.tool(inputs, self.read(q, inputs["slides"]))
        turn, here = (self.canonical(self.kind(p), None) for p in (quaternion, r))
        turn = self.sign(product(turn, here * np.array([1, -1, -1, -1])))
        sine = np.sqrt(turn[1:] @ turn[1:])
        vector = 2.0 * np.arctan2(sine, turn[0]) / max(sine, 1e-9) * turn[1:]
        return np.append(position - x, vector).astype(self.kind), J

    def solve(self, inputs, q, *target):
        """Damped least squares whose damping follows the error; joints at limits are left out."""
        lower, upper = self.kind(inputs["lower"]), self.kind(inputs["upper"])
        q, damping = np.clip(self.kind(q), lower, upper), self.kind(1e-3)
        e, J = self.error(inputs, q, *target)
        for _ in range(inputs["max_iterations"]):
            if np.abs(e).max() <= 0.3 * inputs["tolerance_rotation"]:
                break
            gradient, step = J.T @ e, np.zeros_like(q)
            free = ~((q <= lower) & (gradient < 0.0) | (q >= upper) & (gradient > 0.0))
            A = J[:, free].T @ J[:, free] + damping * np.eye(free.sum(), dtype=self.kind)
            step[free] = np.linalg.solve(A, gradient[free])
            trial = np.clip(q + step, lower, upper)
            after, J_after = self.error(inputs, trial, *target)
            is_better = after @ after < e @ e
            q, e, J = (trial, after, J_after) if is_better else (q, e, J)
            damping = min(max(damping * self.kind(0.3 if is_better else 4.0), 1e-7), 1e3)
        return self.read(q, inputs["slides"])

    def pose(self, **inputs):
        target = inputs["target_position"], inputs["target_rotation"]
        return {"q": self.solve(inputs, inputs["start"], *target)}

    def track(self, **inputs):
        q, frames = inputs["start"], []
        for target in zip(inputs["target_positions"], inputs["target_rotations"], strict=True):
            q = self.solve(inputs, q, *target)
            frames.append(q)
        return {"q": np.array(frames)}


ROBOT_TASKS = {
    "robot_jacobian": "jacobian", "robot_velocity": "velocities",
    "robot_inverse_kinematics": "pose", "robot_track": "track",
}  # fmt: skip
FAR, OBLIQUE, ROTATION = "coordinates beyond pi", "oblique slides", "far rotation"


def report_of_arm(task, precision="double", **misread):
    arm = Arm(PRECISIONS[precision], **misread)
    cases = [
        case
        for case in all_cases(task, precision)
        if any(kind in case.name for kind in (FAR, OBLIQUE, ROTATION))
    ]
    return judged(task, getattr(arm, ROBOT_TASKS[task]), cases, precision=precision)


@pytest.mark.sample(without=["inverse_kinematics", "robot_track"])
@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("task", ROBOT_TASKS)
def test_a_right_arm_is_right(task, precision):
    report = report_of_arm(task, precision)
    assert report.verdict is Verdict.RIGHT
    assert any(FAR in one.case.name for one in report.judgements)


@pytest.mark.sample("robot_velocity")
@pytest.mark.parametrize("read", [slides_wrapped, all_wrapped])
@pytest.mark.parametrize("task", ROBOT_TASKS)
def test_coordinates_beyond_pi_are_asked(task, read):
    assert any(FAR in name for name in wrong_cases(report_of_arm(task, read=read)))


@pytest.mark.sample("robot_velocity")
@pytest.mark.parametrize("task", [task for task in ROBOT_TASKS if task != "robot_track"])
def test_slides_along_oblique_axes_are_asked(task):
    def nearest(axis):
        return np.sign(axis) * (np.abs(axis) == np.abs(axis).max())

    wrong = wrong_cases(report_of_arm(task, axis=nearest))
    assert any(OBLIQUE in name for name in wrong)


@pytest.mark.sample(without=["w >= 0"])
@pytest.mark.parametrize("signs", [same, lambda q, _: short_way(q)], ids=["as it comes", "w >= 0"])
def test_rotations_the_long_way_round_are_asked(signs):
    report = report_of_arm("robot_inverse_kinematics", sign=lambda q: q, signs=signs)
    assert len(wrong_cases(report)) >= 3


# ---- resampling


def by_spacing(curve, closed, spacing):
    """Walk along the line from point to point."""
    line = np.concatenate([curve, curve[:1]]) if closed else curve
    gaps = np.sqrt(np.square(np.diff(line, axis=0)).sum(axis=1))
    pieces = int(np.ceil(gaps.sum() / spacing - 1e-9))
    places = gaps.sum() * np.arange(pieces + (not closed)) / pieces
    arc = np.append(0.0, np.cumsum(gaps))
    return np.stack([np.interp(places, arc, axis) for axis in line.T], axis=1)


def with_default(curve, closed, spacing=0.1):
    return by_spacing(curve, closed, spacing)


RESAMPLE = "resample"


@pytest.mark.parametrize(
    ("function", "words"), [(by_spacing, "no answer"), (with_default, "not depend on count")]
)
def test_a_resampler_that_takes_spacing_alone_is_right_but_for_that(function, words):
    cases = all_cases(RESAMPLE)
    contestant = FunctionContestant({RESAMPLE: function}, Greeting(1, (RESAMPLE,)))
    (report,) = verify(contestant).tasks
    assert report.verdict is Verdict.RIGHT_EXCEPT
    assert len(report.judgements) == len(cases) // 2
    assert words in str(report.assumptions[0])
    assert '"resample_by": "spacing"' in str(report.assumptions[1])
    declared = Greeting(1, (RESAMPLE,), resample_by="spacing")
    assert verify(FunctionContestant({RESAMPLE: function}, declared)).verdict is Verdict.RIGHT


def test_a_wrong_count_is_not_taken_for_a_missing_one():
    def function(curve, closed, spacing=None, count=None):
        length = np.sqrt(np.square(np.diff(curve, axis=0)).sum(axis=1)).sum()
        return by_spacing(curve, closed, spacing or length / count)

    contestant = FunctionContestant({RESAMPLE: function}, Greeting(1, (RESAMPLE,)))
    assert verify(contestant).verdict is Verdict.WRONG
