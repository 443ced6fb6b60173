"""Each law of a pose at the edge of its tolerance: just within and just beyond.

The lies of `test_kinematics_inverse.py` are gross; a tolerance that is wrong by a factor shows
only here.
"""

import conformance_students as students
import numpy as np
import pytest

from plumbob.reference import Skeleton, forward_kinematics, rotation
from plumbob.text.sentence import sentence
from plumbob.verify.case import Case
from plumbob.verify.greeting import Greeting
from plumbob.verify.judgement import Verdict
from plumbob.verify.kinematics import inverse_kinematics, pose_laws, rounding

EPSILON = {"double": 2.0**-52, "single": 2.0**-23}
RIGHT, RIGHT_EXCEPT, WRONG = Verdict.RIGHT, Verdict.RIGHT_EXCEPT, Verdict.WRONG
# Root, a fork at joint 1 with children 2 and 3, the effector 4 below 2.
PARENTS = np.array([-1, 0, 1, 1, 2])
PATH = np.array([0, 1, 2, 4])
SIZE, REACH = 3.0, 2.5
# The angle below which helpers drop a rotation [rad].
DEAD = {"double": 1e-6, "single": 5e-4}


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
    facts = {"path": PATH, "size": SIZE, "reach": REACH, "least": 0.0, "before": 1.0}
    return Case("", "inverse_kinematics", inputs, "", sentence(""), facts=facts | {"x": start})


def findings(case, precision="double", **changes):
    """Return the findings, by their laws, of the pose at the start with its outputs changed."""
    answer = {"local_rotations": case.inputs["local_rotations"], "positions": case.facts["x"]}
    answer = {name: value + changes.get(name, 0.0) for name, value in answer.items()}
    posed = pose_laws.read_pose(answer, case.inputs, case.facts)
    greeting = Greeting(1, ("inverse_kinematics",), precision=precision)
    return {one.law: one for one in pose_laws.all_of(posed, case, greeting)}


def moved(joint, change, size=3):
    array = np.zeros((5, size))
    array[joint] = change
    return array


def along_the_link(case, bound):
    link = case.facts["x"][4] - case.facts["x"][2]
    return {"positions": moved(4, SIZE * bound * link / np.linalg.norm(link))}


def round_its_parent(case, bound):
    """Rotate child 3 about joint 1: two roundings of a distance from its sibling."""
    x = case.facts["x"]
    link, gap = x[3] - x[1], x[3] - x[2]
    aside = gap - (gap @ link) / (link @ link) * link  # at right angles to the link
    slope = np.linalg.norm(aside) / np.linalg.norm(gap)
    return {"positions": moved(3, 2.0 * SIZE * bound * aside / slope / np.linalg.norm(aside))}


def stretched(case, bound):
    return {"local_rotations": moved(2, bound * case.inputs["local_rotations"][2], 4)}


def rotated(joint):
    def change(case, bound):
        old = case.inputs["local_rotations"][joint]
        new = rotation.multiply(old, rotation.exponential([0.0, bound, 0.0]))
        return {"local_rotations": moved(joint, new - old, 4)}

    return change


# A law, its joint, the verdict beyond its bound, and a change of an answer by multiples of
# 16 epsilons for each of five joints, times the size for positions.
CHANGES = {
    "root": ("root in place", 0, WRONG,
             lambda case, bound: {"positions": np.full((5, 3), [0.0, SIZE * bound, 0.0])}),
    "link": ("link lengths", 4, WRONG, along_the_link),
    "branch": ("branches", 3, WRONG, round_its_parent),
    "quaternion": ("unit quaternions", 2, RIGHT_EXCEPT, stretched),
    "joint off the path": ("joints off the path", 3, WRONG, rotated(3)),
    "effector": ("joints off the path", 4, RIGHT_EXCEPT, rotated(4)),  # which does not move it
}  # fmt: skip


@pytest.mark.parametrize("precision", EPSILON)
@pytest.mark.parametrize("name", CHANGES)
def test_law_is_kept_to_rounding(case, name, precision):
    assert {finding.verdict for finding in findings(case).values()} == {RIGHT}
    law, joint, verdict, change = CHANGES[name]
    bound = 5 * 16.0 * EPSILON[precision]
    if law in ("link lengths", "branches"):  # of five joints in ten iterations, up to a limit
        bound = min(5 * 10 * bound, pose_laws.AGREEMENT)
    if law == "unit quaternions":  # of five joints in ten iterations
        bound = min(5 * 10 * bound, rounding.LARGEST_DRIFT)
    if law == "joints off the path":  # quotients of rotations by ten iterations
        bound = min(10 * bound, pose_laws.AGREEMENT)
    for share, expected in ((0.5, RIGHT), (2.0, verdict)):
        found = findings(case, precision, **change(case, share * bound))
        assert (found[law].verdict, found[law].index) == (expected, joint)
        others = {"root in place", "link lengths", "branches", "unit quaternions"} - {law}
        assert {found[other].verdict for other in others} == {RIGHT}


@pytest.mark.parametrize(("stretch", "verdict"), [(0.0, RIGHT), (1e-6, RIGHT_EXCEPT)])
def test_rounding_of_a_hundred_sweeps_is_no_missing_normalisation(rng, stretch, verdict):
    inputs = {
        "parents": np.array([-1, 0, 1]),
        "offsets": rng.uniform(-1.0, 1.0, (3, 3)),
        "local_rotations": rotation.random(rng, 3),
        "target": np.array([3.0, 4.0, 0.0]),  # beyond reach
        "effector": 2,
        "tolerance": 0.0,
        "max_iterations": 100,
    }
    local, _ = students.ccd(**inputs, normalises=False)
    facts = {"path": np.arange(3), "size": SIZE, "reach": REACH, "least": 0.0, "before": 1.0}
    case = Case("", "inverse_kinematics", inputs, "", sentence(""), facts=facts)
    pose = pose_laws.read_pose({"local_rotations": (1.0 + stretch) * local}, inputs, facts)
    (unit, *_) = pose_laws.rotation_laws(pose, case, Greeting(1, (case.task,)))
    assert (unit.law, unit.verdict) == ("unit quaternions", verdict)


