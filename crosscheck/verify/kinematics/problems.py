"""Problems of inverse kinematics: closed forms, single sweeps, reachable and hostile targets.

Both textbook solvers reach the targets of whole solves well within the sweeps allowed, so that an
honest solver does. No rotation of a single sweep is close to 0 or pi, where honest computations of
it differ.
"""

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference import curves, rotation
from plumbob.reference.arguments import FloatArray

from ..case import Case
from ..greeting import Greeting
from ..sentence import sentence
from . import skeletons
from .predictions import forward, path_to, solve
from .skeletons import CaseFamily, DrawSkeleton, PosedSkeleton, chains, trees
from .textbook import SOLVERS, Switches

TASK = "inverse_kinematics"
# The rotations of single sweeps are at least so far from 0 and pi [rad].
MIN_ANGLE = 0.1
# Sweeps that enlarge small changes of their start by more than this tell little.
MAX_AMPLIFICATION = 30.0
# A target counts as easy if both textbook solvers reach it in EASY sweeps; ALLOWED are allowed.
EASY, ALLOWED = 12, CaseFamily._field_defaults["sweeps"]
# Sweeps allowed where a solver may use up all of them.
FEW = 25
DRAWS = 1000
LOOSE = 1e-2


class TargetProblem(NamedTuple):
    """A skeleton, the joint that is to reach a target, and the target."""

    skeleton: PosedSkeleton
    effector: int
    target: FloatArray


Draw = Callable[[np.random.Generator], Any]


def request(problem: TargetProblem, tolerance: float, sweeps: int, method: str) -> dict[str, Any]:
    """Return the inputs of a problem."""
    return {
        **problem.skeleton._asdict(),
        "target": problem.target,
        "effector": problem.effector,
        "tolerance": tolerance,
        "max_iterations": sweeps,
        "method": method,
    }


def facts(inputs: Mapping[str, Any]) -> dict[str, Any]:
    """Return the geometry that the laws of a problem need."""
    path = path_to(inputs["parents"], inputs["effector"])
    x, _ = forward(inputs)
    lengths = np.linalg.norm(inputs["offsets"], axis=-1)[path[1:]]
    reach, longest = float(lengths.sum()), float(lengths.max(initial=0.0))
    d = float(np.linalg.norm(inputs["target"] - x[0]))
    return {
        "path": path,
        "size": skeletons.extent(inputs["offsets"]),
        "reach": reach,
        "least": max(0.0, d - reach, 2.0 * longest - reach - d),
        "before": float(np.linalg.norm(x[path[-1]] - inputs["target"])),
    }


def accepted(draw: Draw, accept: Callable[[Any], bool]) -> Draw:
    """Return a function that draws until a problem is accepted."""
    return lambda rng: next(filter(accept, (draw(rng) for _ in range(DRAWS))))


def _within_reach(
    accept: Callable[[TargetProblem], bool], make: DrawSkeleton, effector: int = -1
) -> Draw:
    """Return a function that draws accepted targets well within reach."""

    def problem(rng: np.random.Generator) -> TargetProblem:
        skeleton = make(rng)
        joint = effector % len(skeleton.parents)
        moved = skeleton._replace(local_rotations=rotation.random(rng, len(skeleton.parents)))
        return TargetProblem(skeleton, joint, forward(moved._asdict())[0][joint])

    return accepted(problem, accept)


def _sweep_of(make: DrawSkeleton, effector: int = -1, sweeps: int = 1) -> Draw:
    return _within_reach(partial(is_telling, sweeps), make, effector)


def _easy(make: DrawSkeleton, effector: int = -1, tolerance: float = 1e-4) -> Draw:
    return _within_reach(partial(is_easy, tolerance), make, effector)


