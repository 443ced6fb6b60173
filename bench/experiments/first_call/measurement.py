"""The first call of each public function: with nothing compiled yet, and with all of it on disk.

Each is measured in two fresh processes, the first with an empty folder for compiled kernels and
the second with what the first has left there.
"""

import os
import tempfile
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np

from plumbob import reference
from plumbob.reference import IK_SOLVERS, STEP_SOLVERS, Articulation, Target, scenes
from plumbob.reference.backend.compilation import on_compile
from plumbob.reference.jacobians import jacobian

from ...harness.block import Block, Measured, Scale
from ...harness.isolation import in_a_fresh_process
from ...harness.stopwatch import timed_twice

Call = Callable[[], Any]

H = 1 / 60
# Calls without a choice of solver stand under this name.
OURS = "Plumbob"
# A short bench measures these; from so many seconds a benchmark on, all are measured.
QUICK = (
    ("forward_kinematics/skeleton", OURS),
    ("solve_ik/chain", "fabrik"),
    ("solve_ik/robot", "levenberg_marquardt"),
)
ALL_FROM = 1.0
# A process that compiles says nothing for so long [s].
PATIENCE = 600.0


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield a block for every public function and solver."""
    for name, solver in calls() if scale.seconds >= ALL_FROM else QUICK:
        facts = {"title": name.replace("/", ", ")}
        yield Block("first_call", name, solver, partial(cold_and_warm, name, solver), facts=facts)


def calls() -> list[tuple[str, str]]:
    """Return all calls that can be measured, with their solvers."""
    return [(name, solver) for name, (solvers, _) in CALLS.items() for solver in solvers]


def cold_and_warm(name: str, solver: str) -> Measured:
    """Measure a call in a process that has to compile, and in the next one."""
    with tempfile.TemporaryDirectory() as folder:
        runs = {when: in_a_process(name, solver, folder) for when in ("cold", "warm")}
    return Measured({f"{when} {k}": v for when, run in runs.items() for k, v in run.items()})


def in_a_process(name: str, solver: str, folder: str) -> Mapping[str, Any]:
    """Measure a call in a process of its own, with compiled kernels kept in a folder."""
    return in_a_fresh_process(PATIENCE, measure_with_cache, os.fspath(folder), name, solver)


def measure_with_cache(folder: str, name: str, solver: str) -> dict[str, Any]:
    """Measure a call in a process that has not compiled yet: its settings are read only then."""
    os.environ["NUMBA_CACHE_DIR"] = folder
    return measure(name, solver)


def measure(name: str, solver: str) -> dict[str, Any]:
    """Return the time on the wall and of the processor [s], and how many kernels were compiled."""
    compiled: list[str] = []
    call = CALLS[name][1](solver)
    with on_compile(lambda label, begins: compiled.append(label) if begins else None):
        _, wall, processor = timed_twice(call)
    return {"wall": wall, "processor": processor, "compiled": len(compiled)}


def robot() -> tuple[Articulation, np.ndarray]:
    """Return an arm of seven hinges, and where it starts."""
    offsets = np.zeros((7, 3))
    offsets[:, 0], offsets[:, 2] = [0, 0, 0, 0.1, -0.1, 0, 0.1], [0.3, 0, 0.3, 0, 0.4, 0, 0]
    skeleton = reference.Skeleton(range(-1, 6), offsets)
    axes = [[0, 0, 1], [0, 1, 0], [0, 0, 1], [0, -1, 0], [0, 0, 1], [0, -1, 0], [0, 0, -1]]
    arm = Articulation(skeleton, "hinge", axes=axes, lower=-2.5, upper=2.5)
    return arm, np.full(arm.coordinate_count, 0.3)


def on_the_robot(solver: str) -> Call:
    """Reach for a position and a rotation."""
    target = Target([0.4, 0.1, 0.5], [0.0, 1.0, 0.0, 0.0])
    return partial(reference.solve_ik, *robot(), target, solver)


def on_the_chain(solver: str) -> Call:
    """Reach for a position."""
    return partial(reference.solve_ik, *scenes.ball_chain(), [0.3, 0.4, 0.2], solver)


def along_a_curve(solver: str) -> Call:
    """Follow a circle."""
    circle = 0.5 + 0.2 * reference.curves["circle"](20)
    return partial(reference.track, scenes.ball_chain()[0], circle, solver)


def posed(solver: str, count: int = 0) -> Call:
    """Pose a skeleton, or many."""
    skeleton, local = scenes.ball_chain()
    poses = np.tile(local, (count, 1, 1)) if count else local
    return partial(reference.forward_kinematics, skeleton, poses)


def posed_robot(solver: str) -> Call:
    """Pose a robot."""
    return partial(reference.forward_kinematics, *robot())


def derived(solver: str) -> Call:
    """Derive a robot's pose."""
    return partial(jacobian, *robot())


def evened(solver: str) -> Call:
    """Resample a curve."""
    points = reference.curves["heart"](100)
    return partial(reference.resample, points, min_spacing=0.01, max_spacing=0.02)


def stepped(solver: str) -> Call:
    """Make an integrator and step a cloth by it."""
    system, state = scenes.lab_cloth()
    return lambda: reference.ImplicitEuler(system, h=H, solver=solver).step(state)


def stepped_explicitly(solver: str) -> Call:
    """Step a cloth explicitly."""
    return partial(reference.symplectic_euler, *scenes.lab_cloth(), h=H)


# Public function and what it works on: its solvers, and what makes the call.
CALLS: dict[str, tuple[tuple[str, ...], Callable[[str], Call]]] = {
    "forward_kinematics/skeleton": ((OURS,), posed),
    "forward_kinematics/batch": ((OURS,), partial(posed, count=100)),
    "forward_kinematics/robot": ((OURS,), posed_robot),
    "jacobian/robot": ((OURS,), derived),
    "solve_ik/chain": (tuple(IK_SOLVERS), on_the_chain),
    "solve_ik/robot": (tuple(IK_SOLVERS), on_the_robot),
    "track/chain": (("fabrik",), along_a_curve),
    "resample": ((OURS,), evened),
    "ImplicitEuler(...).step/cloth": (tuple(STEP_SOLVERS), stepped),
    "symplectic_euler/cloth": ((OURS,), stepped_explicitly),
}
