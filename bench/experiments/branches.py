"""Lists of all solutions of poses of six hinges: what each solver lists, misses and makes up.

The solutions of a target come from any solver and from a search from random starts; MuJoCo's
kinematics confirms each within the limits. Solutions that differ by whole revolutions count once.
"""

import importlib
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from plumbob.reference import Target, rotation, solve_ik
from plumbob.reference.arguments import FloatArray
from plumbob.reference.formats import urdf

from ..measure.block import Block, Group, Measured, Scale
from ..measure.isolation import in_a_fresh_process
from ..measure.progress import announce
from ..measure.record import Record
from ..measure.values import Fact, Floats1, Integers1, Values
from ..peers.axes import REVOLUTION, all_within
from ..peers.catalogue import BRANCH_SOLVERS, PLUMBOB, calls_of
from ..peers.protocol import SolveFactory
from ..problems.evaluate import Targets, angle_between, evaluator_of
from ..problems.robot_targets import STRATA, robot_targets
from ..problems.robots import ROBOTS, UnableError, is_installed, robot, title

SUITE = "ik"
# The task of records.
BRANCHES = "branches"
# Arms of six have isolated solutions, to be counted.
HINGES = 6
# Targets of a stratum per target of a scale, and random starts of the search at a target.
_TARGETS, STARTS = 0.05, 128
# A solution within EXACT [m] and [rad] of the target must be listed; beyond TOLERANCE a solution is
# false. Near singular poses, solvers without a last polish stay between the two tolerances.
EXACT, TOLERANCE = 1e-9, 1e-6
# Solutions are the same within this [rad]: near singular poses an error moves angles by its root.
SAME = 1e-3
# More solutions of six joints are members of a continuum (Primrose 1986).
LARGEST_COUNT = 16
# Rounds in which calls are timed.
ROUNDS = 5
# Time limit of all solvers of a robot [s].
PATIENCE = 1800.0
# The module of a solver's adapter, and the settings of its call.
ListJob = tuple[str, Mapping[str, bool]]


class BranchValues(Values, frozen=True, kw_only=True):
    """The lists of a solver, an entry for each target with isolated solutions.

    Attributes:
        solutions: how many solutions it lists, of those that any solver or the search finds.
        missing: how many of those it does not list.
        wrong: how many of its solutions do not reach the target.
        seconds: how long a call takes, the median of all rounds [s].
        singular: how many further targets lie on a continuum of solutions.
    """

    version: Fact[str]  # of the solver
    starts: Fact[int]  # of the search
    solutions: Integers1
    missing: Integers1
    wrong: Integers1
    seconds: Floats1
    singular: int