def is_telling(sweeps: int, problem: TargetProblem) -> bool:
    """Return whether sweeps are well-conditioned and none of their rotations close to 0 or pi."""
    inputs = request(problem, 0.0, sweeps, "ccd")
    links = path_to(problem.skeleton.parents, problem.effector)[:-1]
    before = problem.skeleton.local_rotations
    for count in range(1, sweeps + 1):
        after, _, _ = solve("ccd", inputs | {"max_iterations": count})
        angles = rotation.angle(before[links], after[links])
        if not ((angles > MIN_ANGLE) & (angles < np.pi - MIN_ANGLE)).all():
            return False
        before = after
    x, _ = forward(inputs)
    nearest = np.linalg.norm(x[links] - problem.target, axis=-1).min()
    return bool(nearest > 0.2) and amplification(inputs) < MAX_AMPLIFICATION


def amplification(inputs: Mapping[str, Any]) -> float:
    """Return the factor by which sweeps of either solver enlarge small changes of the start."""
    rng, step, worst = np.random.default_rng(0), 1e-7, 0.0
    local, target = inputs["local_rotations"], inputs["target"]
    for method in SOLVERS:
        _, x, _ = solve(method, inputs)
        for _ in range(3):
            v = step * rng.standard_normal((len(local), 3))
            changed = {
                "local_rotations": rotation.multiply(rotation.exponential(v), local),
                "target": target + step * rng.standard_normal(3),
            }
            _, moved, _ = solve(method, {**inputs, **changed})
            worst = max(worst, float(np.abs(moved - x).max()) / step)
    return worst


def is_easy(tolerance: float, problem: TargetProblem) -> bool:
    """Return whether both textbook solvers reach the target soon."""
    inputs = request(problem, 0.5 * tolerance, EASY + 1, "")
    return all(solve(method, inputs)[2] <= EASY for method in SOLVERS)


def shows_stop(test: int, problem: TargetProblem) -> bool:
    """Return whether both solvers reach the target, but end elsewhere with a faulty test."""
    inputs = request(problem, LOOSE, ALLOWED, "")
    for method in SOLVERS:
        _, x, sweeps = solve(method, inputs)
        _, y, faulty_sweeps = solve(method, inputs, Switches(test=test))
        missed = np.linalg.norm(y[problem.effector] - problem.target) > 1.5 * LOOSE
        if sweeps > ALLOWED // 2 or faulty_sweeps == sweeps or (test == 3 and not missed):
            return False
        if np.abs(x - y).max() < 1e-3:
            return False
    return True


def _of_arm(target: Any, make: DrawSkeleton = lambda rng: skeletons.arm()) -> Draw:
    """Return a function that gives the lab's arm, by default straight down, a target."""
    return lambda rng: TargetProblem(make(rng), 4, np.array(target))


def _on_circle(rng: np.random.Generator) -> TargetProblem:
    target = curves["circle"](150)[rng.integers(150)]
    return TargetProblem(skeletons.moved_arm(rng), 4, target)


def _at_distance(make: DrawSkeleton, share: float) -> Draw:
    """Return a function that draws a target at a share of the reach from the root."""

    def problem(rng: np.random.Generator) -> TargetProblem:
        skeleton = make(rng)
        offsets = skeleton.offsets
        reach = float(np.linalg.norm(offsets[1:], axis=-1).sum())
        direction = rotation.rotate(rotation.random(rng), [1.0, 0.0, 0.0])
        return TargetProblem(skeleton, len(offsets) - 1, offsets[0] + share * reach * direction)

    return problem


def _at_joint(joint: int, make: DrawSkeleton) -> Draw:
    """Return a function that draws a target at the position of a joint."""

    def problem(rng: np.random.Generator) -> TargetProblem:
        skeleton = make(rng)
        x, _ = forward(skeleton._asdict())
        return TargetProblem(skeleton, len(x) - 1, x[joint])

    return problem


