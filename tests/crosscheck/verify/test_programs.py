"""Programs written apart from the reference answer as it does; what is planted in them shows."""

import numpy as np
import planted_programs
import pytest
from planted_programs import FAULTS, IN

from plumbob import reference
from plumbob.reference import mass_spring

REQUESTS = planted_programs.requests()
LANGUAGES = ("cpp", "javascript", "python", "single")
# Some hundred roundings of numbers of size 1 to 100, and in single precision some thousand of
# 6e-8 on results of size 10: the forces are sums of products of about 100.
TOLERANCE = {"cpp": 1e-12, "javascript": 1e-12, "python": 1e-12, "single": 1e-4}
IK_METHODS = ("ccd", "fabrik")


def close(a, b, tolerance):
    a, b = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    return a.shape == b.shape and bool(np.all(np.abs(a - b) <= tolerance))


def same_rotations(a, b, tolerance):
    sign = np.where((np.asarray(a) * np.asarray(b)).sum(-1, keepdims=True) < 0.0, -1.0, 1.0)
    return close(a, np.asarray(b) * sign, tolerance)


def skeleton(request):
    return reference.Skeleton(request["parents"], request["offsets"])


def system(request):
    names = ("masses", "springs", "rest_lengths", "stiffnesses", "dampings", "gravity")
    parts = {name: np.array(request[name]) for name in names}
    model = reference.MassSpring(**parts, pinned=request.get("pinned", []))
    return model, reference.State(np.array(request["positions"]), np.array(request["velocities"]))


@pytest.fixture(params=LANGUAGES)
def language(request):
    return request.param


@pytest.fixture
def answered(language, right_answers):
    """Pairs of a request of a task and its answer."""
    answers = right_answers(language)
    assert not [one for one in answers if "error" in one]
    return lambda task: [
        (request, answer)
        for request, answer in zip(REQUESTS, answers, strict=True)
        if request["task"] == task
    ]


def test_forward_kinematics_is_the_references(answered, language):
    for request, answer in answered("forward_kinematics"):
        pose = reference.forward_kinematics(skeleton(request), request["local_rotations"])
        assert close(answer["positions"], pose.positions, TOLERANCE[language])
        assert same_rotations(answer["rotations"], pose.rotations, TOLERANCE[language])


def test_one_sweep_of_inverse_kinematics_is_the_references(answered, language):
    sweeps = [pair for pair in answered("inverse_kinematics") if pair[0]["max_iterations"] == 1]
    assert {request["method"] for request, _ in sweeps} == set(IK_METHODS)
    for request, answer in sweeps:
        found = reference.solve_ik(
            skeleton(request),
            request["local_rotations"],
            request["target"],
            solver=request["method"],
            effector=request["effector"],
            tolerance=0.0,
            max_iterations=1,
        )
        pose = reference.forward_kinematics(skeleton(request), found.local_rotations)
        assert close(answer["positions"], pose.positions, TOLERANCE[language])


def test_inverse_kinematics_reaches_the_target_by_rotations_that_agree(answered, language):
    whole = [pair for pair in answered("inverse_kinematics") if pair[0]["max_iterations"] > 1]
    for request, answer in whole:
        pose = reference.forward_kinematics(
            skeleton(request), np.array(answer["local_rotations"]).astype(float)
        )
        apart = np.linalg.norm(pose.positions[request["effector"]] - request["target"])
        assert apart <= request["tolerance"] + TOLERANCE[language]
        assert close(answer["positions"], pose.positions, TOLERANCE[language])
        assert answer["converged"]


def test_every_frame_of_a_track_is_reached(answered, language):
    ((request, answer),) = answered("track")
    for target, positions in zip(request["curve"], answer["positions"], strict=True):
        apart = np.linalg.norm(np.subtract(positions[request["effector"]], target))
        assert apart <= request["tolerance"] + TOLERANCE[language]


def test_resampled_points_are_evenly_spaced_along_the_polyline(answered, language):
    for request, answer in answered("resample"):
        curve = np.array(request["curve"])
        ends = np.vstack([curve, curve[:1]]) if request["closed"] else curve
        s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(ends, axis=0), axis=1))])
        at = np.linspace(0.0, s[-1], request["count"], endpoint=not request["closed"])
        expected = np.stack([np.interp(at, s, ends[:, axis]) for axis in range(3)], axis=1)
        assert close(answer["points"], expected, TOLERANCE[language])


