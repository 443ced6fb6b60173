"""Steps of Jacobian methods: honest ones are not accused, and mistakes show their numbers."""

from functools import cache
from types import SimpleNamespace

import pytest

from plumbob.verify.contestant import Exchange
from plumbob.verify.fault_programs import contestant_of, source_of
from plumbob.verify.kinematics import jacobian_steps, problems
from plumbob.verify.kinematics.sweeps import PoseTrial
from plumbob.verify.verify import verify

SOLVE, JOINT_UPDATE = "J.T @ np.linalg.solve(A, pull)", "multiply(q[j], exponential(w))"
ARM, BOUND = "arm = x[effector] - x[j]", "1.0 / max(np.linalg.norm(step, axis=1).max(), 1e-300)"
CAPPED = "exponential(w * min(1.0, 0.6 / max(np.linalg.norm(w), 1e-300)))"
PARENT = "(matrix(R[parents[j]]) if parents[j] >= 0 else np.eye(3)).T"
WEIGHTED = """\
(lambda W: W @ J.T @ np.linalg.solve(J @ W @ J.T + damping * np.eye(3), pull))(
            np.diag(np.repeat(1.0 / (1.0 + np.arange(len(joints))), 3)))"""
MARQUARDT = """\
np.linalg.solve(J.T @ J + damping * np.diag((J * J).sum(axis=0) + 0.01), J.T @ pull)"""
HONEST = {
    "unchanged": [],
    "pseudo-inverse": [(SOLVE, "np.linalg.pinv(J, rcond=0.1) @ pull")],
    "transpose": [(SOLVE, "J.T @ pull / (J * J).sum()")],
    "Levenberg-Marquardt": [(SOLVE, MARQUARDT)],
    "joint weights": [(SOLVE, WEIGHTED)],
    "constant damping": [("0.3 * damping", "damping"), ("5.0 * damping", "damping")],
    "short steps": [("pull = error *", "pull = 0.5 * error *")],
    "axes of the parent": [
        ("matrix(R[j]).T", PARENT), (JOINT_UPDATE, "multiply(exponential(w), q[j])"),
    ],
    "first order": [(JOINT_UPDATE, "multiply(q[j], np.array([1.0, *(0.5 * w)]))")],
    "each angle bounded": [(f"step * min(1.0, {BOUND})", "np.clip(step, -0.3, 0.3)")],
    "each rotation capped": [(JOINT_UPDATE, f"multiply(q[j], {CAPPED})")],
    "momentum": [(f"({SOLVE})", f"({SOLVE} + (0.5 * step.ravel() if _ else 0.0))")],
}  # fmt: skip
NUMBERS = {
    "steps too long": ([(JOINT_UPDATE, "multiply(q[j], exponential(1.5 * w))")], "are 1.5 times"),
    "rotations bounded": ([("1.0 / max(np", "0.02 / max(np")], "0.02 rad (1.146 degrees)"),
    "damping rises": (
        [("0.3 * damping", "7.0 * damping"), ("5.0 * damping", "0.5 * damping")], "rises, 7 times",
    ),
}  # fmt: skip
# Neighbours of the mistakes that the programs of the catalogue have.
NEIGHBOURS = {
    "arms from the root": [(ARM, "arm = x[j] - x[0]")],
    "arms from the origin": [(ARM, "arm = x[j]")],
    "arms of a neighbour": [(ARM, "arm = x[effector] - x[path[path.index(j) - 1]]")],
    "world's axes, rotations multiplied on the left": [
        ("matrix(R[j]).T", "np.eye(3)"),
        (JOINT_UPDATE, f"multiply({CAPPED}, q[j])"),
    ],
    "another error": [("pull = error *", "pull = (target - x[parents[effector]]) *")],
    "component of the error lost": [
        ("pull = error *", "pull = error * np.array([1.0, 0.0, 1.0]) *")
    ],
    "axes exchanged": [("exponential(w))", "exponential(w[[1, 2, 0]]))")],
}


@cache
def sweeps(greeting):
    cases = problems.cases(greeting, "jacobian", 0, False)
    return [case for case in cases if "sweeps" in case.facts]


def explanations(changes):
    """Return how the single and continued sweeps of a changed program are explained."""
    source = source_of("jacobian")
    for right, wrong in changes:
        assert source.count(right) == 1
        source = source.replace(right, wrong)
    contestant = contestant_of(source)
    answers = [(case, contestant.answer(case)) for case in sweeps(contestant.greeting)]
    trials = [PoseTrial(Exchange(case, answer, answer)) for case, answer in answers]
    return jacobian_steps.explanations(trials, contestant.greeting)


@pytest.mark.parametrize(
    ("hits", "count", "is_enough"),
    [(6, 10, True), (5, 10, False), (3, 4, True), (2, 3, False)],
)
def test_a_model_has_to_explain_three_steps_and_three_fifths_of_all(hits, count, is_enough):
    def evaluate(change, item):
        return SimpleNamespace(gap=0.0 if item < hits else 1.0)

    models = [("one mistake", {})]
    best, results = jacobian_steps._best(evaluate, models, range(count), 1e-9)
    assert (best, len(results)) == ((["one mistake"], hits) if is_enough else ([], 0))


@pytest.mark.sample("transpose")
@pytest.mark.parametrize("name", HONEST)
def test_honest_steps_are_not_accused(name):
    assert explanations(HONEST[name]) == ()


@pytest.mark.sample("damping rises")
@pytest.mark.parametrize("key", NUMBERS)
def test_mistake_shows_its_number(key):
    changes, words = NUMBERS[key]
    (explanation,) = explanations(changes)
    assert explanation.faults == (key,)
    assert words in str(explanation.sentence)


@pytest.mark.sample("another error")
@pytest.mark.parametrize("key", NEIGHBOURS)
def test_neighbour_of_a_mistake_is_named(key):
    (explanation,) = explanations(NEIGHBOURS[key])
    assert explanation.faults == (key,)
    # where the rotations of all joints are cut off no step shows
    assert explanation.share >= (0.8 if "left" in key else 1.0)


@pytest.mark.slow
def test_squared_distances_end_the_solves_of_any_method():
    right, wrong = (
        "np.linalg.norm(target - x[effector]) <= tolerance",
        "np.linalg.norm(target - x[effector]) ** 2 <= tolerance",
    )
    counted = source_of("jacobian").replace("for _ in range", "for count in range").replace(
        '"positions": x}', '"positions": x, "iterations": count}'
    )  # fmt: skip
    for source, codes in ((counted, set()), (counted.replace(right, wrong), {"PB-STOP-001"})):
        report = verify(contestant_of(source), ["inverse_kinematics"]).tasks[0]
        named = report.diagnosis.explanations
        assert {code for explanation in named for code in explanation.codes} == codes
