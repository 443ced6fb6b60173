"""Faults of quaternions and arcs, and the rules by which programs make rotations of FABRIK."""

import numpy as np
import pytest
from kinematics_solvers import FORWARD, INVERSE, judged, named

from plumbob.reference import rotation
from plumbob.reference.quaternion import between, conjugate, multiply, rotate, scale
from plumbob.verify.contestant import Answer, Exchange
from plumbob.verify.greeting import Greeting
from plumbob.verify.judgement import Verdict
from plumbob.verify.kinematics import algebra, problems, sweeps
from plumbob.verify.kinematics.faults import FAULTS, by_key, switches
from plumbob.verify.kinematics.predictions import predict_forward, predict_inverse, solve
from plumbob.verify.kinematics.switches import Switches

# By names of their own: two mistakes of an arc have the same key.
SHARED = {
    f"{fault.key}, {fault.number}": fault
    for fault in FAULTS["ccd"]
    if fault.part in ("quaternion", "arc")
}
RULES, ROTATING, GROUPINGS = range(6), range(3), range(4)
RIGHT = Switches()


@pytest.fixture
def numbers():
    """Two unit quaternions and two vectors at an obtuse angle, as tuples."""
    a, b = map(tuple, rotation.random(np.random.default_rng(3), 2))
    return a, b, (0.5, -0.2, 0.3), (-0.4, 0.6, 0.1)


def results(numbers, faults):
    """Return the products, inverses, rotated vectors and arcs of some numbers."""
    a, b, u, v = numbers
    parts = (
        algebra.product(a, b, faults), algebra.inverse(a, faults), algebra.rotated(a, u, faults),
        algebra.arc(u, v, faults), algebra.arc(u, scale(-1.0, v), faults),
        algebra.arc(u, v[::-1], faults),
    )  # fmt: skip
    return np.concatenate(parts)


@pytest.mark.parametrize("rotating", ROTATING)
def test_without_faults_the_algebra_is_the_reference(numbers, rotating):
    a, b, u, v = numbers
    arcs = between(u, v), between(u, scale(-1.0, v)), between(u, v[::-1])
    expected = np.concatenate((multiply(a, b), conjugate(a), rotate(a, u), *arcs))
    right = RIGHT._replace(rotating=rotating)
    assert results(numbers, right) == pytest.approx(expected, abs=4e-15)


def test_every_fault_changes_a_result_in_its_own_manner(numbers):
    found = [results(numbers, switches([fault])) for fault in SHARED.values()]
    found += [results(numbers, RIGHT)]
    for i, first in enumerate(found):
        assert all(np.abs(first - second).max() > 1e-6 for second in found[:i])


def test_the_terms_of_a_wrong_product_are_those_of_its_sentence(numbers):
    a, b, _, _ = (np.array(x) for x in numbers)
    for fault in SHARED.values():
        if fault.key.startswith("sign of a.") and fault.switch == "multiply":
            _, _, term, factor, _, component, *_ = fault.key.split()
            i, j, c = ("wxyz".index(name) for name in (term[-1], factor[-1], component))
            wrong = np.array(algebra.product(a, b, switches([fault])))
            change = wrong - multiply(a, b)
            assert np.flatnonzero(change).tolist() == [c]
            assert abs(change[c]) == pytest.approx(2.0 * abs(a[i] * b[j]))


# ---- rules of FABRIK


def fabrik(switched, outputs):
    """Return a FABRIK with switches, whose positions are its points or those of its rotations."""

    def function(**inputs):
        local, positions, _ = solve("fabrik", inputs, switched)
        answer = {"local_rotations": local, "positions": positions}
        return {name: answer[name] for name in outputs}

    return function


@pytest.mark.parametrize("rule", RULES)
def test_every_rule_places_the_path_on_the_points(rule):
    greeting = Greeting(1, (INVERSE,))
    for case in problems.cases(greeting, "fabrik", 1, False)[:4]:
        outputs = predict_inverse("fabrik", Switches(rule=rule), case)
        size = case.facts["size"]
        assert outputs["path_placed"] == pytest.approx(outputs["path_positions"], abs=1e-13 * size)


