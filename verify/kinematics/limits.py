"""Chains with limits: whether joints keep them, targets are reached, and how limits are misread.

A local rotation is split into a twist about the joint's axis and the tilt of that axis. A cone of 0
makes a hinge. Solvers within limits may stall, each elsewhere, so a missed target alone is a
reservation. A solver is wrong if most targets within reach of CCD and FABRIK are missed.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference import Articulation, Skeleton, rotation, solve_ik
from plumbob.reference.arguments import FloatArray

from ..case import Case
from ..exchange import Answer, Exchange
from ..greeting import Greeting
from ..judgement import CaseJudgement, Finding, Verdict
from ..laws import finding, judge_case
from . import pose_laws, problems, rounding, skeletons
from .predictions import forward
from .problems import TargetProblem
from .skeletons import CaseFamily

Inputs = Mapping[str, Any]
FIELDS = ("axes", "cones", "lower", "upper")
# A solver that misses more than this share of the targets is wrong, not unlucky.
MAX_MISSES = 0.5
# The sweeps in which the reference reaches a target.
SWEEPS = {"ccd": 20, "fabrik": 50}
# To a target as near as this [m] no joint need rotate farther than JUMP [rad]: the reference's
# methods rotate none half as far.
NEAR, JUMP = 0.1, 1.0
# Programs with misread limits miss some targets by so much [m]. Programs without limits rotate
# joints so far beyond [rad].
MISSED, BEYOND = 0.02, 0.2
# A misreading explains answers in which so many more joints are at an end of their limits.
MORE_ENDS = 2
# The ranges of cones, of the smaller and of the larger limits [rad], far enough apart that limits
# which are exchanged show.
CONES, SMALL, LARGE = (0.3, 0.7), (0.2, 0.4), (0.7, 1.1)


class JointLimits(NamedTuple):
    """The limits of joints, of which a misread program has others."""

    axes: FloatArray  # (joint, 3)
    cones: FloatArray  # greatest tilt of the axis [rad]
    lower: FloatArray  # of the twist about the axis [rad]
    upper: FloatArray


def limits_of(inputs: Inputs) -> JointLimits:
    """Return the limits in a request."""
    return JointLimits(*(inputs[name] for name in FIELDS))


def twist_and_tilt(local: FloatArray, axes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the twists about the axes, in (-pi, pi], and the tilts of the axes [rad]."""
    along = np.sum(local[:, 1:] * axes, axis=-1)
    twist = 2.0 * np.arctan2(along, local[:, 0])
    twist -= 2.0 * np.pi * np.sign(twist) * (np.abs(twist) > np.pi)
    across = np.linalg.norm(local[:, 1:] - along[:, None] * axes, axis=-1)
    return twist, 2.0 * np.arctan2(across, np.hypot(along, local[:, 0]))


def margins(local: FloatArray, limits: JointLimits) -> FloatArray:
    """Return how far joints are within their cones, lower and upper limits [rad], (3, joint)."""
    twist, tilt = twist_and_tilt(local, limits.axes)
    return np.array([limits.cones - tilt, twist - limits.lower, limits.upper - twist])


def solve_within(method: str, inputs: Inputs) -> FloatArray:
    """Return the local rotations of a solve by the reference, (joint, 4)."""
    axes, cones, lower, upper = limits_of(inputs)
    start, hinges = inputs["local_rotations"], cones == 0.0
    model = Articulation(
        Skeleton(inputs["parents"], inputs["offsets"]),
        ["hinge" if is_hinge else "ball" for is_hinge in hinges], axes,
        lower=np.where(lower > -np.pi, lower, -np.inf),
        upper=np.where(upper < np.pi, upper, np.inf), cones=np.where(cones < np.pi, cones, np.inf),
    )  # fmt: skip
    twist, _ = twist_and_tilt(start, axes)
    q = np.concatenate([twist[j : j + 1] if hinges[j] else start[j] for j in range(len(start))])
    options = {name: inputs[name] for name in ("effector", "tolerance", "max_iterations")}
    solution = solve_ik(model, q, inputs["target"], method, restarts=0, **options)
    local = np.array(start)
    for j in range(len(start)):
        coordinates = solution.coordinates[model.coordinates_of(j)]
        local[j] = rotation.exponential(coordinates * axes[j]) if hinges[j] else coordinates
    return local


def cases(greeting: Greeting, method: str, seed: int, thorough: bool) -> list[Case]:
    """Return chains with hinges and cones, if the greeting declares limits.

    Single sweeps of the textbook's methods follow, which show how limits are kept.
    """
    if not greeting.limits or greeting.planar or not greeting.rotations:
        return []
    drawn = [
        (name, family, inputs | {"method": method} | problems.constants(greeting))
        for name, family, inputs in skeletons.drawn("limits", _draw, seed, 5 if thorough else 1)
        if skeletons.suits(inputs["parents"], greeting, inputs["effector"])
    ]
    single = [
        (f"one sweep, {name}", family, inputs | {"max_iterations": 1})
        for name, family, inputs in drawn
        if method.lower() in SWEEPS
        and not greeting.fixed.max_iterations
        and family.target[0] == "far"
    ]
    return [_case(*arguments) for arguments in (*drawn, *single)]


