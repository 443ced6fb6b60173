"""Problems of inverse kinematics: closed forms, single sweeps, reachable and hostile targets.

The targets of whole solves are such that both textbook solvers reach them with iterations to
spare, so that an honest solver does; those of single sweeps such that no rotation of the sweep is
close to 0 or pi, where honest computations of it differ.
"""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference import curves, rotation
from plumbob.reference.arguments import FloatArray

from ..case import Case
from ..greeting import Greeting
from ..sentence import Sentence, sentence
from . import skeletons
from .faults import Switches
from .predictions import forward, path_to, solve
from .skeletons import Posed
from .textbook import Stop

TASK = "inverse_kinematics"
# Rotations of single sweeps are at least so far from 0 and pi [rad].
LEAST_ANGLE = 0.1
# A sweep that enlarges small changes of its start by more than this tells little.
MOST_AMPLIFICATION = 30.0
# A target counts as easy if both textbook solvers reach it in so many sweeps, of how many allowed.
EASY, ALLOWED = 12, 60
# Sweeps allowed where a solver may use up all of them.
FEW = 25
DRAWS = 1000
LOOSE = 1e-2


class Problem(NamedTuple):
    """A pose, the joint that is to move, and where to."""

    posed: Posed
    effector: int
    target: FloatArray


class Family(NamedTuple):
    """Problems of a kind: what they try, how one is made, and what is asked for."""

    name: str
    about: Sentence
    make: Callable[[np.random.Generator], Problem]
    copies: int = 1
    tolerance: float = 1e-4
    sweeps: int = ALLOWED


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
        "start": x,
    }


def point_at(problem: Problem, distance: float, rng: np.random.Generator) -> FloatArray:
    """Return a point at a distance from the root, in a random direction."""
    direction = rotation.rotate(rotation.random(rng), [1.0, 0.0, 0.0])
    return problem.posed.offsets[0] + distance * direction


def anywhere(posed: Posed, effector: int, rng: np.random.Generator) -> Problem:
    """Return a target that the effector can reach, well inside."""
    moved = posed._replace(local_rotations=rotation.random(rng, len(posed.parents)))
    target = forward(moved._asdict())[0][effector]
    return Problem(posed, effector, target)


def _sweep_of(
    make: Callable[[np.random.Generator], Posed], effector: int = -1, sweeps: int = 1
) -> Any:
    def problem(rng: np.random.Generator) -> Problem:
        for _ in range(DRAWS):
            posed = make(rng)
            found = anywhere(posed, effector % len(posed.parents), rng)
            if is_telling(found, sweeps):
                return found
        raise AssertionError("no telling problem found")

    return problem


def is_telling(problem: Problem, sweeps: int) -> bool:
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
    away = np.linalg.norm(x[path[:-1]] - problem.target, axis=-1).min()
    return bool(away > 0.2) and amplification(inputs) < MOST_AMPLIFICATION


def amplification(inputs: Mapping[str, Any]) -> float:
    """Return by how much sweeps of either solver enlarge small changes of the start."""
    rng, step, worst = np.random.default_rng(0), 1e-7, 0.0
    local, target = inputs["local_rotations"], inputs["target"]
    for method in ("ccd", "fabrik"):
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


def _easy(
    make: Callable[[np.random.Generator], Posed], effector: int = -1, tolerance: float = 1e-4
) -> Any:
    return _drawn(make, effector, lambda found: is_easy(found, tolerance))


def _drawn(
    make: Callable[[np.random.Generator], Posed],
    effector: int,
    accept: Callable[[Problem], bool],
) -> Any:
    def problem(rng: np.random.Generator) -> Problem:
        for _ in range(DRAWS):
            posed = make(rng)
            found = anywhere(posed, effector % len(posed.parents), rng)
            if accept(found):
                return found
        raise AssertionError("no such problem found")

    return problem


def is_easy(problem: Problem, tolerance: float) -> bool:
    """Return whether both textbook solvers reach the target soon."""
    inputs = request(problem, 0.5 * tolerance, EASY + 1, "")
    return all(solve(method, inputs)[2] <= EASY for method in ("ccd", "fabrik"))


def shows_stop(problem: Problem, tolerance: float, stop: Stop) -> bool:
    """Return whether both solvers reach the target, but end elsewhere with a faulty test."""
    inputs = request(problem, tolerance, ALLOWED, "")
    for method in ("ccd", "fabrik"):
        _, x, made = solve(method, inputs)
        _, y, other = solve(method, inputs, Switches(stop=stop))
        moved = float(np.abs(x - y).max())
        missed = np.linalg.norm(y[problem.effector] - problem.target) > 1.5 * tolerance
        if made > ALLOWED // 2 or other == made or (stop.test == 3 and not missed):
            return False
        if moved < 1e-3:
            return False
    return True


def _on_circle(rng: np.random.Generator) -> Problem:
    for _ in range(DRAWS):
        target = curves["circle"](150)[rng.integers(150)]
        found = Problem(skeletons.moved_arm(rng), 4, target)
        if is_easy(found, 1e-4):
            return found
    raise AssertionError("no easy problem found")


