"""Problems of inverse kinematics: closed forms, single sweeps, reachable and hostile targets.

The targets of whole solves are such that both textbook solvers reach them with iterations to
spare, so that an honest solver does; those of single sweeps such that no rotation of the sweep is
close to 0 or pi, where honest computations of it differ.
"""

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from itertools import islice
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference import curves, rotation
from plumbob.reference.arguments import FloatArray

from ..case import Case
from ..greeting import Greeting
from ..sentence import sentence
from . import skeletons
from .predictions import forward, path_to, solve
from .skeletons import Family, Make, Posed, chains, trees
from .textbook import SOLVERS, Switches

TASK = "inverse_kinematics"
# Rotations of single sweeps are at least so far from 0 and pi [rad].
LEAST_ANGLE = 0.1
# A sweep that enlarges small changes of its start by more than this tells little.
MOST_AMPLIFICATION = 30.0
# A target counts as easy if both textbook solvers reach it in so many sweeps, of how many allowed.
EASY, ALLOWED = 12, Family._field_defaults["sweeps"]
# Sweeps allowed where a solver may use up all of them.
FEW = 25
DRAWS = 1000
LOOSE = 1e-2


class Problem(NamedTuple):
    """A pose, the joint that is to move, and where to."""

    posed: Posed
    effector: int
    target: FloatArray


Draw = Callable[[np.random.Generator], Any]


def request(problem: Problem, tolerance: float, sweeps: int, method: str) -> dict[str, Any]:
    """Return the inputs of a problem."""
    return {
        **problem.posed._asdict(),
        "target": problem.target,
        "effector": problem.effector,
        "tolerance": tolerance,
        "max_iterations": sweeps,
        "method": method,
    }


def facts(inputs: Mapping[str, Any], posed: Posed) -> dict[str, Any]:
    """Return the geometry that the laws of a problem need."""
    path = path_to(inputs["parents"], inputs["effector"])
    x, _ = forward(inputs)
    lengths = np.linalg.norm(inputs["offsets"], axis=-1)[path[1:]]
    reach, longest = float(lengths.sum()), float(lengths.max(initial=0.0))
    d = float(np.linalg.norm(inputs["target"] - x[0]))
    return {
        "path": path,
        "size": posed.size,
        "reach": reach,
        "least": max(0.0, d - reach, 2.0 * longest - reach - d),
        "before": float(np.linalg.norm(x[path[-1]] - inputs["target"])),
    }


def accepted(draw: Draw, accept: Callable[[Any], bool]) -> Draw:
    """Return how to draw until a problem is accepted."""

    def problem(rng: np.random.Generator) -> Any:
        drawn = (draw(rng) for _ in range(DRAWS))
        return next(filter(accept, drawn))

    return problem


def _within_reach(make: Make, effector: int = -1) -> Draw:
    """Return how to draw a target that the effector can reach, well inside."""

    def problem(rng: np.random.Generator) -> Problem:
        posed = make(rng)
        joint = effector % len(posed.parents)
        moved = posed._replace(local_rotations=rotation.random(rng, len(posed.parents)))
        return Problem(posed, joint, forward(moved._asdict())[0][joint])

    return problem


def _sweep_of(make: Make, effector: int = -1, sweeps: int = 1) -> Draw:
    return accepted(_within_reach(make, effector), partial(is_telling, sweeps))


def _easy(make: Make, effector: int = -1, tolerance: float = 1e-4) -> Draw:
    return accepted(_within_reach(make, effector), partial(is_easy, tolerance))


def _loose(make: Make, test: int) -> Draw:
    return accepted(_within_reach(make), partial(shows_stop, test))


def is_telling(sweeps: int, problem: Problem) -> bool:
    """Return whether sweeps are well-conditioned and none of their rotations close to 0 or pi."""
    inputs = request(problem, 0.0, sweeps, "ccd")
    path = path_to(problem.posed.parents, problem.effector)
    before = problem.posed.local_rotations
    for made in range(1, sweeps + 1):
        after, _, _ = solve("ccd", inputs | {"max_iterations": made})
        angles = rotation.angle(before[path[:-1]], after[path[:-1]])
        if not ((angles > LEAST_ANGLE) & (angles < np.pi - LEAST_ANGLE)).all():
            return False
        before = after
    x, _ = forward(inputs)
    least = np.linalg.norm(x[path[:-1]] - problem.target, axis=-1).min()
    return bool(least > 0.2) and amplification(inputs) < MOST_AMPLIFICATION


def amplification(inputs: Mapping[str, Any]) -> float:
    """Return by how much sweeps of either solver enlarge small changes of the start."""
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


