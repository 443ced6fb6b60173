"""One cloth for every solver: adapters, errors, limits of stability, tables and figures."""

import importlib
from functools import partial

import numpy as np
import pytest
from table_cells import column

from plumbob.bench.experiments import Scale
from plumbob.bench.experiments import cloth_peers as peers_cloth
from plumbob.bench.experiments.cloth_peers import (
    MOTION,
    MOTION_TARGETS,
    NEAR,
    ONE_STEP,
    SOLVED,
    TARGETS,
    Rung,
    motion_rungs,
    step_rungs,
)
from plumbob.bench.measure.isolation import JobOutcome
from plumbob.bench.peers import catalogue
from plumbob.bench.peers.peer import EXPLICIT, LINEARISED, Peer, Run
from plumbob.bench.problems import cloth_truth as truth
from plumbob.bench.problems.cloth_truth import rms_distance, true_motion, truth_of
from plumbob.bench.problems.falling_cloth import (
    FRAME,
    MASS,
    FallingCloth,
    explicit_substeps,
    falling_cloth,
    highest_frequency,
    highest_mode,
    level_cloth,
)
from plumbob.bench.problems.step_minima import StepMinima
from plumbob.bench.tables.results import Results
from plumbob.bench.tables.table import best_cells
from plumbob.reference import ImplicitEuler, MassSpring, State, symplectic_euler
from plumbob.reference.mass_spring import stiffness_matrix

SIZE, STIFFNESS = 5, 100.0
# Single precision rounds positions of two metres to 1e-7, over and over.
DOUBLE, SINGLE = 1e-12, 2e-5
PRECISION = {"Plumbob": DOUBLE, "MuJoCo": DOUBLE, "Newton engine": SINGLE, "PyBullet": DOUBLE}
# To compile these takes Newton a minute.
LONG_TO_COMPILE = ("VBD", "XPBD")


def slow_if_long_to_compile(peer):
    marks = [pytest.mark.slow] if any(name in peer.title for name in LONG_TO_COMPILE) else []
    return pytest.param(peer, marks=marks, id=peer.title)


@pytest.fixture(params=map(slow_if_long_to_compile, catalogue.cloth_peers()))
def peer(request):
    """Every solver that is installed."""
    if not request.param.version:
        pytest.skip(f"{request.param.package} is not installed")
    return request.param


@pytest.fixture(scope="module")
def cloth():
    """A small soft cloth in mid-fall."""
    return falling_cloth(SIZE, STIFFNESS)


def moved(peer, cloth, frames=1, frame=FRAME, **settings):
    """Where a solver takes the cloth."""
    adapter = importlib.import_module(peer.module)
    mover = adapter.prepare(cloth.system, frame, **{**peer.run.settings, **settings})
    mover.begin(cloth.start)
    for _ in range(frames):
        mover.advance()
    return mover.positions()


def symplectic(system, state, steps, h):
    """The state after steps of symplectic Euler."""
    return symplectic_euler(system, state, h, steps=steps)


def one_spring(stiffness=7.0, mass=2.0, stretched=0.01):
    """A mass on a spring along its axis: exactly linear, its frequency sqrt(k / m)."""
    system = MassSpring([1.0, mass], [[0, 1]], 1.0, stiffness, pinned=[0], gravity=(0, 0, 0))
    state = State([[0.0, 0, 0], [1.0 + stretched, 0, 0]], np.zeros((2, 3)))
    return FallingCloth(2, stiffness, system, state, np.sqrt(stiffness / mass))


# The problem.


@pytest.mark.parametrize("size", [4, 7])
def test_the_cloth_weighs_the_same_whatever_its_particles_and_has_fallen(size):
    cloth = falling_cloth(size, STIFFNESS)
    assert cloth.system.masses.sum() == pytest.approx(MASS)
    assert cloth.start.positions[:, 1].min() < 1.0 < 1.5 == cloth.start.positions[0, 1]
    assert not cloth.system.damped
    assert [explicit_substeps(2.0 / FRAME, margin) for margin in (1.0, 1.1)] == [1, 2]