def test_forces_and_energies_are_the_references(answered, language):
    ((request, answer),) = answered("mass_spring_forces")
    expected = mass_spring.forces(*system(request))
    assert close(answer["forces"], expected, TOLERANCE[language])
    ((request, answer),) = answered("energy")
    made, state = system(request)
    kinetic = mass_spring.kinetic_energy(made, state)
    potential = mass_spring.potential_energy(made, state.positions)
    assert close(answer["kinetic"], kinetic, TOLERANCE[language])
    assert close(answer["potential"], potential, TOLERANCE[language])
    assert close(answer["total"], kinetic + potential, TOLERANCE[language])


def converged_step(request):
    made, state = system(request)
    integrator = reference.ImplicitEuler(made, h=request["h"], tolerance=1e-14)
    return integrator.step(state).state


def ten_iterations(request):
    made, state = system(request)
    integrator = reference.ImplicitEuler(
        made, h=request["h"], solver="local_global", tolerance=0.0, max_iterations=10, start="y"
    )
    return integrator.step(state).state


def linearised_step(request):
    made, state = system(request)
    h, free = request["h"], np.setdiff1d(np.arange(len(request["masses"])), request["pinned"])
    unknowns = (3 * free[:, None] + np.arange(3)).ravel()
    masses = np.repeat(made.masses, 3)
    stiffness = mass_spring.stiffness_matrix(made, state.positions).toarray()
    force = mass_spring.forces(made, state).ravel()
    side = h * masses * state.velocities.ravel() + h**2 * force
    matrix = (np.diag(masses) + h**2 * stiffness)[np.ix_(unknowns, unknowns)]
    change = np.zeros(masses.size)
    change[unknowns] = np.linalg.solve(matrix, side[unknowns])
    change = change.reshape(-1, 3)
    return reference.State(state.positions + change, change / h)


STEPS = {
    "cpp": converged_step,
    "single": converged_step,
    "javascript": ten_iterations,
    "python": linearised_step,
}


def test_a_step_is_the_one_that_the_greeting_declares(answered, language):
    for request, answer in answered("mass_spring_step"):
        expected = STEPS[language](request)
        assert close(answer["positions"], expected.positions, TOLERANCE[language])
        scale = 1.0 / request["h"]
        assert close(answer["velocities"], expected.velocities, TOLERANCE[language] * scale)


def test_a_motion_is_made_of_steps(answered, language):
    ((request, answer),) = answered("mass_spring_motion")
    assert len(answer["positions"]) == len(answer["velocities"]) == request["steps"]
    before = request
    for positions, velocities in zip(answer["positions"], answer["velocities"], strict=True):
        expected = STEPS[language]({**request, **before})
        assert close(positions, expected.positions, TOLERANCE[language])
        before = {"positions": positions, "velocities": velocities}


def same(a, b):
    return a.shape == b.shape and np.allclose(a, b, rtol=0.0, atol=1e-9, equal_nan=True)


def unlike(one, other):
    """The tasks whose answers differ by more than rounding."""
    found = set()
    for request, a, b in zip(REQUESTS[1:], one[1:], other[1:], strict=True):
        a, b = planted_programs.values(a), planted_programs.values(b)
        if not all(same(a[name], b[name]) for name in a.keys() - {"iterations"}):
            found.add(request["task"])
    return found


PLANTED = [(language, fault) for language in IN for fault in IN[language]]
# The compiled program starts at once; of those that an interpreter runs, every sixth is quick.
CHOSEN = [
    pytest.param(*pair, marks=[] if pair[0] == "cpp" or n % 6 == 0 else [pytest.mark.slow])
    for n, pair in enumerate(PLANTED)
]


@pytest.mark.parametrize(("language", "fault"), CHOSEN)
def test_a_planted_fault_changes_its_tasks_answers(language, fault, program, right_answers):
    answers, _ = planted_programs.ask([*program(language), "--fault", fault], REQUESTS)
    assert FAULTS[fault]["task"] in unlike(right_answers(language), answers)


def test_each_program_has_twenty_faults_and_each_fault_a_program():
    assert all(len(set(faults)) == len(faults) >= 20 for faults in IN.values())
    assert set().union(*IN.values()) == set(FAULTS)


def test_a_name_that_is_not_planted_changes_nothing(program, right_answers):
    answers, _ = planted_programs.ask([*program("cpp"), "--fault", "none"], REQUESTS)
    assert not unlike(right_answers("cpp"), answers)
