"""What is new takes one file and one line: a step solver, a peer, a table, an experiment."""

import importlib.metadata
import json
import subprocess
import sys
from dataclasses import replace
from functools import partial

import pytest

import plumbob.bench.experiments
from plumbob.bench.experiments import Scale, blocks, cloth, newton
from plumbob.bench.experiments import robots as robot_tables
from plumbob.bench.figures.style import COLOURS
from plumbob.bench.measure import run, timing
from plumbob.bench.measure.experiment import Experiment
from plumbob.bench.measure.record import RecordFile
from plumbob.bench.page.sections import tables
from plumbob.bench.peers import catalogue, ik, packages
from plumbob.bench.peers.peer import ONE_START
from plumbob.bench.problems.cloth_swing import cloth_swing
from plumbob.bench.tables.results import Results
from plumbob.reference import STEP_SOLVERS
from plumbob.reference.implicit_euler.local_global import LocalGlobal

TINY = Scale(targets=1, seconds=0.01)


class Damped(LocalGlobal):
    """A step solver that nobody knows yet."""


@pytest.fixture
def damped(monkeypatch):
    """The one line that makes it known to the reference."""
    monkeypatch.setitem(STEP_SOLVERS, "damped_global", Damped)


@pytest.mark.usefixtures("damped")
def test_a_new_step_solver_takes_part_in_every_suite_of_steps():
    for suite, problem in (("cloth", "cloth/x1/one step"), ("newton", "swing/k1000")):
        assert "damped_global" in [b.solver for b in blocks(suite, TINY) if b.problem == problem]
    assert "Plumbob damped global" in [peer.title for peer in catalogue.cloth_peers()]
    assert catalogue.find("Plumbob damped global").engine == catalogue.PLUMBOB


@pytest.mark.slow
@pytest.mark.usefixtures("damped")
def test_a_new_step_solver_stands_in_the_tables(make):
    name = ("cloth/x1/one step", "damped_global")
    (block,) = [b for b in blocks("cloth", TINY) if (b.problem, b.solver) == name]
    small = partial(cloth.one_step, cloth_swing(1, size=5), "damped_global", 20)
    record = run.measure(replace(block, measure=small))
    assert not record.failed
    table = cloth.convergence(Results([record]))
    assert table.rows[0][1:3] == ("damped global", record.measured["error"][1])
    certified = newton.proofs(Results([make.certified("damped_global")]))
    assert certified.rows[0][1] == "damped global"


PEER = """
from plumbob.bench.peers.peer import ONE_START, Peer, Run
from plumbob.bench.peers.protocol import SolverOutput

PEER = Peer("Stays put", __name__, "numpy", "MIT", "none", "anything", (Run(ONE_START),))

def prepare(robot, tolerance):
    return lambda request: lambda: SolverOutput(request.start, False)
"""


def test_a_new_peer_is_a_file_and_stands_in_the_tables(tmp_path, monkeypatch, in_this_process):
    (tmp_path / "stays_put.py").write_text(PEER)
    monkeypatch.setattr(ik, "__path__", [*ik.__path__, str(tmp_path)])
    peers = catalogue._peers(ik.__path__, ik.__name__)
    assert [peer.title for peer in peers if peer not in catalogue.PEERS] == ["Stays put"]
    monkeypatch.setattr(catalogue, "PEERS", peers)
    monkeypatch.setattr(timing, "worker_process", in_this_process)
    name = ("robots/character", "Stays put")
    (block,) = [b for b in blocks("ik", TINY) if (b.problem, b.solver) == name]
    record = run.measure(block)
    monkeypatch.delitem(sys.modules, f"{ik.__name__}.stays_put")
    assert not record.failed
    results = Results([record])
    (row,) = robot_tables.robot_by_robot(results).rows
    assert row[:3] == ("character", ONE_START, "Stays put")
    assert "Stays put" in [row[0] for row in robot_tables.participants(results).rows]


EXPERIMENT = """
from plumbob.bench.measure.block import Block
from plumbob.bench.measure.values import Values

class Sum(Values, frozen=True):
    sum: int

KINDS = {"": Sum}

def blocks(scale):
    yield Block("sums", "1 + 1", "Python", lambda: {"sum": 2}, facts={"title": "One"})

# What is shown.

from plumbob.bench.tables.layout import Layout
from plumbob.bench.tables.table import Column

sums = Layout(
    "What is 1 + 1?",
    "sums",
    "Sums",
    subjects=lambda results: results.all("sums"),
    columns=(
        Column("of", words=True, read=lambda record: record.title),
        Column("sum", read=lambda record: record.values.sum),
    ),
    shows="a",
    measured="b",
)

LAYOUTS = (sums,)
"""