def _case(name: str, family: CaseFamily, inputs: dict[str, Any]) -> Case:
    facts = problems.facts(inputs)
    return Case(name, problems.TASK, inputs, family.name, family.about, facts=facts)


def _draw(family: CaseFamily, rng: np.random.Generator) -> dict[str, Any]:
    """Draw requests until the reference reaches the target within limits, which matter."""
    requests = (_candidate(family, rng) for _ in range(problems.DRAWS))
    return next(inputs for inputs in requests if _is_suitable(family.target[0], inputs))


def _candidate(family: CaseFamily, rng: np.random.Generator) -> dict[str, Any]:
    """Return a chain between two random poses within its limits."""
    kind, *joints = family.target
    skeleton, limits, effector = family.pose(rng), _random_limits(joints, rng), len(joints) - 1
    start, goal = (_random_pose(limits, rng) for _ in range(2))
    x, target = (
        forward(skeleton._replace(local_rotations=pose)._asdict())[0][effector]
        for pose in (start, goal)
    )
    if kind == "near":
        target = x + NEAR * (target - x) / np.linalg.norm(target - x)
    problem = TargetProblem(skeleton._replace(local_rotations=start), effector, target)
    inputs = problems.request(problem, family.tolerance, family.sweeps, "")
    return inputs | limits._asdict()


def _random_limits(kinds: Sequence[str], rng: np.random.Generator) -> JointLimits:
    """Return limits of joints that are free, hinges or within cones."""
    axes = rng.standard_normal((len(kinds), 3))
    axes /= np.linalg.norm(axes, axis=-1, keepdims=True)
    cones, small, large = (rng.uniform(*ends, len(kinds)) for ends in (CONES, SMALL, LARGE))
    is_reversed, free = rng.uniform(size=len(kinds)) < 0.5, np.array(kinds) == "free"
    lower, upper = np.where(is_reversed, -large, -small), np.where(is_reversed, small, large)
    cones[np.array(kinds) == "hinge"] = 0.0
    cones[free], lower[free], upper[free] = np.pi, -np.pi, np.pi
    return JointLimits(axes, cones, lower, upper)


def _random_pose(limits: JointLimits, rng: np.random.Generator) -> FloatArray:
    """Return local rotations within limits; joints that are free rotate by up to half a turn."""
    directions = np.cross(rng.standard_normal(limits.axes.shape), limits.axes)
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    tilts = np.minimum(rng.uniform(0.0, limits.cones), 0.5 * np.pi)
    twists = rng.uniform(limits.lower, limits.upper)
    swing = rotation.exponential(tilts[:, None] * directions)
    return rotation.multiply(swing, rotation.exponential(twists[:, None] * limits.axes))


def _is_suitable(kind: str, inputs: Inputs) -> bool:
    """Return whether the reference reaches the target soon, and would not with other limits."""
    for method, sweeps in SWEEPS.items():
        local = solve_within(method, {**inputs, "max_iterations": sweeps})
        if _miss(local, inputs) > inputs["tolerance"]:
            return False
        if kind == "near" and _largest_rotation(local, inputs) > 0.5 * JUMP:
            return False
    if kind in READINGS:
        narrow, _ = next(READINGS[kind](inputs, local))
        return _miss(solve_within("ccd", {**inputs, **narrow._asdict()}), inputs) > MISSED
    free = _without(FIELDS[1:], limits_of(inputs))
    unlimited = solve_within("ccd", {**inputs, **free._asdict()})
    return kind == "near" or bool(margins(unlimited, limits_of(inputs)).min() < -BEYOND)


def _miss(local: FloatArray, inputs: Inputs) -> float:
    """Return the effector's distance from its target [m]."""
    x, _ = forward({**inputs, "local_rotations": local})
    return float(np.linalg.norm(x[inputs["effector"]] - inputs["target"]))


def _largest_rotation(local: FloatArray, inputs: Inputs) -> float:
    """Return the largest rotation of a joint from its start [rad]."""
    return float(rotation.angle(local, inputs["local_rotations"])[:-1].max())


