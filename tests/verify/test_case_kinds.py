"""Cases of whole kinds: zeros, springs pressed together, far coordinates, far rotations, losses.

A right program misreads its inputs, which the cases of one kind show.
"""

from functools import cache

import numpy as np
import pytest

from plumbob.verify.fault_programs import source_of
from plumbob.verify.functions import FunctionConnection
from plumbob.verify.greeting import Greeting, Step
from plumbob.verify.judgement import Verdict
from plumbob.verify.mass_spring import energy
from plumbob.verify.mass_spring.model import Integrator, StepModel
from plumbob.verify.mass_spring.problem import all_forces, problem_of
from plumbob.verify.verify import DISCIPLINES, judge_cases, verify
from tests.honest_solvers import Stepper

pytestmark = pytest.mark.usefixtures("verdict_alone")

FORCES, ENERGY, STEP, MOTION = (
    "mass_spring_forces", "energy", "mass_spring_step", "mass_spring_motion",
)  # fmt: skip


@cache
def all_cases(task):
    return DISCIPLINES[task].cases(Greeting(1, (task,)), "", 0, False)


def judged(task, function, cases, **declared):
    connection = FunctionConnection({task: function}, Greeting(1, (task,), **declared))
    return judge_cases(connection, task, "", cases)


def wrong_cases(report):
    return {one.case.name for one in report.judgements if one.verdict >= Verdict.WRONG}


# ---- mass-spring systems


SYMPLECTIC = StepModel(Integrator("symplectic"), 1, "explicit", velocity="separate")
RIGHT = {
    FORCES: lambda **inputs: {"forces": all_forces(problem_of(inputs))},
    ENERGY: lambda **inputs: energy.predict(problem_of(inputs)),
    STEP: Stepper(SYMPLECTIC),
    MOTION: Stepper(SYMPLECTIC),
}
DECLARED = {"step": Step("symplectic", damper="explicit", pins="eliminated")}
NAMES = (
    "two particles in flight", "one spring", "one spring, compressed", "one damped spring",
    "damped pendulum", "damped pendulum, compressed", "one spring of rest length zero",
    "three particles, some numbers zero",
)  # fmt: skip


def stretches(inputs):
    ends = inputs["positions"][inputs["springs"]]
    return np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1) - inputs["rest_lengths"]


def only(name, sign):
    """Springs or dampers that act at one sign of the stretch alone."""
    return lambda inputs: {name: inputs[name] * (sign * stretches(inputs) > 0.0)}


# What takes the place of inputs, and the cases that show it.
MISREADINGS = {
    "a rest length of 0 is 1": (
        lambda i: {"rest_lengths": np.where(i["rest_lengths"], i["rest_lengths"], 1.0)},
        {*NAMES[-2:]}),
    "dampers in tension only": (only("dampings", 1), {NAMES[5]}),
    "dampers in compression only": (only("dampings", -1), {NAMES[4]}),
    "springs in tension only": (only("stiffnesses", 1), {NAMES[2], NAMES[5]}),
    "springs in compression only": (only("stiffnesses", -1), {NAMES[1]}),
}  # fmt: skip


def few_cases(task):
    return [case for case in all_cases(task) if case.name in NAMES]


@pytest.mark.sample("forces")
@pytest.mark.parametrize("misreading", MISREADINGS)
@pytest.mark.parametrize("task", RIGHT)
def test_zeros_and_both_signs_of_a_stretch_are_asked(task, misreading):
    change, names = MISREADINGS[misreading]
    report = judged(task, lambda **i: RIGHT[task](**i | change(i)), few_cases(task), **DECLARED)
    if task != ENERGY or "damper" not in misreading:
        assert names <= wrong_cases(report)


def test_a_division_by_stiffnesses_is_told_where_they_are_zero():
    def dividing(**inputs):
        with np.errstate(all="ignore"):
            loss = (0.0 / inputs["stiffnesses"]).sum()  # NaN where a stiffness is 0
        return {name: values + loss for name, values in RIGHT[STEP](**inputs).items()}

    greeting = Greeting(1, (STEP,), step=Step("symplectic", damper="explicit"))
    (report,) = verify(FunctionConnection({STEP: dividing}, greeting), [STEP]).tasks
    assert report.verdict is Verdict.BROKEN
    words = str(report.diagnosis.explanations[0].sentence)
    assert words.startswith("Where stiffnesses are 0 its answers are not finite")


def test_energies_that_are_infinite_somewhere_are_wrong_and_named():
    def infinite(**inputs):
        is_zero = inputs["rest_lengths"].min() == 0.0
        return {"elastic": np.inf if is_zero else RIGHT[ENERGY](**inputs)["elastic"]}

    assert judged(ENERGY, infinite, few_cases(ENERGY)).verdict is Verdict.WRONG


DECLARED_FACTOR = {"damper": "global_factor", "damping_factor": 0.99}