KINDS = {BRANCHES: BranchValues}


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield every installed solver on every arm of six hinges."""
    count = max(1, round(_TARGETS * scale.targets))
    for name in filter(is_installed, ROBOTS):
        if not robot(name).is_chain or len(robot(name).joints) != HINGES:
            continue
        problem, facts = f"branches/{name}", {"task": BRANCHES, "title": title(name)}
        for solver, peer, call in calls_of(BRANCH_SOLVERS):
            settings = {"version": peer.version, "starts": STARTS, "seed": scale.seed}
            group = Group(problem, partial(compare, name, count, scale.seed), (peer.module, call))
            measure, size = group.measure_alone, count * len(STRATA)
            yield Block(SUITE, problem, solver, measure, settings, size, facts, group=group)


def compare(name: str, count: int, seed: int, jobs: Sequence[ListJob]) -> list[Measured]:
    """Compare the lists of solvers with each other and with the search."""
    announce("all solutions, every solver")
    results: Any = in_a_fresh_process(PATIENCE, lists, name, jobs, count, seed)
    return [results[i] for i in range(len(jobs))]


def lists(name: str, jobs: Sequence[ListJob], count: int, seed: int) -> dict[Any, Any]:
    """Return by job the numbers of its lists, or why the solver does not take the robot."""
    targets = robot_targets(name, count, seed)
    results: dict[int, Any] = {}
    factories: dict[int, SolveFactory] = {}
    for i, (module, call) in enumerate(jobs):
        try:
            factories[i] = importlib.import_module(module).prepare_all(robot(name), **call)
        except UnableError as error:
            results[i] = {"remark": str(error)}
    requests = [targets.request(i) for i in range(len(targets.starts))]
    solves = {m: [*map(make_solve, requests)] for m, make_solve in factories.items()}
    rows = {m: [_within(name, solve().q) for solve in solves[m]] for m in solves}
    errors = {m: [_errors(name, targets, i, q) for i, q in enumerate(rows[m])] for m in rows}
    exact = ([q[e <= EXACT] for q, e in zip(rows[m], errors[m], strict=True)] for m in rows)
    unions = list(map(_distinct, _search(name, targets), *exact))
    seconds = _seconds(solves)
    counts = np.array([*map(len, unions)])
    is_isolated = counts <= LARGEST_COUNT
    for m in rows:
        right = [q[e <= TOLERANCE] for q, e in zip(rows[m], errors[m], strict=True)]
        absent = np.array([_is_missing(u, q).sum() for u, q in zip(unions, right, strict=True)])
        wrong = np.array([(e > TOLERANCE).sum() for e in errors[m]])
        results[m] = {
            "solutions": (counts - absent)[is_isolated],
            "missing": absent[is_isolated],
            "wrong": wrong[is_isolated],
            "seconds": seconds[m][is_isolated],
            "singular": int((~is_isolated).sum()),
        }
    return results


def _within(name: str, solutions: Any) -> FloatArray:
    return all_within(robot(name), np.reshape(solutions, (-1, HINGES)))


def _errors(name: str, targets: Targets, i: int, q: FloatArray) -> FloatArray:
    """Return by how much solutions, (solution, joint), miss a target [m] or [rad], (solution,)."""
    positions, rotations = evaluator_of(name).forward(q)
    distance = np.linalg.norm(positions[:, 0] - targets.positions[i, 0], axis=-1)
    return np.maximum(distance, angle_between(rotations[:, 0], targets.rotations[i, 0]))


def _is_missing(union: FloatArray, q: FloatArray) -> np.ndarray:
    """Return which solutions of a union are not among others."""
    turns = (union[:, None] - q + 0.5 * REVOLUTION) % REVOLUTION - 0.5 * REVOLUTION
    return np.abs(turns).max(axis=-1).min(axis=1, initial=np.inf) > SAME


def _distinct(*parts: FloatArray) -> FloatArray:
    """Return the solutions of all parts, each once."""
    union = parts[0][:0]
    for row in np.concatenate(parts):
        if _is_missing(row[None], union).all():
            union = np.vstack([union, row])
    return union


def _search(name: str, targets: Targets) -> Iterator[FloatArray]:
    """Yield the solutions of each target by Levenberg-Marquardt from random starts."""
    model = urdf.parse(robot(name).text).articulation
    starts = robot(name).draw(np.random.default_rng(0), STARTS)
    limits: dict[str, Any] = {"restarts": 0, "tolerance": EXACT, "tolerance_rotation": EXACT}
    for x, R in zip(targets.positions[:, 0], targets.rotations[:, 0], strict=True):
        target = Target(x, rotation.from_matrix(R))
        ends = solve_ik(model, starts, target, "levenberg_marquardt", **limits)
        is_solved = np.maximum(ends.residual, ends.residual_rotation) <= EXACT
        yield _distinct(_within(name, ends.coordinates[is_solved]))


def _seconds(solves: Mapping[int, Sequence[Any]]) -> dict[int, FloatArray]:
    """Return how long each call takes [s], the solvers in turns, in a random order each round."""
    rng = np.random.default_rng(0)
    seconds = {m: np.empty((ROUNDS, len(solves[m]))) for m in solves}
    for i in range(ROUNDS):
        for m in rng.permutation([*solves]).tolist():
            seconds[m][i] = [solve().time.seconds for solve in solves[m]]
    return {m: np.median(times, axis=0) for m, times in seconds.items()}


# What is shown.

from ..tables.captions import Captions
from ..tables.columns import folded, of_numbers, text, words_in
from ..tables.results import grouped, listed
from ..tables.table import Column, Summary, listing, words

COLUMNS = (
    text("robot", lambda record: record.title),
    text("solver", lambda record: record.solver),
    Column("solutions", best="greatest", read=of_numbers(lambda lists: lists.solutions.sum())),
    Column("missing", best="least", read=of_numbers(lambda lists: lists.missing.sum())),
    Column("false", best="least", read=of_numbers(lambda lists: lists.wrong.sum())),
    Column("time, median", "µs", best="least", read=of_numbers(lambda r: np.median(r.seconds))),
    text("remark", lambda record: record.values.remark),
    *folded(
        Column("targets", read=of_numbers(lambda lists: len(lists.solutions))),
        Column("targets with missing solutions", read=of_numbers(lambda r: (r.missing > 0).sum())),
        Column("singular targets", read=of_numbers(lambda lists: lists.singular)),
    ),
)


def _summary(records: Sequence[Record]) -> Summary:
    measured = grouped((r for r in records if r.has_numbers), lambda record: record.solver)
    points = (
        f"{solver}: {words(_total(members, 'missing'))} missing, "
        f"{words(_total(members, 'wrong'))} false; {listed([*map(_time, members)])}"
        for solver, members in measured.items()
    )
    own_records = measured.get(PLUMBOB, [])
    solutions, missing = (_total(own_records, name) for name in ("solutions", "missing"))
    sentence = f"Plumbob lists {words(solutions)} of {words(solutions + missing)} solutions."
    return listing(sentence * bool(own_records), points)


def _total(records: Sequence[Record], name: str) -> int:
    return sum(int(getattr(record.values, name).sum()) for record in records)


def _time(record: Record) -> str:
    return f"{record.title} {words_in(float(np.median(record.values.seconds)), 'µs')}"


_CAPTIONS = Captions(
    __file__,
    starts=words(STARTS),
    exact=words(EXACT),
    tolerance=words(TOLERANCE),
    same=words(SAME),
    largest=words(LARGEST_COUNT),
)

branches = _CAPTIONS.layout(
    "branches", lambda results: results.all(SUITE, task=BRANCHES), _summary, columns=COLUMNS
)

LAYOUTS = (branches,)