def _two_links(rng: np.random.Generator) -> TargetProblem:
    """Return an elbow at a right angle: links of 3 and 4, a target at 5."""
    offsets = np.array([[0.5, -0.2, 0.3], [0.0, 3.0, 0.0], [4.0, 0.0, 0.0]])
    v = 0.4 * rng.uniform(-1.0, 1.0, (3, 3))
    skeleton = PosedSkeleton(np.arange(-1, 2), offsets, rotation.exponential(v))
    return TargetProblem(skeleton, 2, offsets[0] + np.array([5.0, 0.0, 0.0]))


def _links(*lengths: float) -> DrawSkeleton:
    """Return a function that draws chains of links of given lengths [m]."""

    def chain(rng: np.random.Generator) -> PosedSkeleton:
        drawn = skeletons.chain(rng, len(lengths) + 1)
        links = drawn.offsets[1:]
        links *= np.array(lengths)[:, None] / np.linalg.norm(links, axis=-1, keepdims=True)
        return drawn

    return chain


_ONE_SWEEP = sentence("A single sweep: one iteration, tolerance 0.")
_TWO_SWEEPS = sentence("Two sweeps, tolerance 0.")
_REACHABLE = sentence("A target within reach.")
_FOLDING = _links(0.7, 0.5, 0.6, 0.8)  # can fold back to its root
# The number of copies, the tolerance [m] and the sweeps allowed follow the drawing function.
FAMILIES = (
    CaseFamily("one sweep, two links", _ONE_SWEEP, _sweep_of(chains(3)), 2, 0.0, 1),
    CaseFamily("one sweep, three links", _ONE_SWEEP, _sweep_of(chains(4)), 2, 0.0, 1),
    CaseFamily("one sweep, four links", _ONE_SWEEP, _sweep_of(chains(5)), 2, 0.0, 1),
    CaseFamily("one sweep, arm", _ONE_SWEEP, _sweep_of(skeletons.moved_arm), 1, 0.0, 1),
    CaseFamily("one sweep, joint in the middle",
        sentence("A single sweep that moves a joint with others below it."),
        _sweep_of(chains(5), 3), 2, 0.0, 1),
    CaseFamily("one sweep, tree", _ONE_SWEEP, _sweep_of(trees(6)), 2, 0.0, 1),
    CaseFamily("two sweeps, two links", _TWO_SWEEPS, _sweep_of(chains(3), -1, 2), 1, 0.0, 2),
    CaseFamily("two sweeps, four links", _TWO_SWEEPS, _sweep_of(chains(5), -1, 2), 1, 0.0, 2),
    CaseFamily("one link", sentence("One link, its target on the sphere that it can reach."),
        _at_distance(chains(2), 1.0)),
    CaseFamily("two links",
        sentence("Links of 3 and 4, a target at 5: a right angle."), _two_links),
    CaseFamily("arm", sentence("The lab's arm, a target on its circle."),
        accepted(_on_circle, partial(is_easy, 1e-4)), 2),
    CaseFamily("arm from rest", sentence("The lab's arm, straight down, a target aside."),
        _of_arm([0.6, 0.0, 0.3])),
    CaseFamily("chain of 4", _REACHABLE, _easy(chains(4)), 2),
    CaseFamily("chain of 7", _REACHABLE, _easy(chains(7)), 2),
    CaseFamily("tree", sentence("A target within reach of a branch."), _easy(trees(8))),
    CaseFamily("joint in the middle", sentence("A target for a joint with others below it."),
        _easy(chains(6), 4)),
    CaseFamily("loose",
        sentence("A loose tolerance, which a solver keeps without arriving exactly."),
        _within_reach(partial(shows_stop, 2), chains(5)), 2, LOOSE),
    CaseFamily("slow approach",
        sentence("A target that is approached slowly: small steps are not arrival."),
        _within_reach(partial(shows_stop, 3), chains(5)), 1, LOOSE),
    CaseFamily("tight", sentence("A tight tolerance."), _easy(chains(5), tolerance=1e-6), 1, 1e-6),
    CaseFamily("arrived",
        sentence("The effector is on its target already."), _at_joint(3, chains(4))),
    CaseFamily("beyond reach", sentence("A target beyond reach."), _at_distance(chains(4), 1.5), 2,
        1e-4, FEW),
    CaseFamily("arm beyond reach", sentence("A target beyond the arm's reach."),
        _of_arm([3.0, 0.5, 2.0], skeletons.moved_arm), 1, 1e-4, FEW),
    CaseFamily("inner radius",
        sentence("A target nearer to the root than the longest link allows."),
        _at_distance(_links(1.5, 0.4, 0.3), 0.3 / 2.2), 1, 1e-4, FEW),
    CaseFamily("at the root", sentence("A target at the root itself."),
        _at_joint(0, _FOLDING), 1, 1e-3, FEW),
    CaseFamily("at a joint",
        sentence("A target where a joint is."), _at_joint(2, _FOLDING), 1, 1e-3),
    CaseFamily("collinear",
        sentence("A straight arm, its target on the same line: there is no plane to bend in."),
        _of_arm([0.0, 0.4, 0.0]), 1, 1e-4, FEW),
    CaseFamily("opposite",
        sentence("A straight arm, its target on the same line on the root's other side."),
        _of_arm([0.0, 3.1, 0.0]), 1, 1e-4, FEW),
    CaseFamily("straight beyond",
        sentence("A straight arm, its target farther out on the same line."),
        _of_arm([0.0, -2.0, 0.0]), 1, 1e-4, FEW),
)  # fmt: skip
# Families in which a start or a target leaves a direction undefined.
DEGENERATE = ("collinear", "opposite", "straight beyond", "at the root", "at a joint", "arrived")