def _from_rest(rng: np.random.Generator) -> Problem:
    return Problem(skeletons.arm(), 4, np.array([0.6, 0.0, 0.3]))


def _one_link(rng: np.random.Generator) -> Problem:
    problem = Problem(skeletons.chain(rng, 2), 1, np.zeros(3))
    length = float(np.linalg.norm(problem.posed.offsets[1]))
    return problem._replace(target=point_at(problem, length, rng))


def _two_links(rng: np.random.Generator) -> Problem:
    """Return an elbow at a right angle: links of 3 and 4, a target at 5."""
    offsets = np.array([[0.5, -0.2, 0.3], [0.0, 3.0, 0.0], [4.0, 0.0, 0.0]])
    v = 0.4 * rng.uniform(-1.0, 1.0, (3, 3))
    posed = Posed(np.arange(-1, 2), offsets, rotation.exponential(v))
    return Problem(posed, 2, offsets[0] + np.array([5.0, 0.0, 0.0]))


def _beyond(rng: np.random.Generator) -> Problem:
    problem = Problem(skeletons.chain(rng, 4), 3, np.zeros(3))
    reach = float(np.linalg.norm(problem.posed.offsets[1:], axis=-1).sum())
    return problem._replace(target=point_at(problem, 1.5 * reach, rng))


def _arm_beyond(rng: np.random.Generator) -> Problem:
    return Problem(skeletons.moved_arm(rng), 4, np.array([3.0, 0.5, 2.0]))


def _inside(rng: np.random.Generator) -> Problem:
    posed = skeletons.chain(rng, 4)
    lengths = np.array([[1.5], [0.4], [0.3]])
    posed.offsets[1:] *= lengths / np.linalg.norm(posed.offsets[1:], axis=-1, keepdims=True)
    problem = Problem(posed, 3, np.zeros(3))
    return problem._replace(target=point_at(problem, 0.3, rng))


def _collinear(rng: np.random.Generator) -> Problem:
    return Problem(skeletons.arm(), 4, np.array([0.0, 0.4, 0.0]))


def _backwards(rng: np.random.Generator) -> Problem:
    return Problem(skeletons.arm(), 4, np.array([0.0, 3.1, 0.0]))


def _straight_beyond(rng: np.random.Generator) -> Problem:
    return Problem(skeletons.arm(), 4, np.array([0.0, -2.0, 0.0]))


def _folding(rng: np.random.Generator) -> Posed:
    """Return a chain that can fold back to its root."""
    posed = skeletons.chain(rng, 5)
    lengths = np.array([[0.7], [0.5], [0.6], [0.8]])
    posed.offsets[1:] *= lengths / np.linalg.norm(posed.offsets[1:], axis=-1, keepdims=True)
    return posed


def _at_root(rng: np.random.Generator) -> Problem:
    posed = _folding(rng)
    return Problem(posed, 4, posed.offsets[0].copy())


def _at_joint(rng: np.random.Generator) -> Problem:
    posed = _folding(rng)
    return Problem(posed, 4, forward(posed._asdict())[0][2])


def _arrived(rng: np.random.Generator) -> Problem:
    posed = skeletons.chain(rng, 4)
    return Problem(posed, 3, forward(posed._asdict())[0][3])


def _trees(joints: int) -> Callable[[np.random.Generator], Posed]:
    return lambda rng: skeletons.tree(rng, joints)


def _chains(joints: int) -> Callable[[np.random.Generator], Posed]:
    return lambda rng: skeletons.chain(rng, joints)


