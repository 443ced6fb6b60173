"""Problems of inverse kinematics: closed forms, single sweeps, reachable and hostile targets.

Both textbook solvers reach the targets of whole solves well within the sweeps allowed, so that an
honest solver does. No rotation of a single sweep is close to 0 or pi, where honest computations of
it differ.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference import curves, rotation
from plumbob.reference.arguments import FloatArray
from plumbob.text.sentence import sentence

from ..case import Case
from ..greeting import Greeting
from . import skeletons
from .predictions import forward, path_to, solve
from .skeletons import CaseFamily, PosedSkeleton
from .textbook import SOLVERS

TASK = "inverse_kinematics"
# The rotations of single sweeps are at least so far from 0 and pi [rad].
MIN_ANGLE = 0.1
# Sweeps that enlarge small changes of their start by more than this tell little.
MAX_AMPLIFICATION = 30.0
# A target counts as easy if both textbook solvers reach it in EASY sweeps; ALLOWED are allowed.
EASY, ALLOWED = 12, 60
DRAWS = 2000
# The numbers of sweeps after a single sweep, for wrong verdicts.
COUNTED = (2, 5, 60)
LOOSE = 1e-2
# Sweeps of a constant number go to targets so far beyond reach [m], if no tolerance asks for more.
# Their last rotations are small and lose a digit more.
BEYOND, SMALL_ANGLES = 1e-2, 10.0


class TargetProblem(NamedTuple):
    """A skeleton, the joint that is to reach a target, and the target."""

    skeleton: PosedSkeleton
    effector: int
    target: FloatArray


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


def constants(greeting: Greeting) -> dict[str, Any]:
    """Return the inputs that a solver has as constants."""
    fixed = greeting.fixed
    values = {"tolerance": fixed.tolerance, "max_iterations": fixed.max_iterations}
    return {name: value for name, value in values.items() if value}


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


def draw(family: CaseFamily, rng: np.random.Generator) -> TargetProblem:
    """Draw problems of a family until one has a suitable target."""
    problems = (_candidate(family, rng) for _ in range(DRAWS))
    return next(problem for problem in problems if _is_suitable(family, problem))


def _candidate(family: CaseFamily, rng: np.random.Generator) -> TargetProblem:
    kind, *arguments = family.target
    if kind == "circle":
        target = curves["circle"](150)[rng.integers(150)]
        target = target[[0, 2, 1]] if family.planar else target
        return TargetProblem(family.pose(rng), 4, target)
    skeleton = family.pose(rng)
    offsets, effector = skeleton.offsets, len(skeleton.parents) - 1
    match kind:
        case "point":
            target = np.array(arguments) * (skeletons.IN_PLANE if family.planar else 1.0)
        case "joint":
            target = forward(skeleton._asdict())[0][arguments[0]]
        case "behind":  # on the line from the effector through a joint
            x, _ = forward(skeleton._asdict())
            target = x[arguments[0]] + 0.75 * (x[arguments[0]] - x[effector])
        case "distance":  # as a share of the reach
            reach = float(np.linalg.norm(offsets[1:], axis=-1).sum())
            direction = rotation.rotate(rotation.random(rng), [1.0, 0.0, 0.0])
            direction = skeletons.onto_plane(direction) if family.planar else direction
            target = offsets[0] + arguments[0] * reach * direction
        case _:  # well within reach
            effector = arguments[0] if arguments and kind in ("easy", "telling") else effector
            moved = skeleton._replace(local_rotations=rotation.random(rng, len(offsets)))
            moved = skeletons.in_plane(moved) if family.planar else moved
            target = forward(moved._asdict())[0][effector]
    return TargetProblem(skeleton, effector, target)


def _is_suitable(family: CaseFamily, problem: TargetProblem) -> bool:
    match family.target[0]:
        case "telling":
            return is_telling(family.sweeps, problem)
        case "near miss":
            _, least, most = family.target[1:]
            low, high = misses(family.sweeps, problem)
            return least < low and high < most and is_telling(family.sweeps, problem)
        case "easy" | "circle" | "behind":
            return is_easy(family.tolerance, problem)
        case "square" | "stall":
            return all(_shows_stop(family.target[0], method, problem) for method in SOLVERS)
    return True


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


def misses(sweeps: int, problem: TargetProblem) -> tuple[float, float]:
    """Return how far from the target sweeps of the solvers end, the smaller distance first [m]."""
    inputs = request(problem, 0.0, sweeps, "")
    ends = [solve(method, inputs)[1][problem.effector] for method in SOLVERS]
    distances = np.linalg.norm(np.subtract(ends, problem.target), axis=-1)
    return float(distances.min()), float(distances.max())


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


def _shows_stop(test: str, method: str, problem: TargetProblem) -> bool:
    """Return whether a solver reaches the target soon, but ends elsewhere with a faulty test.

    The square of the tolerance takes its place, or the change of the distance that of the distance.
    """
    inputs = request(problem, LOOSE, ALLOWED, "")
    _, x, sweeps = solve(method, inputs)
    if sweeps > ALLOWED // 2:
        return False
    if test == "square":
        _, y, faulty_sweeps = solve(method, inputs | {"tolerance": LOOSE * LOOSE})
    else:
        y, faulty_sweeps = _stalled(method, inputs)
        if np.linalg.norm(y[problem.effector] - problem.target) <= 1.5 * LOOSE:
            return False
    return faulty_sweeps != sweeps and bool(np.abs(x - y).max() >= 1e-3)


def _stalled(method: str, inputs: Mapping[str, Any]) -> tuple[FloatArray, int]:
    """Return the positions of the first sweep that changes the distance by little, and its number.

    The number is the last allowed number if none does.
    """
    before, x = np.inf, forward(inputs)[0]
    for count in range(1, ALLOWED + 1):
        distance = float(np.linalg.norm(x[inputs["effector"]] - inputs["target"]))
        if abs(before - distance) <= LOOSE:
            return x, count - 1
        before = distance
        _, x, _ = solve(method, {**inputs, "tolerance": 0.0, "max_iterations": count})
    return x, ALLOWED


def cases(greeting: Greeting, method: str, seed: int, thorough: bool) -> list[Case]:
    """Return single sweeps, then closed forms, whole solves and hostile targets."""
    problems = [
        _case(name, family, problem, greeting, method)
        for name, family, problem in skeletons.drawn(
            TASK, draw, seed, 5 if thorough else 1, greeting.planar
        )
        if skeletons.suits(problem.skeleton.parents, greeting, problem.effector)
        and not (greeting.fixed.max_iterations and _is_about_sweeps(family))
    ]
    return [*problems, *_transformed(problems, greeting)]


def telling_cases(greeting: Greeting, method: str, seed: int) -> list[Case]:
    """Return requests to ask after a wrong verdict: single sweeps, and the same start with more."""
    if greeting.fixed.max_iterations:
        return []
    single = [
        _case(name, family, problem, greeting, method)
        for name, family, problem in skeletons.drawn(
            f"{TASK}, telling", draw, seed, 1, greeting.planar
        )
        if skeletons.suits(problem.skeleton.parents, greeting, problem.effector)
    ]
    counted = [case for case in single if case.family == "counted sweeps"]
    return [*single, *(_with_sweeps(case, n) for case in counted for n in COUNTED)]


def _with_sweeps(case: Case, count: int) -> Case:
    inputs, sweeps = {**case.inputs, "max_iterations": count}, {**case.facts, "sweeps": count}
    return replace(case, name=f"{case.name}, {count} sweeps", inputs=inputs, facts=sweeps)


def _is_about_sweeps(family: CaseFamily) -> bool:
    """Return whether a family needs another number of sweeps than 1 or many."""
    return family.sweeps == 2 or (family.sweeps == 1 and family.tolerance > 0.0)


def _beyond(problem: TargetProblem, tolerance: float) -> TargetProblem:
    """Return a problem with its target a little beyond reach, which CCD approaches slowly."""
    geometry, root = facts(request(problem, 0.0, 1, "")), problem.skeleton.offsets[0]
    distance = geometry["reach"] + max(2.0 * tolerance, BEYOND)
    direction = (problem.target - root) / np.linalg.norm(problem.target - root)
    return problem._replace(target=root + distance * direction)


def _case(
    name: str, family: CaseFamily, problem: TargetProblem, greeting: Greeting, method: str
) -> Case:
    tolerance = family.tolerance
    if greeting.precision == "single" and family.name == "tight":
        tolerance = 3e-5
    if family.target[0] == "near miss":
        tolerance = float(f"{misses(family.sweeps, problem)[0] / family.target[1]:.2g}")
    if not greeting.rotations:
        problem = problem._replace(skeleton=skeletons.without_rotations(problem.skeleton))
    is_sweep, about = tolerance == 0.0 or family.sweeps == 1, family.about
    count = greeting.fixed.max_iterations
    if is_sweep and count:
        name = name.replace("one sweep", "constant sweeps")
        about = sentence("All {count} sweeps that it makes, whatever is asked.", count=count)
        if method.lower() != "fabrik":  # which may stretch chains beyond reach
            problem = _beyond(problem, greeting.fixed.tolerance or 0.0)
    inputs = request(problem, tolerance, family.sweeps, method) | constants(greeting)
    geometry = facts(inputs)
    if is_sweep:
        small = SMALL_ANGLES if count else 1.0
        geometry |= {
            "amplification": small * amplification(inputs), "sweeps": inputs["max_iterations"],
        }  # fmt: skip
    return Case(name, TASK, inputs, family.name, about, facts=geometry,
                requirement=family.requirement)  # fmt: skip


def _transformed(cases: list[Case], greeting: Greeting) -> Iterator[Case]:
    """Yield three of the first sweeps again in a rotated, scaled and shifted world."""
    plane = skeletons.IN_PLANE if greeting.planar else np.ones(3)
    axis = 1.0 - plane if greeting.planar else plane
    worlds = (
        ("rotated", rotation.exponential([0.5, -0.8, 1.1] * axis), 1.0, np.zeros(3)),
        ("in other units", rotation.identity(), 1000.0, np.zeros(3)),
        ("shifted", rotation.identity(), 1.0, np.array([2.0, -1.0, 0.5]) * plane),
    )
    sweep_cases = [case for case in cases[2 : 2 + len(worlds)] if "sweeps" in case.facts]
    for case, (name, Q, scale, shift) in zip(sweep_cases, worlds, strict=False):
        if scale != 1.0 and greeting.fixed.tolerance:
            continue  # it has a unit
        inputs = dict(case.inputs)
        offsets, local = scale * inputs["offsets"], inputs["local_rotations"].copy()
        offsets[0] = scale * rotation.rotate(Q, inputs["offsets"][0]) + shift
        local[0] = rotation.multiply(Q, local[0])
        target = scale * rotation.rotate(Q, inputs["target"]) + shift
        skeleton = PosedSkeleton(inputs["parents"], offsets, local)
        if not greeting.rotations:
            skeleton = skeletons.without_rotations(skeleton)
        inputs |= {**skeleton._asdict(), "target": target}
        world = {"like": case.name, "world": (Q, scale, shift), "how": name}
        about = sentence(
            "The case '{case}', {how}: the answer must be the same in that frame.",
            case=case.name,
            how=name,
        )
        yield Case(
            f"{case.name}, {name}", TASK, inputs, "another world", about,
            facts={**case.facts, **facts(inputs), **world},
        )  # fmt: skip
