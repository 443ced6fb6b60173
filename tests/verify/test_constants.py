"""Constants in place of iterations, tolerance, gravity and dampers are found, and declared."""

from types import SimpleNamespace

import numpy as np
import pytest

from plumbob.reference import Skeleton, solve_ik
from plumbob.reference.rotation import between, conjugate, multiply, rotate
from plumbob.verify.functions import FunctionConnection
from plumbob.verify.greeting import Fixed, Greeting, Step
from plumbob.verify.judgement import Verdict
from plumbob.verify.kinematics import inverse_kinematics
from plumbob.verify.kinematics.predictions import forward, path_to, solve
from plumbob.verify.mass_spring.problem import all_forces, elastic_energy, problem_of
from plumbob.verify.verify import verify

pytestmark = pytest.mark.usefixtures("verdict_alone")

IK, TRACK, FORCES, ENERGY, STEP = (
    "inverse_kinematics", "track", "mass_spring_forces", "energy", "mass_spring_step",
)  # fmt: skip
DOWN = [0.0, -9.8, 0.0]


def judged(task, function, **declared):
    (report,) = verify(FunctionConnection({task: function}, Greeting(1, (task,), **declared))).tasks
    return report


def words(report):
    return " ".join(assumption.text(lambda text: text) for assumption in report.assumptions)


def turn_bodies(skips_root=False, is_carried=False, cast=float):
    """Return CCD of 20 sweeps and 1 cm that rotates the bodies below a joint about it."""

    def ccd(parents, offsets, local_rotations, target, effector):
        skeleton = {"parents": parents, "offsets": offsets, "local_rotations": local_rotations}
        x, R = (np.array(part, dtype=cast) for part in forward(skeleton))
        carries = np.eye(len(parents), dtype=bool)
        for j in range(1, len(parents)):
            carries[j] |= carries[parents[j]]
        for _ in range(20):
            if np.linalg.norm(x[effector] - target) < 0.01:
                break
            for j in path_to(parents, effector)[:-1][skips_root:][::-1]:
                q, bodies = between(x[effector] - x[j], target - x[j]), carries[:, j]
                x[bodies] = x[j] + rotate(q, x[bodies] - x[j])
                turned = j if is_carried else bodies
                R[turned] = multiply(q, R[turned])
        local = np.concatenate([R[:1], multiply(conjugate(R[parents[1:]]), R[1:])])
        local /= np.linalg.norm(local, axis=-1, keepdims=True)
        return {"local_rotations": local.astype(cast)}

    return ccd


def by_points(parents, offsets, local_rotations, target, effector):
    """FABRIK of 20 iterations that ends within 1 cm, whatever is asked."""
    inputs = {
        "parents": parents, "offsets": offsets, "local_rotations": local_rotations,
        "target": target, "effector": effector, "tolerance": 0.01, "max_iterations": 20,
    }  # fmt: skip
    return {"local_rotations": solve("fabrik", inputs)[0]}


def by_jacobian(parents, offsets, local_rotations, target, effector):
    """A library's solver, which has neither iterations nor a tolerance to set."""
    solution = solve_ik(
        Skeleton(parents, offsets), local_rotations, target, "levenberg_marquardt",
        effector=effector, max_iterations=50, tolerance=0.01,
    )  # fmt: skip
    return {"local_rotations": solution.local_rotations}


