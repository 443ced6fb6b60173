"""Each law of a pose at the edge of its tolerance: just within and just beyond.

The lies of `test_kinematics_inverse.py` are gross; a tolerance that is wrong by a factor shows
only here.
"""

import numpy as np
import pytest

from plumbob.crosscheck.verify.case import Case
from plumbob.crosscheck.verify.greeting import Greeting
from plumbob.crosscheck.verify.judgement import Verdict
from plumbob.crosscheck.verify.kinematics import inverse_kinematics, pose_laws
from plumbob.crosscheck.verify.sentence import sentence
from plumbob.reference import Skeleton, forward_kinematics, rotation

EPSILON = {"double": 2.0**-52, "single": 2.0**-23}
RIGHT, RIGHT_BUT, WRONG = Verdict.RIGHT, Verdict.RIGHT_BUT, Verdict.WRONG
# Root, a fork at joint 1 with children 2 and 3, the effector 4 below 2.
PARENTS = np.array([-1, 0, 1, 1, 2])
PATH = np.array([0, 1, 2, 4])
SIZE, REACH = 3.0, 2.5
# The angle below which helpers drop a rotation [rad].
DEAD = {"double": 1e-6, "single": 5e-4}
EDGES = [(0.5, True), (2.0, False)]


@pytest.fixture
def case(rng):
    """A request for a tree of five joints, whose target is a metre from the effector."""
    offsets = rng.uniform(-1.0, 1.0, (5, 3))
    local = rotation.random(rng, 5)
    start = forward_kinematics(Skeleton(PARENTS, offsets), local).positions
    inputs = {
        "parents": PARENTS,
        "offsets": offsets,
        "local_rotations": local,
        "effector": 4,
        "target": start[4] + [1.0, 0.0, 0.0],
        "tolerance": 1e-4,
        "max_iterations": 10,
    }
    facts = {
        "start": start,
        "path": PATH,
        "size": SIZE,
        "reach": REACH,
        "least": 0.0,
        "before": 1.0,
    }
    return Case("", "inverse_kinematics", inputs, "", sentence(""), facts=facts)


def findings(case, precision="double", **changes):
    """Return the findings, by their laws, of the pose at the start with its outputs changed."""
    answer = {"local_rotations": case.inputs["local_rotations"], "positions": case.facts["start"]}
    answer = {name: value + changes.get(name, 0.0) for name, value in answer.items()}
    posed = pose_laws.understood(answer, case.inputs, case.facts)
    greeting = Greeting(1, ("inverse_kinematics",), precision=precision)
    return {one.law: one for one in pose_laws.all_of(posed, case, greeting)}


def rounded(precision):
    """Return what rounding moves a joint by: 16 epsilons of the size for each of five joints."""
    return 5 * 16.0 * EPSILON[precision] * SIZE


def moved(joint, change):
    array = np.zeros((5, 3))
    array[joint] = change
    return array


def test_a_pose_of_its_own_rotations_keeps_every_law(case):
    assert {one.verdict for one in findings(case).values()} == {RIGHT}


@pytest.mark.parametrize("precision", EPSILON)
@pytest.mark.parametrize(("share", "holds"), EDGES)
def test_the_root_stays_to_rounding(case, precision, share, holds):
    shift = np.full((5, 3), [0.0, share * rounded(precision), 0.0])  # of all joints
    found = findings(case, precision, positions=shift)
    assert found["root in place"].verdict is (RIGHT if holds else WRONG)
    assert found["link lengths"].verdict is found["branches"].verdict is RIGHT


@pytest.mark.parametrize("precision", EPSILON)
@pytest.mark.parametrize(("share", "holds"), EDGES)
def test_links_keep_their_lengths_to_rounding(case, precision, share, holds):
    x = case.facts["start"]
    along = (x[4] - x[2]) / np.linalg.norm(x[4] - x[2])
    found = findings(case, precision, positions=moved(4, share * rounded(precision) * along))
    assert found["link lengths"].verdict is (RIGHT if holds else WRONG)
    assert found["link lengths"].where == 4
    assert found["root in place"].verdict is found["branches"].verdict is RIGHT


@pytest.mark.parametrize("precision", EPSILON)
@pytest.mark.parametrize(("share", "holds"), EDGES)
def test_children_of_a_joint_keep_their_distance_to_rounding(case, precision, share, holds):
    """Child 3 goes round joint 1, as far as twice what rounds one end of a distance."""
    x = case.facts["start"]
    link, apart = x[3] - x[1], x[3] - x[2]
    aside = apart - (apart @ link) / (link @ link) * link  # at right angles to the link
    slope = np.linalg.norm(aside) / np.linalg.norm(apart)
    aside *= share * 2.0 * rounded(precision) / slope / np.linalg.norm(aside)
    found = findings(case, precision, positions=moved(3, aside))
    assert found["branches"].verdict is (RIGHT if holds else WRONG)
    assert found["branches"].where == 3
    assert found["link lengths"].verdict is RIGHT