def test_a_new_experiment_is_a_file_and_a_line(tmp_path, monkeypatch):
    (tmp_path / "sums_experiment.py").write_text(EXPERIMENT)
    monkeypatch.syspath_prepend(tmp_path)
    line = Experiment("sums_experiment", "sums", "speed")
    plumbob.bench.experiments.EXPERIMENTS.append(line)
    try:
        monkeypatch.setitem(plumbob.bench.experiments.SUITES, "sums", "is 1 + 1 two?")
        states = [event.state for event in run.run(["sums"], "quick", tmp_path / "out")]
        assert states == [run.MEASURING, run.MEASURED]
        results = Results(RecordFile(tmp_path / "out").read().records)
        (table,) = [t for t in tables(results, ["sums"]) if t.name == "sums"]
        assert table.rows == (("One", 2),)
    finally:
        plumbob.bench.experiments.EXPERIMENTS.remove(line)


def test_portfolios_and_restarts_keep_to_their_iterations():
    """Of ours the attempts are made twice at the most; who has no iterations has a time limit."""
    limits = {"portfolio": 100, "restarts": 3000}
    for peer in catalogue.PEERS:
        for entry in peer.runs:
            settings, attempts = entry.settings, entry.restarts + 1
            if "iterations" not in settings:
                continue
            attempts *= settings.get("searches", 1) * settings.get("attempts", 1)
            attempts *= 1 + 2 * settings.get("restarts", 0)
            total = settings["iterations"] * attempts
            assert total <= limits.get(entry.kind, total), (peer.title, entry)


def test_every_solver_has_one_entry_and_every_colour_is_its_own():
    names = [solver.name for solver in catalogue._solvers()]
    assert len(names) == len(set(names))
    for known in (catalogue.ik_solvers(), catalogue.step_solvers()):
        colours = [solver.colour for solver in known.values() if solver.colour]
        assert len(colours) == len(set(colours)) >= 5
    assert {solver.colour for solver in catalogue._solvers()} <= {"", *COLOURS}


class Installed:
    """A distribution that was installed from somewhere, as `direct_url.json` says."""

    def __init__(self, origin):
        self.origin = origin

    def read_text(self, _):
        return self.origin and json.dumps(self.origin)


@pytest.mark.parametrize(
    ("origin", "command"),
    [
        ({"url": "file:///a/clone", "dir_info": {"editable": True}}, "make peers"),
        ({"url": "file:///a/b", "dir_info": {"editable": True}}, "pip install -e '/a/b[peers]'"),
        ({"url": "file:///a%20b", "dir_info": {}}, "pip install '/a b[peers]'"),
        (
            {"url": "https://x.org/p.git", "vcs_info": {"vcs": "git", "commit_id": "abc"}},
            "pip install 'plumbob[peers] @ git+https://x.org/p.git'",
        ),
        (
            {"url": "file:///p.whl", "archive_info": {}},
            "pip install 'plumbob[peers] @ file:///p.whl'",
        ),
        (None, "pip install 'plumbob[peers]'"),
    ],
)
def test_the_command_that_adds_peers_fits_how_plumbob_was_installed(monkeypatch, origin, command):
    installed = [Installed(None), Installed(origin)]  # the first as in the folder of a clone
    monkeypatch.setattr("importlib.metadata.distributions", lambda **_: installed)
    monkeypatch.setattr(sys, "prefix", "/a/clone/.venv")
    packages.peers_command.cache_clear()
    try:
        assert packages.peers_command() == command
    finally:
        packages.peers_command.cache_clear()


LOADS = """
import sys
from plumbob.bench.measure import isolation
from plumbob.bench.peers import catalogue, ik, packages
from plumbob.verify import verify

print(*(name for name in sys.argv[1:] if name in sys.modules))
"""


def test_the_peers_are_known_without_an_engine():
    """Nor does a worker or `verify` import SciPy's geometry, which takes a second."""
    packages = {peer.package for peer in (*catalogue.PEERS, *catalogue.CLOTH_PEERS)} - {"plumbob"}
    owners = importlib.metadata.packages_distributions().items()
    engines = [name for name, distributions in owners if packages & set(distributions)]
    command = [
        sys.executable,
        "-c",
        LOADS,
        "mujoco",
        "pinocchio",
        "numba",
        "scipy.spatial",
        *engines,
    ]
    assert not subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