def judge(exchanges: Sequence[Exchange], greeting: Greeting) -> tuple[list[CaseJudgement], str]:
    """Return the judgements of answers to requests with limits, and how they are misread or ""."""
    pairs = [(exchange.case, _local(exchange)) for exchange in exchanges]
    answers = [(case, local) for case, local in pairs if local is not None]
    whole = [answer for answer in answers if not _is_sweep(answer[0])]
    misses = [_miss(local, case.inputs) > _reach(case, greeting) for case, local in whole]
    is_lost = sum(misses) > MAX_MISSES * len(misses)
    key = _misreading(answers, is_lost, greeting)
    miss = "within limits"
    if key or is_lost:
        miss = "most" if is_lost else "misread"
    judgements = []
    for exchange in exchanges:
        laws = partial(_findings, exchange, f"target reached, {miss}", greeting)
        allowed = rounding.repeats(greeting.epsilon, exchange.case.facts["size"])
        reference = partial(solve_within, "ccd", exchange.case.inputs)
        judgements.append(judge_case(exchange, laws, allowed, reference))
    wrong = any(judgement.verdict is Verdict.WRONG for judgement in judgements)
    return judgements, key if wrong else ""


def _local(exchange: Exchange) -> FloatArray | None:
    """Return answered local rotations, normalised; None if there are none of finite length."""
    outputs = exchange.answer.values if isinstance(exchange.answer, Answer) else {}
    local = np.array(outputs.get("local_rotations", np.zeros((1, 4))), dtype=float)
    lengths = np.linalg.norm(local, axis=-1, keepdims=True)
    is_valid = np.isfinite(lengths).all() and lengths.all()
    return local / lengths if is_valid else None


def _is_sweep(case: Case) -> bool:
    return bool(case.inputs["max_iterations"] == 1)


def _reach(case: Case, greeting: Greeting) -> float:
    """Return the distance from the target that counts as reached [m]."""
    joints, size = len(case.inputs["parents"]), case.facts["size"]
    return float(case.inputs["tolerance"] + rounding.positions(greeting.epsilon, joints, size))


def _findings(
    exchange: Exchange, miss: str, greeting: Greeting, outputs: Mapping[str, Any]
) -> Iterator[Finding]:
    case, local = exchange.case, _local(exchange)
    pose = pose_laws.read_pose(outputs, case.inputs, case.facts)
    yield from pose_laws.all_of(pose, case, greeting)
    if local is None:
        yield finding("numbers, no rotations")
        return
    yield _limits_kept(local, case, greeting)
    distance, bound = _miss(local, case.inputs), _reach(case, greeting)
    if not _is_sweep(case):
        yield finding(miss, distance, bound)
    yield from pose_laws.claims(distance, bound - case.inputs["tolerance"], outputs, case)
    if case.facts["before"] <= 1.001 * NEAR:
        yield finding("no jumps, of a rotation", _largest_rotation(local, case.inputs), JUMP)


def _limits_kept(local: FloatArray, case: Case, greeting: Greeting) -> Finding:
    """Return the worst excess; arc cosines lose digits, and helpers round small angles away."""
    limits = limits_of(case.inputs)
    excess = -margins(local, limits)[:, :-1]
    kind, joint = divmod(int(np.argmax(excess)), excess.shape[1])
    twist, tilt = twist_and_tilt(local, limits.axes)
    key = "limits kept, of a twist" if kind else "limits kept, of a cone"
    if not kind and limits.cones[joint] == 0.0:
        key = "limits kept, of a hinge"
    error, bound = excess[kind, joint], rounding.SWEEP_ROUNDINGS * len(local) * greeting.epsilon
    verdict = Verdict.RIGHT_EXCEPT if error <= rounding.DEAD_ANGLE[greeting.precision] else None
    limit = (limits.cones, limits.lower, limits.upper)[kind][joint]
    return finding(key, error, bound, verdict=verdict, index=joint, limit=float(limit),
                   value=float((twist if kind else tilt)[joint]))  # fmt: skip


# Yields limits in a program's reading, and the limited rotations, given the answered rotations.
Reading = Callable[[Inputs, FloatArray], Iterator[tuple[JointLimits, FloatArray]]]


def _of_limits(read: Callable[[JointLimits], JointLimits]) -> Reading:
    """Return the reading of limits that depend on nothing else."""
    return lambda inputs, local: iter([(read(limits_of(inputs)), local)])


def _scaled(factor: float, names: Sequence[str], limits: JointLimits) -> JointLimits:
    """Return limits that are multiplied by a number."""
    return limits._replace(**{name: factor * getattr(limits, name) for name in names})


def _shifted(shift: int, limits: JointLimits) -> JointLimits:
    """Return limits with each joint's from another."""
    return JointLimits(*(np.roll(array, shift, axis=0) for array in limits))


def _without(
    names: Sequence[str], limits: JointLimits, of_hinges: bool | None = None
) -> JointLimits:
    """Return limits without those of these names: of all joints, of hinges alone, or of others."""
    is_free = of_hinges is None or (limits.cones == 0.0) == of_hinges
    widest = dict(zip(FIELDS[1:], (np.pi, -np.pi, np.pi), strict=True))
    return limits._replace(
        **{name: np.where(is_free, widest[name], getattr(limits, name)) for name in names}
    )