@pytest.mark.parametrize("precision", EPSILON)
@pytest.mark.parametrize(
    ("gap", "verdict"),
    [
        (lambda precision: 1.0 * rounded(precision), RIGHT),
        (lambda precision: 4.0 * rounded(precision), RIGHT_BUT),
        (lambda precision: 2.0 * DEAD[precision] * REACH, RIGHT_BUT),
        (lambda precision: 8.0 * DEAD[precision] * REACH, WRONG),
    ],
)
def test_positions_are_where_the_rotations_put_them_to_rounding(case, precision, gap, verdict):
    """Or to four rotations that a helper rounds to the identity: one for every inner joint."""
    found = findings(case, precision, positions=moved(4, [0.0, 0.0, gap(precision)]))
    assert found["rotations agree with positions"].verdict is verdict
    assert found["rotations agree with positions"].where == 4


@pytest.mark.parametrize("precision", EPSILON)
@pytest.mark.parametrize(("share", "holds"), EDGES)
def test_quaternions_are_of_unit_length_to_rounding(case, precision, share, holds):
    stretch = share * 5 * 16.0 * EPSILON[precision]
    changes = stretch * case.inputs["local_rotations"]
    changes[[0, 1, 3, 4]] = 0.0
    found = findings(case, precision, local_rotations=changes)
    assert found["unit quaternions"].verdict is (RIGHT if holds else RIGHT_BUT)
    assert found["unit quaternions"].where == 2


@pytest.mark.parametrize("precision", EPSILON)
@pytest.mark.parametrize(("share", "holds"), EDGES)
@pytest.mark.parametrize(("joint", "verdict"), [(3, WRONG), (4, RIGHT_BUT)])
def test_joints_off_the_path_are_left_as_they_were(case, precision, joint, verdict, share, holds):
    """The effector's own rotation brings it nowhere, which is a remark."""
    angle = share * 5 * 16.0 * EPSILON[precision]
    old = case.inputs["local_rotations"]
    new = old.copy()
    new[joint] = rotation.multiply(old[joint], rotation.exponential([0.0, angle, 0.0]))
    found = findings(case, precision, local_rotations=new - old)
    assert found["joints off the path"].verdict is (RIGHT if holds else verdict)
    assert found["joints off the path"].error == pytest.approx(angle, rel=0.1)
    assert found["joints off the path"].where == joint


# ---- targets and claims


GREETING = Greeting(1, ("inverse_kinematics",))


@pytest.mark.parametrize(
    ("method", "distance", "verdict"),
    [
        ("ccd", 0.9e-4, RIGHT),
        ("ccd", 1.01e-4 + 1e-5 * REACH, WRONG),
        ("", 0.49, RIGHT_BUT),
        ("ccd", 0.49, WRONG),
        ("", 0.51, WRONG),
    ],
)
def test_a_target_within_reach_is_reached_to_the_tolerance(case, method, distance, verdict):
    """A solver of an unknown method that has come more than half the way is slow."""
    found = inverse_kinematics.reached(distance, 1e-12, case, method, GREETING)
    assert (found.law, found.verdict) == ("target reached", verdict)
    assert found.error == distance


@pytest.mark.parametrize(("precision", "share"), [("double", 1e-5), ("single", 4e-3)])
def test_an_effector_that_stalls_near_its_target_is_right_with_a_reservation(
    case, precision, share
):
    greeting = Greeting(1, ("inverse_kinematics",), precision=precision)
    case.inputs["tolerance"] = 0.0
    for factor, verdict in ((0.9, RIGHT_BUT), (1.1, WRONG)):
        excess = factor * share * REACH
        found = inverse_kinematics.reached(excess, 1e-12, case, "ccd", greeting)
        assert found.verdict is verdict


@pytest.mark.parametrize(("growth", "verdict"), [(0.5e-9, RIGHT), (2e-9, WRONG), (-0.5, RIGHT)])
def test_a_sweep_takes_no_effector_farther_away(case, growth, verdict):
    found = inverse_kinematics.not_farther(case.facts["before"] + growth, 1e-9, case)
    assert found.verdict is verdict


@pytest.mark.parametrize(
    ("claims", "distance", "verdicts"),
    [
        ({"converged": True}, 1e-4, [RIGHT]),
        ({"converged": True}, 1.1e-4, [WRONG]),
        ({"converged": False}, 0.9e-4, [RIGHT_BUT]),
        ({"converged": False}, 1.1e-4, []),
        ({"residual": 0.5 * (1 + 0.9e-3)}, 0.5, [RIGHT]),
        ({"residual": 0.5 * (1 - 0.9e-3)}, 0.5, [RIGHT]),
        ({"residual": 0.5 * (1 + 1.1e-3)}, 0.5, [WRONG]),
        ({"residual": 0.5 * (1 - 1.1e-3)}, 0.5, [WRONG]),
        ({"residual": 1e-12}, 0.0, [RIGHT]),
    ],
)
def test_what_a_solver_says_of_its_answer_is_true(case, claims, distance, verdicts):
    found = inverse_kinematics.claims(distance, 1e-11, claims, case)
    assert [one.verdict for one in found] == verdicts