def cases(greeting: Greeting, method: str, seed: int, thorough: bool) -> list[Case]:
    """Return single sweeps, then closed forms, whole solves and hostile targets."""
    problems = [
        _case(name, family, problem, greeting, method)
        for name, family, problem in skeletons.drawn(FAMILIES, seed, 5 if thorough else 1)
        if skeletons.suits(problem.skeleton.parents, greeting)
    ]
    return [*problems, *_transformed(problems)]


def _case(
    name: str, family: CaseFamily, problem: TargetProblem, greeting: Greeting, method: str
) -> Case:
    tolerance = family.tolerance
    if greeting.precision == "single" and family.name == "tight":
        tolerance = 3e-5
    inputs = request(problem, tolerance, family.sweeps, method)
    geometry = facts(inputs)
    if tolerance == 0.0:
        geometry |= {"amplification": amplification(inputs), "sweeps": family.sweeps}
    return Case(name, TASK, inputs, family.name, family.about, facts=geometry)


def _transformed(cases: list[Case]) -> Iterator[Case]:
    """Yield three of the first sweeps again in a rotated, scaled and shifted world."""
    worlds = (
        ("rotated", rotation.exponential([0.5, -0.8, 1.1]), 1.0, np.zeros(3)),
        ("in other units", rotation.identity(), 1000.0, np.zeros(3)),
        ("shifted", rotation.identity(), 1.0, np.array([2.0, -1.0, 0.5])),
    )
    swept = [case for case in cases[2 : 2 + len(worlds)] if "sweeps" in case.facts]
    for case, (name, Q, scale, shift) in zip(swept, worlds, strict=False):
        inputs = dict(case.inputs)
        offsets, local = scale * inputs["offsets"], inputs["local_rotations"].copy()
        offsets[0] = scale * rotation.rotate(Q, inputs["offsets"][0]) + shift
        local[0] = rotation.multiply(Q, local[0])
        target = scale * rotation.rotate(Q, inputs["target"]) + shift
        inputs |= {"offsets": offsets, "local_rotations": local, "target": target}
        world = {"like": case.name, "world": (Q, scale, shift)}
        about = sentence(
            "The case '{case}' in another world, {how}: the answer is the same one there.",
            case=case.name,
            how=name,
        )
        yield Case(
            f"{case.name}, {name}", TASK, inputs, "another world", about,
            facts={**case.facts, **facts(inputs), **world},
        )  # fmt: skip