CONSTANTS = Fixed(max_iterations=20, tolerance=0.01)
SOLVERS = {
    "fabrik": (by_points, "fabrik", 20),
    "library": (by_jacobian, "lm", "N"),  # 50, which answers do not show
    "bodies": (turn_bodies(), "ccd", 20),
    "bodies, single precision": (turn_bodies(cast=np.float32), "ccd", 20),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", SOLVERS)
def test_constant_iterations_and_tolerance_are_found_and_said(name):
    solver, method, count = SOLVERS[name]
    report = judged(IK, solver, methods=(method,))
    assert report.verdict is Verdict.RIGHT_EXCEPT
    assert f'Declare it with "fixed": {{"tolerance": 0.01, "max_iterations": {count}}}.' in words(
        report
    )
    assert ("N is a number of your program" in words(report)) is (count == "N")


@pytest.mark.slow
def test_a_distance_at_which_sweeps_happen_to_end_is_no_tolerance():
    def sweep_often(local_rotations, **inputs):
        inputs |= {"local_rotations": local_rotations, "tolerance": 0.0, "max_iterations": 15}
        return {"local_rotations": solve("ccd", inputs)[0]}

    report = judged(IK, sweep_often, methods=("ccd",))
    assert report.verdict is Verdict.RIGHT_EXCEPT
    assert '"fixed": {"tolerance": N, "max_iterations": 15}' in words(report)
    assert not report.diagnosis.explanations


@pytest.mark.sample("fabrik")
@pytest.mark.parametrize("name", ["library", "fabrik"])
def test_declared_constants_are_no_assumption(name):
    solver, method, _ = SOLVERS[name]
    report = judged(IK, solver, methods=(method,), fixed=CONSTANTS)
    assert not report.assumptions
    degenerate = {"target reached", "nearest point", "link lengths", "division by zero"}
    findings = [f for j in report.judgements for f in j.findings if j.case.requirement == "must"]
    assert {f.law for f in findings if f.verdict} <= degenerate - {"target reached"}
    assert report.verdict <= Verdict.RIGHT_EXCEPT


@pytest.mark.sample("declared0-wrong0")
@pytest.mark.parametrize("wrong", [{"skips_root": True}, {"is_carried": True}])
@pytest.mark.parametrize("declared", [{"fixed": CONSTANTS}, {}])
def test_a_wrong_solver_with_constants_is_wrong(wrong, declared):
    report = judged(IK, turn_bodies(**wrong), methods=("ccd",), **declared)
    assert report.verdict is Verdict.WRONG
    assert ("do not depend on tolerance, max_iterations" in words(report)) is not declared


def test_other_constants_than_the_declared_ones_are_wrong():
    report = judged(
        IK, by_points, methods=("fabrik",), fixed=Fixed(max_iterations=20, tolerance=1e-3)
    )
    assert report.verdict is Verdict.WRONG


def follow(solver):
    def track(local_rotations, curve, **inputs):
        poses = []
        for target in curve:
            local_rotations = solver(local_rotations=local_rotations, target=target, **inputs)[
                "local_rotations"
            ]
            poses.append(local_rotations)
        return {"local_rotations": np.array(poses)}

    return lambda parents, offsets, local_rotations, curve, effector: track(
        local_rotations, curve, parents=parents, offsets=offsets, effector=effector
    )


@pytest.mark.slow
@pytest.mark.parametrize("name", ["fabrik", "library"])
def test_tracks_with_a_constant_tolerance(name):
    solver, method, _ = SOLVERS[name]
    report = judged(TRACK, follow(solver), methods=(method,))
    assert report.verdict is Verdict.RIGHT_EXCEPT
    assert '"fixed": {"tolerance": ' in words(report)
    declared = judged(TRACK, follow(solver), methods=(method,), fixed=CONSTANTS)
    assert declared.verdict is Verdict.RIGHT


def forces(gravity=None, undamped=False, factor=1.0):
    def function(**inputs):
        inputs["gravity"] = inputs["gravity"] if gravity is None else np.array(gravity)
        inputs["dampings"] = inputs["dampings"] * (not undamped)
        inputs["stiffnesses"] = factor * inputs["stiffnesses"]
        return {"forces": all_forces(problem_of(inputs))}

    return function


def energies(names):
    def function(**inputs):
        p = problem_of(inputs | {"gravity": np.array(DOWN)})
        parts = {
            "elastic": elastic_energy(p), "gravitational": 9.8 * p.masses @ p.positions[:, 1],
            "kinetic": 0.5 * float(p.masses @ (p.velocities**2).sum(axis=1)),
        }  # fmt: skip
        parts["total"] = sum(parts.values())
        return {name: parts[name] for name in names}

    return function


def step(own_gravity=None, own_h=None, least_damping=0.0):
    """Return symplectic Euler with constants of its own, or a damping in the place of 0."""

    def function(h, pinned, dampings, gravity, **inputs):
        h, gravity = own_h or h, gravity if own_gravity is None else np.array(own_gravity)
        dampings = np.where(dampings == 0.0, least_damping, dampings)
        p = problem_of({**inputs, "dampings": dampings, "gravity": gravity})
        v = inputs["velocities"] + h * all_forces(p) / p.masses[:, None]
        v[pinned] = 0.0
        return {"positions": p.positions + h * v, "velocities": v}

    return function


SYMPLECTIC = {"step": Step(method="symplectic", substeps=1, damper="explicit", velocity="separate")}
SYSTEMS = {
    "forces": (FORCES, forces(DOWN), DOWN, {}),
    "forces, absent": (FORCES, forces([0.0, 0.0, 0.0]), [0.0, 0.0, 0.0], {}),
    "forces, upright z": (FORCES, forces([0.0, 0.0, -9.81]), [0.0, 0.0, -9.81], {}),
    "energies": (ENERGY, energies(["elastic", "gravitational", "kinetic"]), DOWN, {}),
    "total energy": (ENERGY, energies(["total"]), DOWN, {}),
    "step": (STEP, step(DOWN), DOWN, SYMPLECTIC),
    "step, absent": (STEP, step([0.0, 0.0, 0.0]), [0.0, 0.0, 0.0], SYMPLECTIC),
}


@pytest.mark.sample(without=["forces, ", "step", "total"])
@pytest.mark.parametrize("name", SYSTEMS)
def test_a_constant_gravity_is_asked_about_and_right_if_declared(name):
    task, function, gravity, declared = SYSTEMS[name]
    report = judged(task, function, **declared)
    assert report.verdict is Verdict.UNDECIDED
    assert f'declare it with "fixed": {{"gravity": {gravity}}}; if not, it is a mistake' in words(
        report
    )
    report = judged(task, function, fixed=Fixed(gravity=tuple(gravity)), **declared)
    assert report.verdict is Verdict.RIGHT


def test_another_mistake_shows_beside_a_constant_gravity():
    report = judged(FORCES, forces(DOWN, factor=0.5))
    assert report.verdict is Verdict.WRONG
    assert f'"fixed": {{"gravity": {DOWN}}}' in words(report)
    fixed = Fixed(gravity=tuple(DOWN))
    assert judged(FORCES, forces(DOWN, factor=0.5), fixed=fixed).verdict is Verdict.WRONG
    assert judged(FORCES, forces([0.0, -9.7, 0.0]), fixed=fixed).verdict is Verdict.WRONG


def test_forces_without_dampers_are_right_if_declared():
    report = judged(FORCES, forces(undamped=True))
    assert report.verdict is Verdict.RIGHT_EXCEPT
    assert 'Declare it with "step": {"damper": "none"}.' in words(report)
    declared = Step(damper="none")
    assert judged(FORCES, forces(undamped=True), step=declared).verdict is Verdict.RIGHT
    wrong = forces(undamped=True, factor=0.5)
    assert judged(FORCES, wrong, step=declared).verdict is Verdict.WRONG
    assert judged(FORCES, wrong).verdict is Verdict.WRONG


def test_a_constant_h_is_asked_about_and_right_if_declared():
    report = judged(STEP, step(own_h=0.02), **SYMPLECTIC)
    assert report.verdict is Verdict.UNDECIDED
    assert 'declare it with "fixed": {"h": 0.02}; if not, it is a mistake' in words(report)
    declared = judged(STEP, step(own_h=0.02), fixed=Fixed(h=0.02), **SYMPLECTIC)
    assert declared.verdict is Verdict.RIGHT


def test_a_damping_of_zero_that_falls_back_is_said():
    report = judged(STEP, step(least_damping=1.0), **SYMPLECTIC)
    assert report.verdict is Verdict.WRONG
    (explanation,) = report.diagnosis.explanations
    assert explanation.sentence.values == {"name": "dampings"}
    assert not judged(STEP, step([0.0, -9.0, 0.0]), **SYMPLECTIC).diagnosis.explanations


@pytest.mark.parametrize(
    ("how", "fixed", "verdict"),
    [
        ("shifted", Fixed(), Verdict.WRONG),
        ("rotated", Fixed(), Verdict.RIGHT_EXCEPT),
        ("shifted", CONSTANTS, Verdict.RIGHT_EXCEPT),
    ],
)
def test_another_answer_in_another_world_is_not_right(how, fixed, verdict):
    """Eighty clipped steps of an honest solver turned a last digit into 0.09 m."""
    pose = SimpleNamespace(
        positions=np.zeros((3, 3)), path=np.arange(3), distance_to=lambda x: 0.09
    )
    shift = (np.array([1.0, 0.0, 0.0, 0.0]), 1.0, np.array([1.0, 0.0, 0.0]))
    facts = {"world": shift, "how": how, "size": 1.0, "amplification": 1.0, "reach": 1.0}
    trial = SimpleNamespace(pose=pose, case=SimpleNamespace(facts=facts))
    comparison = SimpleNamespace(method="", honest=False)
    greeting = Greeting(1, (IK,), fixed=fixed)
    found = inverse_kinematics._equal_worlds(trial, trial, comparison, greeting)
    assert found.verdict is verdict