def test_the_highest_mode_is_one_and_none_is_higher(cloth):
    """The eigenvalues of a matrix this small are found all at once."""
    square, mode = highest_mode(cloth.system, cloth.start.positions)
    free = np.repeat(cloth.system.free, 3)
    K = stiffness_matrix(cloth.system, cloth.start.positions).toarray()[free][:, free]
    masses = np.repeat(cloth.system.masses, 3)[free]
    np.testing.assert_allclose(K @ mode.ravel()[free], square * masses * mode.ravel()[free],
                               atol=1e-9 * square * masses.max())  # fmt: skip
    assert np.linalg.eigvalsh(K / masses[0]).max() == pytest.approx(square)
    assert not mode[cloth.system.pinned].any()
    near = highest_frequency(cloth.system, cloth.start.positions)
    assert near == pytest.approx(square**0.5, rel=5e-3)


# The answers that others are held against.


@pytest.mark.slow
def test_the_truth_is_of_order_four_and_surer_than_any_error_measured():
    answers = truth_of(falling_cloth(SIZE, STIFFNESS), 2)
    assert answers.order == pytest.approx(4.0, abs=0.15)
    assert answers.unsure < 0.1 * MOTION_TARGETS[NEAR]


def test_the_truth_is_where_symplectic_euler_goes_at_order_one(cloth):
    true = true_motion(cloth, 1, 40)[-1]
    coarse, fine = (
        symplectic(cloth.system, cloth.start, steps, FRAME / steps) for steps in (200, 400)
    )
    errors = [rms_distance(state.positions, true) for state in (coarse, fine)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(1.0, abs=0.1)


@pytest.mark.slow
def test_the_truth_is_that_of_another_engines_runge_kutta(cloth):
    """MuJoCo shares no code with the truth; its steps are those of the finest motion."""
    (peer,) = [peer for peer in catalogue.cloth_peers() if peer.title == "MuJoCo RK4"]
    substeps = 4 * explicit_substeps(cloth.beat, truth._COARSE)
    ends, true = moved(peer, cloth, 2, substeps=substeps), truth_of(cloth, 2).true
    np.testing.assert_allclose(ends, true[-1], atol=1e-12)


@pytest.mark.slow
def test_the_converged_step_is_that_of_another_solver(cloth, monkeypatch):
    integrator = ImplicitEuler(
        cloth.system, h=FRAME, solver="lbfgs", tolerance=1e-12, max_iterations=2000
    )
    after = integrator.step(cloth.start).state.positions
    minima = StepMinima(cloth.system, cloth.start, FRAME)
    np.testing.assert_allclose(minima.newton.positions, after, atol=1e-9)
    monkeypatch.setattr("plumbob.reference.judging.minima.MAX_ITERATIONS", 1)
    with pytest.raises(ArithmeticError, match="ended the step as ITERATION_LIMIT"):
        StepMinima(cloth.system, cloth.start, FRAME)


# The errors.


@pytest.mark.slow
def test_a_motion_has_diverged_if_one_particle_is_ever_too_far():
    answers = truth_of(falling_cloth(SIZE, STIFFNESS), 2)
    assert peers_cloth.motion_error(answers.true, answers) == answers.unsure
    start = falling_cloth(SIZE, STIFFNESS).start.positions
    assert peers_cloth.motion_error(np.array([start, start]), answers) == pytest.approx(1.0)
    for bad in (3.0, np.nan, -np.inf):
        positions = answers.true.copy()
        positions[0, 2, 0] += bad
        assert peers_cloth.motion_error(positions, answers) == np.inf


# The adapters.


def test_a_solver_begins_anew_from_where_it_is_put(peer, cloth):
    adapter = importlib.import_module(peer.module)
    settings = {"substeps": 8} if peer.run.kind == EXPLICIT else {}
    mover = adapter.prepare(cloth.system, FRAME, **{**peer.run.settings, **settings})
    ends = []
    for _ in range(2):
        mover.begin(cloth.start)
        mover.advance()
        ends.append(np.array(mover.positions()))
        mover.advance()
    tolerance = PRECISION[peer.engine]
    np.testing.assert_allclose(ends[0], ends[1], atol=tolerance)
    assert rms_distance(ends[0], cloth.start.positions) > 1e-2
    pinned = cloth.system.pinned
    np.testing.assert_allclose(ends[0][pinned], cloth.start.positions[pinned], atol=tolerance)


def test_a_frame_of_many_steps_is_many_frames_of_one(peer, cloth):
    iterations = {} if peer.run.kind != "iterations" else {"iterations": 10}
    many = moved(peer, cloth, substeps=4, frame=FRAME / 4, **iterations)
    few = moved(peer, cloth, frames=4, frame=FRAME / 16, **iterations)
    np.testing.assert_allclose(many, few, atol=PRECISION[peer.engine])


EULERS = ("symplectic", "Euler", "implicitfast", "semi-implicit")
MUJOCO_EULERS = ("MuJoCo Euler", "MuJoCo implicitfast", "MuJoCo flex, Euler")


def test_all_who_say_so_are_symplectic_euler(peer, cloth):
    if not any(name in peer.title for name in EULERS):
        pytest.skip("says nothing of the kind")
    state = symplectic(cloth.system, cloth.start, 16, FRAME / 8)
    ends = moved(peer, cloth, frames=2, substeps=8)
    np.testing.assert_allclose(ends, state.positions, atol=PRECISION[peer.engine])


def test_one_linear_solve_is_the_gauss_newton_step(peer, cloth):
    """MuJoCo's conjugate gradients end at 1e-8, unless set to go on."""
    if peer.run.kind != LINEARISED:
        pytest.skip("solves no linear system, or several")
    result = ImplicitEuler(cloth.system, h=FRAME, solver="gauss_newton").step(cloth.start)
    tolerance = 1e-6 if peer.title == "MuJoCo discrete" else 1e-10
    np.testing.assert_allclose(moved(peer, cloth), result.state.positions, atol=tolerance)


@pytest.mark.parametrize("stiffness", [50.0, 200.0])
def test_a_model_kept_by_mujoco_takes_on_the_stiffness_asked_for(stiffness):
    cloth = falling_cloth(SIZE, stiffness)
    level = falling_cloth(SIZE, STIFFNESS).system
    assert not np.array_equal(cloth.system.stiffnesses, level.stiffnesses)
    for peer in (p for p in catalogue.cloth_peers() if p.title in MUJOCO_EULERS):
        moved(peer, falling_cloth(SIZE, STIFFNESS), substeps=8)
        state = symplectic(cloth.system, cloth.start, 8, FRAME / 8)
        ends = moved(peer, cloth, substeps=8)
        np.testing.assert_allclose(ends, state.positions, atol=DOUBLE)


def test_whoever_iterates_towards_implicit_euler_gets_nearer(peer, cloth):
    """XPBD, which adds what all springs want, need not: it is tried on one spring."""
    if peer.run.kind != "iterations" and "XPBD" not in peer.title:
        pytest.skip("does not iterate")
    many = 200 if "Newton engine" in peer.title else 1000
    if "XPBD" in peer.title:
        cloth = one_spring()
    exact = StepMinima(cloth.system, cloth.start, FRAME).newton.positions
    ends = moved(peer, cloth, iterations=many)
    assert rms_distance(ends, exact) < 20 * PRECISION[peer.engine] + 1e-9


@pytest.fixture
def bullet():
    pytest.importorskip("pybullet", exc_type=ImportError)
    return importlib.import_module("plumbob.bench.peers.cloth.pybullet_deformable")


def test_newton_colours_no_two_particles_of_a_spring_alike(cloth):
    pytest.importorskip("newton", exc_type=ImportError)
    adapter = importlib.import_module("plumbob.bench.peers.cloth.newton")
    groups = adapter.model(cloth.system).particle_color_groups
    colour = np.full(cloth.system.particle_count, -1)
    for number, group in enumerate(groups):
        colour[group.numpy()] = number
    i, j = cloth.system.springs.T
    assert (colour >= 0).all()
    assert (colour[i] != colour[j]).all()
    assert len(groups) <= 13  # no particle has more than twelve neighbours


@pytest.mark.parametrize("size", [3, 6])
def test_bullets_mesh_has_the_springs_for_edges_and_no_corners_in_line(bullet, size):
    system, _ = level_cloth(size, STIFFNESS)
    flat, triangles = bullet.mesh(system)
    ends = np.diff(flat[system.springs], axis=1)[:, 0]
    np.testing.assert_allclose(np.linalg.norm(ends, axis=-1), system.rest_lengths)
    a, b, c = np.moveaxis(flat[triangles], 1, 0)
    assert np.linalg.norm(np.cross(b - a, c - a), axis=-1).min() > 1e-3


@pytest.mark.parametrize("change", ["masses", "stiffnesses", "rest_lengths", "dampings"])
def test_bullet_refuses_what_it_cannot_move(bullet, change):
    system, _ = level_cloth(4, STIFFNESS)
    values = getattr(system, change).copy()
    values[-1] += 0.1
    with pytest.raises(ValueError, match="system: expected"):
        bullet.prepare(system.replaced(**{change: values}), FRAME)
    with pytest.raises(ValueError, match="square cloth"):
        bullet.prepare(one_spring().system, FRAME)


def test_bullet_goes_where_symplectic_euler_goes_whatever_was_before(bullet):
    """A cloth whose spacing is no binary fraction; before, it was thrown until it blew up."""
    system, level = level_cloth(6, STIFFNESS)
    thrown = State(level.positions, 50.0 * np.ones_like(level.positions))
    mover = bullet.prepare(system, 3.0)
    mover.begin(thrown)
    for _ in range(50):
        mover.advance()
    state = State(level.positions, system.free[:, None] * np.array([0.3, -0.2, 0.1]))
    mover = bullet.prepare(system, FRAME, substeps=8)
    mover.begin(state)
    mover.advance()
    state = symplectic(system, state, 8, FRAME / 8)
    np.testing.assert_allclose(mover.positions(), state.positions, atol=1e-10)


def test_every_entry_has_a_name_and_every_rung_a_label_of_its_own():
    titles = [peer.title for peer in catalogue.cloth_peers()]
    assert len(set(titles)) == len(titles)
    for peer in catalogue.cloth_peers():
        assert peer.title.startswith(peer.engine)
        for rungs in (step_rungs(peer, 1000.0), motion_rungs(peer, 1000.0)):
            labels = [rung.label for rung in rungs]
            assert len(set(labels)) == len(labels) > 0


# Isolation.

FAKES = """
import numpy as np

class Mover:
    def __init__(self, manner):
        self.manner = manner

    def begin(self, state):
        self.x, self.done = np.array(state.positions), 0

    def advance(self):
        self.done += 1
        self.x = self.x + 0.01
        if self.done == 3 and len(self.x) > 9:  # not while it is tried out
            if self.manner == "raises":
                raise ArithmeticError("in one frame")
            if self.manner == "overflows":
                raise FloatingPointError("too large a step")
            if self.manner == "explodes":
                self.x = self.x * 1e300 * 1e300

    def positions(self):
        return self.x

def prepare(system, frame, manner="well"):
    if manner == "unable":
        raise ValueError("takes no cloths")
    return Mover(manner)
"""


@pytest.fixture(scope="module", autouse=True)
def fakes(importable):
    importable("fake_cloth_solvers", FAKES)


def fake_peer(manner, package="numpy"):
    runs = (Run(LINEARISED, {"manner": manner}),)
    return Peer(manner, "fake_cloth_solvers", package, "", "", "", runs, engine="Fake")


def as_it_is(peer, frequency):
    """The one rung of a solver that knows no substeps."""
    return [Rung("as it is", peer.run.settings)]


@pytest.fixture
def here(monkeypatch, in_this_process):
    monkeypatch.setattr(peers_cloth, "worker_process", in_this_process)


FALL = peers_cloth.Fall(peers_cloth.Level(SIZE, 5), partial(falling_cloth, SIZE, STIFFNESS))


@pytest.mark.parametrize(
    ("manner", "remark", "trouble"),
    [
        ("well", "", ""),
        ("explodes", "diverged", False),
        ("overflows", "diverged", False),
        ("raises", "ArithmeticError: in one frame", True),
        ("unable", "ValueError: takes no cloths", True),
    ],
)
def test_every_manner_becomes_one_point(here, monkeypatch, manner, remark, trouble):
    """A process that hangs or ends says so as one that raises: `test_worker_death`."""
    monkeypatch.setattr(peers_cloth, "motion_rungs", as_it_is)
    measured = peers_cloth.work(MOTION, fake_peer(manner), [FALL])
    assert np.isfinite(measured["error"]).tolist() == [manner == "well"]
    assert measured["remarks"] == [remark]
    assert measured["trouble"] == (remark if trouble else "")


def test_a_solver_that_did_not_finish_is_not_tried_again(monkeypatch):
    jobs = []

    class Silent:
        def perform(self, job):
            jobs.append(job)
            return JobOutcome(trouble="ended after 600 s of silence", is_silent=True)

    monkeypatch.setattr(peers_cloth, "worker_process", Silent)
    monkeypatch.setattr(peers_cloth, "_unfinished", {})
    measured = peers_cloth.work(MOTION, fake_peer("well"), [FALL, FALL])
    assert len(jobs) == 1
    assert np.isinf(measured["error"]).all()
    assert all("not finished: ended" in remark for remark in measured["remarks"])


def test_a_ladder_is_run_whole_and_says_what_single_precision_allows(here):
    newton = next(peer for peer in catalogue.cloth_peers() if peer.title == "Plumbob Newton")
    measured = peers_cloth.work(ONE_STEP, newton, [FALL])
    errors = measured["error"]
    assert len(measured["rungs"]) == len(errors) == len(newton.run.ladder)
    assert errors[-1] < 1e-12
    assert 1e-7 < measured["rounding"][0] < TARGETS[SOLVED]


def test_explicit_solvers_take_no_implicit_step_and_all_move():
    """In every sweep, in alternating order."""
    blocks = [b for b in peers_cloth.blocks(Scale(1, 0.1)) if b.settings.get("sweep")]
    by_task = {task: [b for b in blocks if b.facts["task"] == task] for task in (ONE_STEP, MOTION)}
    kinds = {task: {b.facts["kind"] for b in by_task[task]} for task in by_task}
    assert EXPLICIT not in kinds[ONE_STEP]
    assert kinds[MOTION] == {EXPLICIT, *kinds[ONE_STEP]}
    first, second = (
        [b.solver for b in by_task[MOTION] if (b.settings["sweep"], b.settings["stiffness"]) == key]
        for key in ((1, 1e3), (2, 1e3))
    )
    assert first == second[::-1]


def test_a_missing_peer_costs_one_block_that_says_so(monkeypatch):
    gone = [fake_peer(name, "a-package-that-nobody-has") for name in ("one", "two")]
    monkeypatch.setattr(catalogue, "cloth_peers", lambda entrants: gone)
    missing = [b for b in peers_cloth.blocks(Scale(1, 0.1)) if b.problem == "peers/all"]
    (block,) = missing
    assert block.measure()["remark"] == "a-package-that-nobody-has is not installed"


# Limits of stability.


def test_bisection_finds_a_limit_from_either_side_or_says_that_there_is_none():
    for limit, guess in ((0.3, 1.0), (0.3, 1e-3), (0.3, 0.25)):
        step = peers_cloth.stability_limit(lambda h, limit=limit: h <= limit, guess)
        assert step == pytest.approx(limit, rel=peers_cloth.BISECTION)
    for answer in (True, False):
        with pytest.raises(ArithmeticError, match="no limit of stability"):
            peers_cloth.stability_limit(lambda h, answer=answer: answer, 1.0)


REST = np.array([[0.0, 0, 0], [1.0, 0, 0]])
# h omega at the limit: that of the trapezium of Runge-Kutta's stability region on the imaginary
# axis is the square root of 8.
LIMITS = {"Plumbob symplectic Euler": 2.0, "Plumbob Runge-Kutta": 8.0**0.5, "MuJoCo Euler": 2.0}


@pytest.mark.parametrize(
    "title",
    [pytest.param(title, marks=[pytest.mark.slow] if "Kutta" in title else []) for title in LIMITS],
)
def test_the_limit_of_one_spring_is_known_exactly(title, monkeypatch, here):
    """A growth of a hundredfold shows a little beyond it: (h omega)² - 4 is 7e-5, or for
    Runge-Kutta, of which |R(ih omega)| climbs with a slope of 2.5, h omega is 0.005 too large.
    """
    peer = next(peer for peer in catalogue.cloth_peers() if peer.title == title)
    spring = one_spring()
    monkeypatch.setattr(peers_cloth, "hanging_cloth", lambda size, k: (spring.system, REST))
    arrays = peers_cloth.stability(peer, (spring.stiffness,))
    assert arrays["frequency"] == pytest.approx([np.sqrt(7.0 / 2.0)])
    reached = np.array(arrays["limit"]) * np.array(arrays["frequency"])
    assert reached == pytest.approx([LIMITS[title]], rel=2e-3 if "Kutta" in title else 5e-4)


def test_a_solver_that_fails_has_no_limit_and_says_why(here):
    measured = peers_cloth.stability(fake_peer("unable"), (STIFFNESS,))
    assert np.isnan(measured["limit"]).all()
    assert "TypeError" in measured["remark"]


# Tables and figures.


def test_the_table_of_one_step_ranks_by_time_to_the_criterion_then_by_error(make):
    records = [
        make.worked("MuJoCo discrete", error=(0.5, 0.4), facts={"kind": LINEARISED}),
        make.worked("Newton engine, VBD", seconds=(1e-3, 0.5)),
        make.worked("Plumbob Newton"),
    ]
    table = peers_cloth.one_step(Results(records))
    assert column(table, "solver") == ["Plumbob Newton", "Newton engine, VBD", "MuJoCo discrete"]
    assert column(table, "time to 1e-2 [ms]") == [10.0, 500.0, None]
    assert column(table, "time to 1e-4 [ms]") == [10.0, 500.0, None]
    assert column(table, "setting for 1e-4") == ["10 iterations", "10 iterations", None]
    assert column(table, "smallest error") == [1e-4, 1e-4, 0.4]
    assert column(table, "remark") == ["10 iterations: tired"] * 3
    (point,) = table.summary.points
    assert point.endswith("to 1e-4 Plumbob Newton, 10.0 ms (then Newton engine, VBD, 500 ms)")
    assert "already an error of 9.0e-6;" in table.measured


def test_of_two_minima_the_lower_is_named_and_both_are_right(make):
    lower = {"above": [0.1, -0.25], "minimum": [-0.25, -0.25], "proven": [True, True]}
    higher = {"above": [0.5, 0.0], "minimum": [0.0, 0.0], "proven": [True, True]}
    records = [make.worked("a").with_measured(**lower), make.worked("b").with_measured(**higher)]
    table = peers_cloth.one_step(Results(records))
    assert column(table, "g above lowest") == pytest.approx([0.0, 0.2])
    remarks = column(table, "remark")
    assert ["near a minimum that is not the lowest: g is 0.200" in r for r in remarks] == [0, 1]
    assert "near different minima on 20 × 20, 1,000 N/m." in table.summary.sentence


def test_sweeps_are_joined_and_their_differences_reported(make):
    """The time is the median; a solver whose errors differ is named."""
    records = [
        make.worked(solver, error=(0.5, error), seconds=(1e-3, seconds), settings={"sweep": i})
        for i, seconds in ((3, 9e-3), (1, 1e-3), (2, 3e-3))
        for solver, error in (("steady", 1e-5), ("random", 1e-5 * i))
    ]
    table = peers_cloth.one_step(Results(records))
    assert column(table, "time to 1e-4 [ms]") == [3.0, 3.0]
    assert column(table, "slowest over fastest sweep") == pytest.approx([9.0, 9.0])
    assert column(table, "difference between sweeps") == pytest.approx([0.0, 2e-5])
    assert column(table, "smallest error") == [1e-5, 1e-5]
    agreement = "3 sweeps differ by a factor of at most 9.00; the errors are equal to the bit but"
    assert f"{agreement} for random." in table.measured


def test_the_table_of_motions_ranks_by_time_to_the_truth(make):
    farther = make.fell("MuJoCo RK4", error=[np.inf, np.inf, 3e-2])
    near = make.fell("Plumbob Newton", error=[np.inf, 5e-2, 5e-3])
    table = peers_cloth.motion(Results([farther, make.fell("MuJoCo Euler"), near]))
    assert column(table, "solver") == ["Plumbob Newton", "MuJoCo Euler", "MuJoCo RK4"]
    assert column(table, "time to 10 % [ms]") == [1.0, 1.0, 1000.0]
    assert column(table, "time to 1 % [ms]") == [1000.0, None, None]
    assert column(table, "smallest error [%]") == pytest.approx([0.5, 2.0, 3.0])
    assert column(table, "remark") == ["1 step: diverged"] * 3
    (point,) = table.summary.points
    assert point.endswith("to 1 % Plumbob Newton, 1,000 ms")
    assert "order of 3.50" in table.measured
    place = [c.title for c in table.columns].index("smallest error")
    assert {i for i, j in best_cells(table) if j == place} == {0}


def test_one_linear_solve_is_labelled_a_linearised_step(make):
    facts = {"kind": LINEARISED, "rungs": ["1 step"], "remarks": [""]}
    arrays = {"sizes": [20], "seconds": [1e-3], "error": [0.4]}
    table = peers_cloth.one_step(Results([make.worked("MuJoCo discrete", **arrays, facts=facts)]))
    assert column(table, "remark") == ["one linearised step"]


def test_a_missing_engine_has_a_row_in_both_tables(make):
    notes, facts = {"remark": "not installed"}, {"task": "missing"}
    missing = make.record("cloth", "peers/all", "newton", notes=notes, facts=facts)
    for table in (peers_cloth.one_step(Results([missing])), peers_cloth.motion(Results([missing]))):
        (row,) = table.rows
        assert row[:2] == ("every cloth", "newton")
        assert "not installed" in row


def test_a_limit_of_stability_stands_beside_the_motions_in_units_of_the_theory(make):
    records = [make.bounded("a", 0.02), make.bounded("b", np.nan), make.fell("a"), make.fell("b")]
    table = peers_cloth.motion(Results(records))
    assert column(table, "stability limit [2/ω]") == [pytest.approx(1.0), None]
    assert column(table, "longest stable step [ms]")[0] == 20.0


def test_the_published_times_stand_beside_ours(make):
    record = make.sample("as_liu", solver="local_global", arrays={"seconds": [0.03]})
    table = peers_cloth.liu(Results([record]))
    assert table.rows == (("local/global", "10 iterations", 50.0, 30.0, 0.5),)
    assert "abstract" in table.measured
    (point,) = table.summary.points
    for part in ("local/global, 10 iterations", "30.0 ms", "50.0 ms", "0.500"):
        assert part in point
