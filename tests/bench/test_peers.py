"""The adapters: each engine, where it is installed, finds poses that are evaluated as solved."""

import importlib
import importlib.metadata

import numpy as np
import pytest

from bench.experiments.robots.evaluate import Targets, Tolerance, evaluator_of
from bench.experiments.robots.job import Job
from bench.experiments.robots.problem import CHARACTER, is_installed, robot
from bench.experiments.robots.targets import robot_targets, uniform_targets, unreachable_targets
from bench.harness.worker import Solved
from bench.peers.ik.protocol import UnableError
from bench.peers.registry import ONE_START, OURS, PEERS, RESTARTS

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


def answers(peer, entry, name, targets, tolerance=TOLERANCE):
    """What a peer says of targets, and the evaluation."""
    job = Job(peer.module, robot(name), targets, tolerance, entry.settings, entry.restarts, 60.0)
    said = list(job.perform())
    solved = [message for message in said if isinstance(message, Solved)]
    assert solved, said
    q = np.array([one.q for one in solved])
    return solved, evaluator_of(name).evaluate(targets, q, tolerance)


def first_six(targets):
    """The first six targets."""
    return Targets(*(part[:FEW] for part in targets))


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
    targets = Targets(
        *evaluator.forward(q), q + rng.uniform(-0.1, 0.1, q.shape), np.zeros(FEW, int)
    )
    solved, verdict = answers(peer, peer.entries[0], arm, targets)
    assert verdict.solved.all()
    assert all(one.claimed in (1, -1) for one in solved)
    assert all(one.trouble == "" for one in solved)


def test_no_peer_claims_what_is_out_of_reach(peer, arm):
    solved, verdict = answers(peer, peer.entries[0], arm, first_six(unreachable_targets(arm, 2)))
    assert not verdict.solved.any()
    assert not any(one.claimed == 1 for one in solved)


def test_with_restarts_hardly_a_target_within_reach_is_missed(peer, arm):
    """Twenty attempts and more: of six targets each of these solvers misses one at the most."""
    for entry in (entry for entry in peer.entries if entry.kind == RESTARTS):
        solved, verdict = answers(peer, entry, arm, uniform_targets(arm, FEW, False))
        assert verdict.solved.sum() >= FEW - 1
        assert not any(one.claimed == 1 for one, good in zip(solved, verdict.solved, strict=True)
                       if not good)  # fmt: skip


def test_the_character_is_for_those_that_take_trees(peer):
    prepare = importlib.import_module(peer.module).prepare
    if module(peer) not in TREES:
        with pytest.raises(UnableError, match="one chain of hinges"):
            prepare(robot(CHARACTER), TOLERANCE)
        return
    entry = next(entry for entry in peer.entries if entry.kind == RESTARTS)
    _, verdict = answers(peer, entry, CHARACTER, uniform_targets(CHARACTER, 2, False))
    assert verdict.solved.all()
    assert not verdict.rotation.any()


def test_ours_finds_every_target_of_every_stratum():
    entry = next(entry for entry in OURS.entries if entry.kind == RESTARTS)
    targets = robot_targets("iiwa14", 5)
    solved, verdict = answers(OURS, entry, "iiwa14", targets)
    assert verdict.solved.all()
    assert all(one.claimed == 1 for one in solved)


def test_the_registry_says_what_the_packages_say(peer):
    metadata = importlib.metadata.metadata(peer.package)
    expression = metadata.get("License-Expression", "")
    said = " ".join(
        [expression, metadata.get("License", ""), *(metadata.get_all("Classifier") or [])]
    )
    words = {"Apache-2.0": "Apache", "BSD-3-Clause": "BSD", "MIT": "MIT"}
    if "icense" in said or expression:
        assert words[peer.license] in said


def test_every_entry_has_a_name_of_its_own_within_its_kind():
    names = [(entry.kind, peer.called(entry)) for peer in PEERS for entry in peer.entries]
    assert len(set(names)) == len(names)
    assert {kind for kind, _ in names} == {ONE_START, RESTARTS}