_ONE = sentence("A single sweep: one iteration, tolerance 0.")
_TWO = sentence("Two sweeps, tolerance 0.")
FAMILIES = (
    Family("one sweep, two links", _ONE, _sweep_of(_chains(3)), 2, 0.0, 1),
    Family("one sweep, three links", _ONE, _sweep_of(_chains(4)), 2, 0.0, 1),
    Family("one sweep, four links", _ONE, _sweep_of(_chains(5)), 2, 0.0, 1),
    Family("one sweep, arm", _ONE, _sweep_of(skeletons.moved_arm), 1, 0.0, 1),
    Family(
        "one sweep, joint in the middle",
        sentence("A single sweep that moves a joint with others below it."),
        _sweep_of(_chains(5), 3), 2, 0.0, 1,
    ),
    Family("one sweep, tree", _ONE, _sweep_of(_trees(6)), 2, 0.0, 1),
    Family("two sweeps, two links", _TWO, _sweep_of(_chains(3), -1, 2), 1, 0.0, 2),
    Family("two sweeps, four links", _TWO, _sweep_of(_chains(5), -1, 2), 1, 0.0, 2),
    Family(
        "one link",
        sentence("One link, its target on the sphere that it can reach."),
        _one_link,
    ),
    Family("two links", sentence("Links of 3 and 4, a target at 5: a right angle."), _two_links),
    Family("arm", sentence("The lab's arm, a target on its circle."), _on_circle, 2),
    Family(
        "arm from rest", sentence("The lab's arm, straight down, a target aside."), _from_rest
    ),
    Family("chain of 4", sentence("A target within reach."), _easy(_chains(4)), 2),
    Family("chain of 7", sentence("A target within reach."), _easy(_chains(7)), 2),
    Family("tree", sentence("A target within reach of a branch."), _easy(_trees(8)), 1),
    Family(
        "joint in the middle",
        sentence("A target for a joint with others below it."),
        _easy(_chains(6), 4),
    ),
    Family(
        "loose",
        sentence("A loose tolerance, which a solver keeps without arriving exactly."),
        _drawn(_chains(5), -1, lambda found: shows_stop(found, LOOSE, Stop(test=2))), 2, LOOSE,
    ),
    Family(
        "slow approach",
        sentence("A target that is approached slowly: small steps are not arrival."),
        _drawn(_chains(5), -1, lambda found: shows_stop(found, LOOSE, Stop(test=3))), 1, LOOSE,
    ),
    Family(
        "tight",
        sentence("A tight tolerance."),
        _easy(_chains(5), tolerance=1e-6), 1, 1e-6,
    ),
    Family("arrived", sentence("The effector is on its target already."), _arrived),
    Family("beyond reach", sentence("A target beyond reach."), _beyond, 2, 1e-4, FEW),
    Family("arm beyond reach", sentence("A target beyond the arm's reach."), _arm_beyond, 1,
           1e-4, FEW),
    Family(
        "inner radius",
        sentence("A target nearer to the root than the longest link allows."),
        _inside, 1, 1e-4, FEW,
    ),
    Family(
        "at the root", sentence("A target at the root itself."), _at_root, 1, 1e-3, FEW
    ),
    Family("at a joint", sentence("A target where a joint is."), _at_joint, 1, 1e-3),
    Family(
        "collinear",
        sentence("A straight arm, its target on the same line: there is no plane to bend in."),
        _collinear, 1, 1e-4, FEW,
    ),
    Family(
        "opposite",
        sentence("A straight arm, its target on the same line on the root's other side."),
        _backwards, 1, 1e-4, FEW,
    ),
    Family(
        "straight beyond",
        sentence("A straight arm, its target farther out on the same line."),
        _straight_beyond, 1, 1e-4, FEW,
    ),
)  # fmt: skip
# Families in which a start or a target leaves a direction undefined.
DEGENERATE = ("collinear", "opposite", "straight beyond", "at the root", "at a joint", "arrived")


def cases(greeting: Greeting, method: str, seed: int, thorough: bool) -> list[Case]:
    """Return single sweeps, then closed forms, whole solves and hostile targets."""
    found = []
    for family in FAMILIES:
        for i in range(family.copies * (5 if thorough else 1)):
            name = f"{family.name} {i + 1}"
            problem = family.make(skeletons.generator(seed, name))
            if skeletons.suits(problem.posed, greeting):
                found.append(_case(name, family, problem, greeting, method))
    return found + _elsewhere(found)


def _case(name: str, family: Family, problem: Problem, greeting: Greeting, method: str) -> Case:
    tolerance = family.tolerance
    if greeting.precision == "single" and family.name == "tight":
        tolerance = 3e-5
    inputs = request(problem, tolerance, family.sweeps, method)
    known = facts(inputs, problem.posed)
    if tolerance == 0.0:
        known["amplification"] = amplification(inputs)
        known["sweeps"] = family.sweeps
    return Case(name, TASK, inputs, family.name, family.about, facts=known)


def _elsewhere(found: list[Case]) -> list[Case]:
    """Return the first sweeps again in a rotated, scaled and shifted world."""
    worlds = (
        ("rotated", rotation.exponential([0.5, -0.8, 1.1]), 1.0, np.zeros(3)),
        ("in other units", rotation.identity(), 1000.0, np.zeros(3)),
        ("shifted", rotation.identity(), 1.0, np.array([2.0, -1.0, 0.5])),
    )
    again = []
    for case, (name, Q, scale, shift) in zip(found[2:], worlds, strict=False):
        if "sweeps" not in case.facts:
            break
        posed = Posed(*(case.inputs[key] for key in Posed._fields))
        moved = skeletons.in_world(posed, Q, scale, shift)
        target = scale * rotation.rotate(Q, case.inputs["target"]) + shift
        inputs = {**case.inputs, **moved._asdict(), "target": target}
        known = {
            **facts(inputs, moved),
            "amplification": case.facts["amplification"],
            "sweeps": case.facts["sweeps"],
            "like": case.name,
            "world": (Q, scale, shift),
        }
        about = sentence(
            "The case '{case}' in another world, {how}: the answer is the same one there.",
            case=case.name,
            how=name,
        )
        again.append(
            Case(f"{case.name}, {name}", TASK, inputs, "another world", about, facts=known)
        )
    return again