def test_every_pair_of_children_keeps_its_distance(rng):
    """The last of three turns about the line from their parent to the first, past the second."""
    offsets = rng.uniform(0.5, 1.0, (5, 3))
    parents, directions = np.array([-1, 0, 1, 1, 1]), np.eye(3)
    offsets[2:] = directions
    x = forward_kinematics(Skeleton(parents, offsets), rotation.identity(5)).positions.copy()
    assert pose_laws._branches(x, parents, offsets, 1e-12).verdict is RIGHT
    x[4] = x[1] + rotation.rotate(rotation.exponential(0.1 * directions[0]), directions[2])
    found = pose_laws._branches(x, parents, offsets, 1e-12)
    assert (found.verdict, found.index) == (WRONG, 4)
    assert found.error == pytest.approx(abs(np.linalg.norm(x[4] - x[3]) - np.sqrt(2.0)))


@pytest.mark.parametrize("precision", EPSILON)
@pytest.mark.parametrize(
    ("roundings", "dead_angles", "verdict"),
    [(10.0, 0.0, RIGHT), (40.0, 0.0, RIGHT_EXCEPT), (0.0, 2.0, RIGHT_EXCEPT), (0.0, 8.0, WRONG)],
)
def test_positions_are_where_the_rotations_put_them_to_rounding(
    case, precision, roundings, dead_angles, verdict
):
    """In each of ten iterations; or to four rotations, one for every inner joint, that are lost."""
    gap = roundings * 5 * 16.0 * EPSILON[precision] * SIZE + dead_angles * DEAD[precision] * REACH
    found = findings(case, precision, positions=moved(4, [0.0, 0.0, gap]))
    assert found["rotations agree with positions"].verdict is verdict
    assert found["rotations agree with positions"].index == 4


def test_what_lacks_numbers_is_judged_where_it_has_some(case):
    """A rotation that does not move the path may lack; without one that does nothing is placed."""
    for joint, placed in ((3, True), (1, False)):
        local = case.inputs["local_rotations"].copy()
        local[joint] = np.nan
        posed = pose_laws.read_pose({"local_rotations": local}, case.inputs, case.facts)
        assert posed.finite is placed
        (found,) = pose_laws.all_of(posed, case, GREETING)
        assert (found.law, found.verdict, found.index) == ("numbers", Verdict.BROKEN, joint)


# ---- targets and claims


GREETING = Greeting(1, ("inverse_kinematics",))
STALL = {"double": 1e-5, "single": 4e-3}


@pytest.mark.parametrize(
    ("method", "distance", "verdict"),
    [
        ("ccd", 0.9e-4, RIGHT),
        ("ccd", 1.01e-4 + 1e-5 * REACH, WRONG),
        ("", 0.49, RIGHT_EXCEPT),
        ("ccd", 0.49, WRONG),
        ("", 0.51, WRONG),
    ],
)
def test_target_is_reached_to_the_tolerance(case, method, distance, verdict):
    """A solver of an unknown method that has come more than half the way is slow."""
    finding = inverse_kinematics.reached(distance, 1e-12, case, method, GREETING, {})
    assert (finding.law, finding.verdict) == ("target reached", verdict)
    assert finding.error == distance


@pytest.mark.parametrize(
    ("iterations", "words"), [(4, "ends after 4 of 10 iterations"), (10, "converges slowly")]
)
def test_only_what_uses_all_iterations_converges_slowly(case, iterations, words):
    finding = inverse_kinematics.reached(0.1, 1e-12, case, "", GREETING, {"iterations": iterations})
    assert words in str(finding.sentence)
    assert f"chain of {REACH:.3g} m" in str(finding.sentence)


@pytest.mark.parametrize("precision", STALL)
def test_stall_near_the_target_is_right_with_a_reservation(case, precision):
    greeting = Greeting(1, ("inverse_kinematics",), precision=precision)
    case.inputs["tolerance"] = 0.0
    for factor, verdict in ((0.9, RIGHT_EXCEPT), (1.1, WRONG)):
        excess = factor * STALL[precision] * REACH
        finding = inverse_kinematics.reached(excess, 1e-12, case, "ccd", greeting, {})
        assert finding.verdict is verdict


@pytest.mark.parametrize(
    ("claims", "distance", "verdicts"),
    [
        ({"converged": True}, 1e-4, [RIGHT]),
        ({"converged": True}, 1.1e-4, [WRONG]),
        ({"converged": False}, 0.9e-4, [RIGHT_EXCEPT]),
        ({"converged": False}, 1.1e-4, []),
        ({"residual": 0.5 * (1 + 0.9e-3)}, 0.5, [RIGHT]),
        ({"residual": 0.5 * (1 - 0.9e-3)}, 0.5, [RIGHT]),
        ({"residual": 0.5 * (1 + 1.1e-3)}, 0.5, [WRONG]),
        ({"residual": 0.5 * (1 - 1.1e-3)}, 0.5, [WRONG]),
        ({"residual": 1e-12}, 0.0, [RIGHT]),
    ],
)
def test_what_a_solver_says_of_its_answer_is_true(case, claims, distance, verdicts):
    found = list(pose_laws.claims(distance, 1e-11, claims, case))
    assert [one.verdict for one in found] == verdicts