@pytest.mark.parametrize(
    ("factor", "step", "said"),
    [(1.0, {}, ()), (0.99, DECLARED_FACTOR, ()),
     (0.99, {}, ("multiplied by 0.99", "18% of every speed"))],  # h is 0.05 s, 0.99^20 is 0.82
)  # fmt: skip
def test_a_factor_of_velocities_that_is_not_declared_is_a_loss_per_second(factor, step, said):
    def scaled(**inputs):
        state = RIGHT[STEP](**inputs | {"dampings": 0.0 * inputs["dampings"]})
        return state | {"velocities": factor * state["velocities"]}

    report = judged(STEP, scaled, few_cases(STEP), step=Step("symplectic", **step))
    assert report.verdict is (Verdict.RIGHT_EXCEPT if said else Verdict.RIGHT)
    complaints = {str(words) for one in report.judgements for words in one.complaints}
    assert len(complaints) == bool(said)
    assert all(words in complaint for words in said for complaint in complaints)


# ---- robots


FAR, OBLIQUE, ROTATION = "coordinates beyond pi", "oblique slides", "far rotation"
POSE = "robot_inverse_kinematics"
ROBOT_TASKS = {
    "robot_jacobian": "robot_jacobian", "robot_velocity": "robot_velocity", POSE: "robot",
    "robot_track": "robot_track",
}  # fmt: skip


def arm(task, right="", wrong=""):
    """Return a right program of a task, some text of it replaced."""
    names = {}
    exec(compile(source_of(ROBOT_TASKS[task]).replace(right, wrong), task, "exec"), names)
    return names[task]


def report_of_arm(task, kind, function):
    return judged(task, function, [case for case in all_cases(task) if kind in case.name])


def wrapped(q, slides, wraps_all):
    return np.where(slides | wraps_all, (q + np.pi) % (2.0 * np.pi) - np.pi, q)


@pytest.mark.sample("robot_velocity")
@pytest.mark.parametrize("wraps_all", [False, True])
@pytest.mark.parametrize("task", ROBOT_TASKS)
def test_coordinates_beyond_pi_are_asked(task, wraps_all):
    right = arm(task)

    def function(slides, **inputs):
        if "q" in inputs:
            return right(slides=slides, **inputs | {"q": wrapped(inputs["q"], slides, wraps_all)})
        return {"q": wrapped(right(slides=slides, **inputs)["q"], slides, wraps_all)}

    assert report_of_arm(task, FAR, right).verdict is Verdict.RIGHT
    assert wrong_cases(report_of_arm(task, FAR, function))


@pytest.mark.sample("robot_velocity")
@pytest.mark.parametrize("task", [task for task in ROBOT_TASKS if task != "robot_track"])
def test_slides_along_oblique_axes_are_asked(task):
    right = arm(task)

    def function(axes, slides, **inputs):
        largest = np.abs(axes) == np.abs(axes).max(axis=1, keepdims=True)
        nearest = np.where(slides[:, None], np.sign(axes) * largest, axes)
        return right(axes=nearest, slides=slides, **inputs)

    assert wrong_cases(report_of_arm(task, OBLIQUE, function))


LONG_WAY = {
    "as it comes": ("    d = d if d[0] >= 0.0 else -d\n", ""),
    "w >= 0": (
        "    d = multiply(target_rotation, conjugate(rotation))\n"
        "    d = d if d[0] >= 0.0 else -d\n",
        "    rotations = (np.sign(r[0]) * r for r in (target_rotation, rotation))\n"
        "    d = multiply(next(rotations), conjugate(next(rotations)))\n"),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("way", LONG_WAY)
def test_rotations_the_long_way_round_are_asked(way):
    report = report_of_arm(POSE, ROTATION, arm(POSE, *LONG_WAY[way]))
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
    connection = FunctionConnection({RESAMPLE: function}, Greeting(1, (RESAMPLE,)))
    (report,) = verify(connection).tasks
    assert report.verdict is Verdict.RIGHT_EXCEPT
    assert len(report.judgements) == len(cases) // 2
    assert words in str(report.assumptions[0])
    assert '"resample_by": "spacing"' in str(report.assumptions[1])
    declared = Greeting(1, (RESAMPLE,), resample_by="spacing")
    assert verify(FunctionConnection({RESAMPLE: function}, declared)).verdict is Verdict.RIGHT


def test_a_wrong_count_is_not_taken_for_a_missing_one():
    def function(curve, closed, spacing=None, count=None):
        length = np.sqrt(np.square(np.diff(curve, axis=0)).sum(axis=1)).sum()
        return by_spacing(curve, closed, spacing or length / count)

    connection = FunctionConnection({RESAMPLE: function}, Greeting(1, (RESAMPLE,)))
    assert verify(connection).verdict is Verdict.WRONG