def is_easy(tolerance: float, problem: Problem) -> bool:
    """Return whether both textbook solvers reach the target soon."""
    inputs = request(problem, 0.5 * tolerance, EASY + 1, "")
    return all(solve(method, inputs)[2] <= EASY for method in SOLVERS)


def shows_stop(test: int, problem: Problem) -> bool:
    """Return whether both solvers reach the target, but end elsewhere with a faulty test."""
    inputs = request(problem, LOOSE, ALLOWED, "")
    for method in SOLVERS:
        _, x, made = solve(method, inputs)
        _, y, other = solve(method, inputs, Switches(test=test))
        missed = np.linalg.norm(y[problem.effector] - problem.target) > 1.5 * LOOSE
        if made > ALLOWED // 2 or other == made or (test == 3 and not missed):
            return False
        if np.abs(x - y).max() < 1e-3:
            return False
    return True


def _of_arm(target: Any, make: Make = lambda rng: skeletons.arm()) -> Draw:
    """Return a target for the lab's arm, by default straight down."""
    return lambda rng: Problem(make(rng), 4, np.array(target))


def _on_circle(rng: np.random.Generator) -> Problem:
    target = curves["circle"](150)[rng.integers(150)]
    return Problem(skeletons.moved_arm(rng), 4, target)


def _at_distance(make: Make, share: float) -> Draw:
    """Return a target in a random direction, at a share of the reach from the root."""

    def problem(rng: np.random.Generator) -> Problem:
        posed = make(rng)
        reach = float(np.linalg.norm(posed.offsets[1:], axis=-1).sum())
        direction = rotation.rotate(rotation.random(rng), [1.0, 0.0, 0.0])
        return Problem(posed, len(posed.parents) - 1, posed.offsets[0] + share * reach * direction)

    return problem


def _at_joint(joint: int, make: Make) -> Draw:
    """Return a target where a joint is."""

    def problem(rng: np.random.Generator) -> Problem:
        posed = make(rng)
        return Problem(posed, len(posed.parents) - 1, forward(posed._asdict())[0][joint])

    return problem


def _two_links(rng: np.random.Generator) -> Problem:
    """Return an elbow at a right angle: links of 3 and 4, a target at 5."""
    offsets = np.array([[0.5, -0.2, 0.3], [0.0, 3.0, 0.0], [4.0, 0.0, 0.0]])
    v = 0.4 * rng.uniform(-1.0, 1.0, (3, 3))
    posed = Posed(np.arange(-1, 2), offsets, rotation.exponential(v))
    return Problem(posed, 2, offsets[0] + np.array([5.0, 0.0, 0.0]))


def _links(*lengths: float) -> Make:
    """Return how to make a chain of links of given lengths [m]."""

    def posed(rng: np.random.Generator) -> Posed:
        drawn = skeletons.chain(rng, len(lengths) + 1)
        links = drawn.offsets[1:]
        links *= np.array(lengths)[:, None] / np.linalg.norm(links, axis=-1, keepdims=True)
        return drawn

    return posed