def _one_end(inputs: Inputs, local: FloatArray) -> Iterator[tuple[JointLimits, FloatArray]]:
    """Yield limits that leave their lower or their upper end only."""
    limits = limits_of(inputs)
    yield limits._replace(upper=limits.lower), local
    yield limits._replace(lower=limits.upper), local


def _changes(inputs: Inputs, local: FloatArray) -> Iterator[tuple[JointLimits, FloatArray]]:
    """Yield the changes from the start, in the joint's frame and in the parent's."""
    back = rotation.conjugate(inputs["local_rotations"])
    yield limits_of(inputs), rotation.multiply(back, local)
    yield limits_of(inputs), rotation.multiply(local, back)


def _in_the_world(inputs: Inputs, local: FloatArray) -> Iterator[tuple[JointLimits, FloatArray]]:
    """Yield axes as directions in the world, at the start and at the end."""
    limits, parents = limits_of(inputs), inputs["parents"]
    for pose in (inputs["local_rotations"], local):
        _, R = forward({**inputs, "local_rotations": pose})
        R_parent = np.where(parents[:, None] >= 0, R[parents], rotation.identity())
        axes = rotation.rotate(rotation.conjugate(R_parent), limits.axes)
        yield limits._replace(axes=axes), local


# The readings of limits, by the keys of `faults.toml`: "" is the right one. Among the readings kept
# by answers, the explanation is the reading with most joints at an end; the earlier of equals.
READINGS: Mapping[str, Reading] = {
    "": _of_limits(lambda limits: limits),
    "half angles of cones": _of_limits(partial(_scaled, 2.0, FIELDS[1:2])),
    "half angles of twists": _of_limits(partial(_scaled, 2.0, FIELDS[2:])),
    "half angles": _of_limits(partial(_scaled, 2.0, FIELDS[1:])),
    "cone as an opening": _of_limits(partial(_scaled, 0.5, FIELDS[1:2])),
    "limits in degrees": _of_limits(partial(_scaled, np.pi / 180.0, FIELDS[1:])),
    "limits exchanged": _one_end,
    "sign of the lower limit lost": _of_limits(
        lambda limits: limits._replace(lower=np.minimum(np.abs(limits.lower), limits.upper))
    ),
    "limits symmetric": _of_limits(lambda limits: limits._replace(lower=-limits.upper)),
    "sense of rotation reversed": _of_limits(
        lambda limits: limits._replace(lower=-limits.upper, upper=-limits.lower)
    ),
    "limits of the change": _changes,
    "axes in the world": _in_the_world,
    "limits of the next joint": _of_limits(partial(_shifted, -1)),
    "limits of the joint before": _of_limits(partial(_shifted, 1)),
    "hinges leave their limits": _of_limits(partial(_without, FIELDS[2:], of_hinges=True)),
    "twists of cones ignored": _of_limits(partial(_without, FIELDS[2:], of_hinges=False)),
    "cones ignored": _of_limits(partial(_without, FIELDS[1:2], of_hinges=False)),
    "hinges tilt": _of_limits(partial(_without, FIELDS[1:2], of_hinges=True)),
    "lower limits ignored": _of_limits(partial(_without, ("lower",))),
    "upper limits ignored": _of_limits(partial(_without, ("upper",))),
    "twists ignored": _of_limits(partial(_without, FIELDS[2:])),
}
IGNORED = "limits ignored"


def _ends(reading: Reading, case: Case, local: FloatArray, bound: float) -> int:
    """Return how many joints are at an end of their limits, -1 if one is beyond."""
    counts = [-1]
    for limits, limited in reading(case.inputs, local):
        distances = margins(limited, limits)[:, :-1]
        is_kept = bool((distances >= -bound).all())
        counts.append(int((np.abs(distances) <= bound).sum()) if is_kept else -1)
    return max(counts)


def _misreading(
    answers: Sequence[tuple[Case, FloatArray]], is_lost: bool, greeting: Greeting
) -> str:
    """Return the key of how limits are misread, "" if they are not or nobody knows."""
    bound, scores = rounding.DEAD_ANGLE[greeting.precision], dict[str, int]()
    whole = [answer for answer in answers if not _is_sweep(answer[0])]
    for key, reading in READINGS.items():
        ends = [_ends(reading, case, local, bound) for case, local in whole]
        if ends and min(ends) >= 0:
            scores[key] = sum(ends)
    key = max(scores, key=scores.__getitem__, default=IGNORED)
    if key == IGNORED:
        is_far = any(margins(x, limits_of(case.inputs)).min() < -BEYOND for case, x in answers)
        return IGNORED if is_far and not is_lost else ""
    return key if "" not in scores or scores[key] >= scores[""] + MORE_ENDS else ""
