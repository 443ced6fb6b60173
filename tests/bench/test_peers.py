"""The adapters: each engine, where it is installed, finds poses that are evaluated as solved."""

import importlib
import itertools
import sys
import types

import numpy as np
import pytest

from plumbob.bench import clock
from plumbob.bench.measure.isolation import Solved
from plumbob.bench.measure.timing import Job
from plumbob.bench.peers import packages, protocol
from plumbob.bench.peers.catalogue import PEERS, PLUMBOB_LM
from plumbob.bench.peers.ik import placo
from plumbob.bench.peers.peer import ONE_START, PORTFOLIO, RESTARTS
from plumbob.bench.peers.protocol import OwnTime, SolverOutput, UnableError
from plumbob.bench.problems.evaluate import Targets, Tolerance, evaluator_of
from plumbob.bench.problems.robot_targets import robot_targets, uniform_targets, unreachable_targets
from plumbob.bench.problems.robots import CHARACTER, LIMIT_TOLERANCE, is_installed, robot
from plumbob.reference.inverse_kinematics.prepared import PreparedIK

TOLERANCE = Tolerance(1e-3, 1e-3)
# Those that take trees with several effectors.
TREES = {"plumbob", "closed_loop", "pink", "mink", "drake"}
FEW = 6


@pytest.fixture(params=PEERS, ids=lambda peer: peer.title)
def peer(request):
    """Every peer that is installed."""
    if not request.param.version:
        pytest.skip(f"{request.param.package} is not installed")
    return request.param


def module(peer):
    return peer.module.rpartition(".")[2]


def answers(peer, entry, name, targets):
    """The answers of a peer, and their evaluation."""
    job = Job(peer.module, robot(name), targets, TOLERANCE, entry.settings, entry.restarts, 60.0)
    messages = list(job.perform())
    solved = [message for message in messages if isinstance(message, Solved)]
    assert solved, messages
    q = np.array([answer.q for answer in solved])
    return solved, evaluator_of(name).evaluate(targets, q, TOLERANCE)


@pytest.fixture
def arm(peer):
    """An arm that a peer takes: EAIK takes no seven joints."""
    name = "ur5" if module(peer) == "eaik" else "iiwa14"
    if not is_installed(name):
        pytest.skip("example-robot-data is not installed")
    return name


def test_from_a_start_beside_the_solution_a_peer_finds_it(peer, arm, rng):
    """The start is a tenth of a radian away: no local minimum lies between."""
    evaluator = evaluator_of(arm)
    q = 0.7 * evaluator.robot.draw(rng, FEW)
    starts = q + rng.uniform(-0.1, 0.1, q.shape)
    targets = Targets(*evaluator.forward(q), starts, np.zeros(FEW, int))
    # with 5 ms, TRAC-IK misses one on a busy machine; IPOPT ends at the edge of the tolerance
    entry = peer.runs[{"trac_ik": -1, "drake": 1}.get(module(peer), 0)]
    solved, evaluation = answers(peer, entry, arm, targets)
    assert evaluation.solved.all()
    assert all(answer.claim in (1, -1) and not answer.trouble for answer in solved)


def test_no_peer_claims_an_unreachable_target(peer, arm):
    solved, evaluation = answers(peer, peer.runs[0], arm, unreachable_targets(arm, 2))
    assert not evaluation.solved.any()
    assert not any(answer.claim == 1 for answer in solved)


def test_with_restarts_hardly_a_target_within_reach_is_missed(peer, arm):
    """Twenty attempts and more: of six targets each of these solvers misses one at the most."""
    for entry in (entry for entry in peer.runs if entry.kind == RESTARTS):
        solved, evaluation = answers(peer, entry, arm, uniform_targets(arm, FEW, False))
        assert evaluation.solved.sum() >= FEW - 1
        claims = np.array([answer.claim == 1 for answer in solved])
        assert not (claims & ~evaluation.solved).any()


def test_the_character_is_for_those_that_take_trees(peer):
    prepare = importlib.import_module(peer.module).prepare
    if module(peer) not in TREES:
        with pytest.raises(UnableError, match="one chain of hinges"):
            prepare(robot(CHARACTER), TOLERANCE)
        return
    targets = uniform_targets(CHARACTER, 2, False)
    _, evaluation = answers(peer, peer.first(RESTARTS), CHARACTER, targets)
    assert evaluation.solved.all()
    assert not evaluation.rotation.any()


def test_ours_finds_every_target_of_every_stratum():
    entry, targets = PLUMBOB_LM.first(RESTARTS), robot_targets("iiwa14", 5)
    solved, evaluation = answers(PLUMBOB_LM, entry, "iiwa14", targets)
    assert evaluation.solved.all()
    assert all(answer.claim == 1 for answer in solved)


def test_peers_have_the_licences_of_the_packages(peer):
    metadata = packages.distribution_of(peer.package, peer.environment).metadata
    expression = metadata.get("License-Expression", "")
    texts = [expression, metadata.get("License", ""), *(metadata.get_all("Classifier") or [])]
    if expression or "icense" in " ".join(texts):
        assert peer.license.partition("-")[0].lower() in " ".join(texts).lower()


def test_the_answer_to_a_target_is_the_same_again_and_in_another_order(peer, arm):
    """TRAC-IK goes by the clock, in two threads; the toolbox draws from a generator of all C code,
    which the bench seeds by the target.
    """
    if module(peer) == "trac_ik":
        pytest.skip("its answers depend on the clock")
    targets = uniform_targets(arm, FEW, False)
    orders = [targets, targets, Targets(*(part[::-1] for part in targets))]
    for entry in peer.runs:
        first, second, backwards = (
            [(answer.claim, answer.q.tobytes()) for answer in answers(peer, entry, arm, order)[0]]
            for order in orders
        )
        assert first == second == backwards[::-1]