_ONE = sentence("A single sweep: one iteration, tolerance 0.")
_TWO = sentence("Two sweeps, tolerance 0.")
_REACHABLE = sentence("A target within reach.")
_FOLDING = _links(0.7, 0.5, 0.6, 0.8)  # can fold back to its root
# How many copies, the tolerance [m] and the sweeps allowed follow what is drawn.
FAMILIES = (
    Family("one sweep, two links", _ONE, _sweep_of(chains(3)), 2, 0.0, 1),
    Family("one sweep, three links", _ONE, _sweep_of(chains(4)), 2, 0.0, 1),
    Family("one sweep, four links", _ONE, _sweep_of(chains(5)), 2, 0.0, 1),
    Family("one sweep, arm", _ONE, _sweep_of(skeletons.moved_arm), 1, 0.0, 1),
    Family("one sweep, joint in the middle",
           sentence("A single sweep that moves a joint with others below it."),
           _sweep_of(chains(5), 3), 2, 0.0, 1),
    Family("one sweep, tree", _ONE, _sweep_of(trees(6)), 2, 0.0, 1),
    Family("two sweeps, two links", _TWO, _sweep_of(chains(3), -1, 2), 1, 0.0, 2),
    Family("two sweeps, four links", _TWO, _sweep_of(chains(5), -1, 2), 1, 0.0, 2),
    Family("one link", sentence("One link, its target on the sphere that it can reach."),
           _at_distance(chains(2), 1.0)),
    Family("two links", sentence("Links of 3 and 4, a target at 5: a right angle."), _two_links),
    Family("arm", sentence("The lab's arm, a target on its circle."),
           accepted(_on_circle, partial(is_easy, 1e-4)), 2),
    Family("arm from rest", sentence("The lab's arm, straight down, a target aside."),
           _of_arm([0.6, 0.0, 0.3])),
    Family("chain of 4", _REACHABLE, _easy(chains(4)), 2),
    Family("chain of 7", _REACHABLE, _easy(chains(7)), 2),
    Family("tree", sentence("A target within reach of a branch."), _easy(trees(8))),
    Family("joint in the middle", sentence("A target for a joint with others below it."),
           _easy(chains(6), 4)),
    Family("loose", sentence("A loose tolerance, which a solver keeps without arriving exactly."),
           _loose(chains(5), 2), 2, LOOSE),
    Family("slow approach",
           sentence("A target that is approached slowly: small steps are not arrival."),
           _loose(chains(5), 3), 1, LOOSE),
    Family("tight", sentence("A tight tolerance."), _easy(chains(5), tolerance=1e-6), 1, 1e-6),
    Family("arrived", sentence("The effector is on its target already."), _at_joint(3, chains(4))),
    Family("beyond reach", sentence("A target beyond reach."), _at_distance(chains(4), 1.5), 2,
           1e-4, FEW),
    Family("arm beyond reach", sentence("A target beyond the arm's reach."),
           _of_arm([3.0, 0.5, 2.0], skeletons.moved_arm), 1, 1e-4, FEW),
    Family("inner radius", sentence("A target nearer to the root than the longest link allows."),
           _at_distance(_links(1.5, 0.4, 0.3), 0.3 / 2.2), 1, 1e-4, FEW),
    Family("at the root", sentence("A target at the root itself."), _at_joint(0, _FOLDING), 1, 1e-3,
           FEW),
    Family("at a joint", sentence("A target where a joint is."), _at_joint(2, _FOLDING), 1, 1e-3),
    Family("collinear",
           sentence("A straight arm, its target on the same line: there is no plane to bend in."),
           _of_arm([0.0, 0.4, 0.0]), 1, 1e-4, FEW),
    Family("opposite",
           sentence("A straight arm, its target on the same line on the root's other side."),
           _of_arm([0.0, 3.1, 0.0]), 1, 1e-4, FEW),
    Family("straight beyond", sentence("A straight arm, its target farther out on the same line."),
           _of_arm([0.0, -2.0, 0.0]), 1, 1e-4, FEW),
)  # fmt: skip
# Families in which a start or a target leaves a direction undefined.
DEGENERATE = ("collinear", "opposite", "straight beyond", "at the root", "at a joint", "arrived")


def cases(greeting: Greeting, method: str, seed: int, thorough: bool) -> list[Case]:
    """Return single sweeps, then closed forms, whole solves and hostile targets."""
    drawn = skeletons.drawn(FAMILIES, seed, 5 if thorough else 1)
    problems = [
        _case(name, family, problem, greeting, method)
        for name, family, problem in drawn
        if skeletons.suits(problem.posed.parents, greeting)
    ]
    return [*problems, *_elsewhere(problems)]


def _case(name: str, family: Family, problem: Problem, greeting: Greeting, method: str) -> Case:
    tolerance = family.tolerance
    if greeting.precision == "single" and family.name == "tight":
        tolerance = 3e-5
    inputs = request(problem, tolerance, family.sweeps, method)
    facts_of_case = facts(inputs, problem.posed)
    if tolerance == 0.0:
        facts_of_case |= {"amplification": amplification(inputs), "sweeps": family.sweeps}
    return Case(name, TASK, inputs, family.name, family.about, facts=facts_of_case)


def _elsewhere(cases: list[Case]) -> Iterator[Case]:
    """Yield the first sweeps but two again in a rotated, scaled and shifted world."""
    worlds = (
        ("rotated", rotation.exponential([0.5, -0.8, 1.1]), 1.0, np.zeros(3)),
        ("in other units", rotation.identity(), 1000.0, np.zeros(3)),
        ("shifted", rotation.identity(), 1.0, np.array([2.0, -1.0, 0.5])),
    )
    swept = [case for case in islice(cases, 2, 2 + len(worlds)) if "sweeps" in case.facts]
    for case, (name, Q, scale, shift) in zip(swept, worlds, strict=False):
        posed = Posed(*(case.inputs[key] for key in Posed._fields))
        moved = skeletons.in_world(posed, Q, scale, shift)
        target = scale * rotation.rotate(Q, case.inputs["target"]) + shift
        inputs = {**case.inputs, **moved._asdict(), "target": target}
        facts_of_case = {
            **case.facts,
            **facts(inputs, moved),
            "like": case.name,
            "world": (Q, scale, shift),
        }
        about = sentence(
            "The case '{case}' in another world, {how}: the answer is the same one there.",
            case=case.name,
            how=name,
        )
        yield Case(
            f"{case.name}, {name}", TASK, inputs, "another world", about, facts=facts_of_case
        )
