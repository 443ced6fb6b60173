"""Chains with limits: what limits mean, who keeps them, and how misreadings are named."""

import functools
from dataclasses import replace

import numpy as np
import pytest

from plumbob.reference import rotation
from plumbob.reference.articulation import Articulation
from plumbob.reference.skeleton import Skeleton
from plumbob.verify.case import Case
from plumbob.verify.exchange import Answer, Exchange
from plumbob.verify.greeting import PROTOCOL, Greeting
from plumbob.verify.judgement import Verdict
from plumbob.verify.kinematics import inverse_kinematics, limits, problems
from plumbob.verify.laws import HOLDS

TASK = problems.TASK
GREETING = Greeting(PROTOCOL, (TASK,), methods=("ccd",), limits=True)
Z = np.array([0.0, 0.0, 1.0])


@functools.cache
def cases(seed=0):
    return limits.cases(GREETING, "ccd", seed, False)


@pytest.mark.parametrize("twist", [-3.0, -0.4, 0.0, 1.2, 3.1])
@pytest.mark.parametrize("tilt", [0.0, 1e-9, 0.3, 2.0])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_twist_and_tilt_are_those_of_the_product(twist, tilt, sign):
    Q = rotation.multiply(rotation.exponential([tilt, 0.0, 0.0]), rotation.exponential(twist * Z))
    (t,), (s,) = limits.twist_and_tilt(sign * Q[None], Z[None])
    assert (t, s) == pytest.approx((twist, tilt), abs=1e-14)
    assert s == pytest.approx(rotation.logarithm(rotation.between(Z, rotation.rotate(Q, Z)))[0])


def test_margins_are_negative_where_the_reference_is_beyond_limits():
    rng = np.random.default_rng(0)
    skeleton = Skeleton([-1], [[0.0, 0.0, 0.0]])
    model = Articulation(skeleton, "ball", Z, lower=-0.5, upper=1.0, cones=0.7)
    bounds = limits.JointLimits(Z[None], np.array([0.7]), np.array([-0.5]), np.array([1.0]))
    Q = rotation.exponential(rng.standard_normal((200, 3)))
    inside = [bool((limits.margins(q[None], bounds) >= 0.0).all()) for q in Q]
    assert inside == model.within_limits(Q).tolist()
    assert 0 < sum(inside) < len(inside)


def hinge(angle, tilt=0.0, target=0.5, upper=0.5):
    """Return an exchange about an arm of one hinge about z, its answer rotated and tilted."""
    parents, offsets = np.array([-1, 0]), np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    identity = rotation.identity(2)
    inputs = {
        "parents": parents, "offsets": offsets, "local_rotations": identity,
        "target": np.array([np.cos(target), np.sin(target), 0.0]), "effector": 1, "tolerance": 1e-4,
        "max_iterations": 60, "method": "", "axes": np.array([Z, Z]),
        "cones": np.array([0.0, np.pi]), "lower": np.array([-0.2, -np.pi]),
        "upper": np.array([upper, np.pi]),
    }  # fmt: skip
    case = Case("hinge", TASK, inputs, "hinge", HOLDS, facts=problems.facts(inputs))
    local = np.array([rotation.exponential([tilt, 0.0, angle]), identity[1]])
    answer = Answer({"local_rotations": local}, 0.0)
    return Exchange(case, answer, answer)


@pytest.mark.parametrize(
    ("angle", "tilt", "law", "verdict"),
    [
        (0.5, 0.0, "", Verdict.RIGHT),
        (0.5 + 5e-7, 0.0, "limits kept", Verdict.RIGHT_EXCEPT),
        (0.5 + 1e-5, 0.0, "limits kept", Verdict.WRONG),
        (-0.3, 0.0, "limits kept", Verdict.WRONG),
        (0.5, 1e-5, "limits kept", Verdict.WRONG),
        (0.4, 0.0, "target reached", Verdict.WRONG),
    ],
)
def test_a_hinge_keeps_its_limits_and_reaches_its_target(angle, tilt, law, verdict):
    ((judgement,), _) = limits.judge([hinge(angle, tilt)], GREETING)
    broken = {found.law for found in judgement.findings if found.verdict}
    assert judgement.verdict is verdict
    assert law in broken if law else not broken


@pytest.mark.parametrize(
    ("angle", "target", "jumps"),
    [(0.99, 0.09, False), (1.01, 0.09, True), (-1.01, -0.09, True), (1.01, 0.11, False)],
)
def test_to_a_target_within_a_tenth_of_a_metre_no_joint_rotates_by_a_radian(angle, target, jumps):
    exchange = hinge(angle, target=target, upper=2.0)
    ((judgement,), _) = limits.judge([exchange], GREETING)
    verdicts = {found.law: found.verdict for found in judgement.findings}
    expected = Verdict.RIGHT_EXCEPT if jumps else Verdict.RIGHT
    assert verdicts.get("no jumps", Verdict.RIGHT) is expected


def test_an_answer_without_rotations_is_broken():
    exchange = hinge(0.5)
    answer = Answer({"positions": np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])}, 0.0)
    ((judgement,), misreading) = limits.judge([replace(exchange, answer=answer)], GREETING)
    assert judgement.verdict is Verdict.BROKEN
    assert not misreading


@pytest.mark.parametrize("fields", [{}, {"limits": True, "planar": True}])
def test_limits_are_asked_only_if_declared(fields):
    greeting = Greeting(PROTOCOL, (TASK,), **fields)
    asked = inverse_kinematics.cases(greeting, "", 0, False)
    assert not any("cones" in case.inputs for case in asked)


@pytest.mark.slow
def test_every_start_and_every_target_is_within_limits():
    for case in cases():
        bounds = limits.limits_of(case.inputs)
        assert limits.margins(case.inputs["local_rotations"], bounds).min() >= -1e-12
        for method in limits.SWEEPS:
            local = limits.solve_within(method, case.inputs)
            assert limits.margins(local, bounds)[:, :-1].min() >= -1e-9