# Solvers that do not look at limits, or hardly.
UNLIMITED = {"closed_loop", "pybullet"}


def test_limits_are_kept_unless_the_peer_says_otherwise(peer, arm):
    if module(peer) in UNLIMITED:
        assert "limits" in peer.can.partition(";")[2] + peer.can.partition(",")[2]
        pytest.skip("its file says that it does not keep limits")
    for entry in peer.runs:
        _, evaluation = answers(peer, entry, arm, uniform_targets(arm, FEW, False))
        beyond = evaluation.beyond[np.isfinite(evaluation.beyond)]
        assert (beyond <= LIMIT_TOLERANCE).all(), peer.label_of(entry)


@pytest.mark.parametrize("version", ["", "0.10.2"])
def test_a_peer_in_an_environment_of_its_own_is_found_there(tmp_path, monkeypatch, version):
    monkeypatch.setattr(sys, "prefix", str(tmp_path))
    monkeypatch.setattr(packages, "version", packages.version.__wrapped__)  # not as read before
    if version:
        place = tmp_path / "peers" / "placo" / "lib" / "python3.11" / "site-packages"
        facts = place / f"placo-{version}.dist-info" / "METADATA"
        facts.parent.mkdir(parents=True)
        facts.write_text(f"Metadata-Version: 2.1\nName: placo\nVersion: {version}\n")
    assert placo.PEER.version == version


@pytest.mark.parametrize("restarts", [0, 3])
def test_our_prepared_call_is_ranked_and_answers_as_the_plain_call_does(restarts):
    """Peers that are set up beforehand are compared with a call of ours that is as well."""
    arm = robot("iiwa14")
    targets, module = robot_targets("iiwa14", 2), importlib.import_module(PLUMBOB_LM.module)
    prepared, plain = (
        module.prepare(arm, TOLERANCE, restarts=restarts, iterations=20, **settings)
        for settings in ({}, {"prepared": False})
    )
    solves = [prepared(targets.request(i)) for i in range(targets.shape[0])]
    for i, solve in enumerate(solves):
        answer, expected = solve(), plain(targets.request(i))()
        np.testing.assert_array_equal(answer.q, expected.q)
        assert answer.claim == expected.claim
        assert isinstance(solve.call.func, PreparedIK)
    for kind in (ONE_START, RESTARTS):
        assert PLUMBOB_LM.first(kind).settings.get("prepared", True)
        plain_calls = [e for e in PLUMBOB_LM.runs if e.kind == kind and not
                       e.settings.get("prepared", True)]  # fmt: skip
        assert [entry.note.endswith("plain call") for entry in plain_calls] == [True]


def test_every_entry_has_a_name_of_its_own_within_its_kind():
    names = [(entry.kind, peer.label_of(entry)) for peer in PEERS for entry in peer.runs]
    assert len(set(names)) == len(names)
    assert {kind for kind, _ in names} == {ONE_START, PORTFOLIO, RESTARTS}


@pytest.fixture
def ticks(monkeypatch):
    """A clock that advances by a second at each reading of the wall clock."""
    seconds = itertools.count()
    clocks = types.SimpleNamespace(
        perf_counter=lambda: float(next(seconds)), process_time=lambda: 0.25 * next(seconds)
    )
    monkeypatch.setattr(clock, "time", clocks)
    return seconds


def test_only_the_calls_of_a_solver_are_timed(ticks):
    """The processor's clock, read before and after the wall clock, shows 1 s of the four."""
    solve = protocol.Solve(lambda: next(ticks), lambda q: (q, next(ticks) < 0))
    assert solve().time == OwnTime(1.0)


def test_the_rest_of_a_loop_is_overhead_by_the_same_clock(ticks):
    """Every reading takes a second of wall time, of which a metered function sees one.

    The processor's clock runs slower, as beside other programs: the difference of the two was
    less than nothing.
    """

    def prepare():
        step = clock.library(lambda: next(ticks))
        return protocol.Solve(lambda: (step(), next(ticks)), lambda answer: (None, None))

    assert clock.overhead(prepare) == 5.0 - 2.0
    assert clock.overhead(lambda: protocol.Solve(lambda: None, lambda q: (q, None))) == 1.0
    assert not clock.is_metered()


def test_the_overhead_of_a_solver_that_raises_is_not_known():
    assert np.isnan(clock.overhead(lambda: 1 / 0))
    assert not clock.is_metered()


@pytest.mark.parametrize(("is_metered", "expected"), [(True, 0.5), (False, 0.0)])
def test_the_overhead_of_a_peer_is_of_its_loop_where_it_has_one(is_metered, expected, monkeypatch):
    """A program with a clock of its own reports the time of its library, too."""

    def prepare(model, tolerance):
        def solve():
            clock.report_library(1.0)
            return SolverOutput(None, None, OwnTime(1.5))

        return lambda request: solve

    adapter = types.SimpleNamespace(prepare=prepare, METERED=is_metered)
    monkeypatch.setitem(sys.modules, "a_peer", adapter)
    targets = robot_targets("iiwa14", 1)
    _, ready = Job("a_peer", robot("iiwa14"), targets, TOLERANCE, {}).set_up(adapter)
    assert ready.overhead == pytest.approx(expected, abs=1e-4)