@pytest.mark.parametrize("method", ["ccd", "fabrik"])
def test_global_rotations_that_are_kept_give_the_same_pose(method):
    for case in problems.cases(Greeting(1, (INVERSE,)), method, 1, False)[:4]:
        local, kept = (
            solve(method, case.inputs, Switches(rule=3, global_rotations=k))[0] for k in (0, 1)
        )
        assert rotation.angle(local, kept) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.sample("1", "3")
@pytest.mark.parametrize("rule", [1, 2, 3, 4])
def test_a_right_fabrik_of_any_rule_is_not_accused(rule):
    function = fabrik(Switches(rule=rule), ("local_rotations",))
    report = judged(INVERSE, function, "fabrik")
    assert report.verdict <= Verdict.RIGHT_EXCEPT  # as any FABRIK that bends no straight chain
    assert not report.diagnosis.explanations


# Where the last link has no length, no rule has a direction to rotate to.
SWEPT = [
    f for f in FAULTS["fabrik"]
    if f.part == "fabrik" and not f.honest and "none for the last" not in f.key
]  # fmt: skip


@pytest.mark.sample("root not rotated")
@pytest.mark.sweep("key", lambda: [fault.key for fault in SWEPT], every=60)
def test_a_fault_of_fabrik_is_named_by_another_rule(key):
    """Faults of points show in points; those of rotations by the rule that the program has."""
    fault = by_key("fabrik")[key]
    rule = 3 if fault.switch == "rotations" and fault.number != 9 else 1
    function = fabrik(switches([fault])._replace(rule=rule), ("local_rotations", "positions"))
    assert key in named(judged(INVERSE, function, "fabrik"))[0]


@pytest.mark.sample("-ccd")
@pytest.mark.sweep("name", lambda: SHARED, every=100)
@pytest.mark.parametrize("method", ["forward", "ccd", "fabrik"])
def test_a_fault_of_quaternions_is_named_in_every_grouping(method, name):
    fault = SHARED[name]
    choices = {"rotating": 2, "grouping": 1, "unit": 1 if fault.part == "quaternion" else 0}
    choices |= {"rule": 3, "unit": 0 if method == "forward" else choices["unit"]}
    switched = switches([fault])._replace(**choices)
    if method == "forward" and fault.part == "arc":
        return  # no arcs there

    def forward(**inputs):
        return predict_forward(switched, problems.Case("", FORWARD, inputs, "", None))

    def inverse(**inputs):
        local, positions, _ = solve(method, inputs, switched)
        return {"local_rotations": local, "positions": positions}

    report = judged(FORWARD, forward) if method == "forward" else judged(INVERSE, inverse, method)
    # No answer of forward kinematics tells a reversed product from conjugates on both ways.
    is_equal = method == "forward" and fault.key == "product of quaternions reversed"
    assert ("conjugates read and written" if is_equal else fault.key) in named(report)[0]


def test_every_shared_fault_is_a_fault_of_all_methods():
    keys = {fault.key for fault in SHARED.values()}
    assert all(keys <= by_key(method).keys() for method in ("ccd", "fabrik"))


@pytest.mark.parametrize(("end", "is_told"), [(0, True), (1, False)])
def test_right_points_beside_unknown_rotations_are_told(end, is_told):
    """The rotations have a mistake that no catalogue knows; the points are right, or are not."""

    greeting, trials = Greeting(1, (INVERSE,)), []
    for case in problems.cases(greeting, "fabrik", 1, False)[:3]:
        local, positions, _ = solve("fabrik", case.inputs, Switches(end=end))
        local = rotation.multiply(local, rotation.exponential([0.3, 0.2, 0.1]))
        answer = Answer({"local_rotations": local, "positions": positions}, 0.0)
        trials.append(sweeps.PoseTrial(Exchange(case, answer, answer)))
    comparison = sweeps.SweepComparison("fabrik", wrong=[trials[0].case.name])
    assert (sweeps.right_points(comparison, trials, greeting) is not None) == is_told
