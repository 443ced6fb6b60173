"""Motions of a robot's tool, as cases: along a curve, in laps, across the boundary of the reach."""

import tomllib
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from plumbob.reference import Target
from plumbob.reference.arguments import FloatArray
from plumbob.reference.jacobians import jacobian
from plumbob.reference.skeleton import Pose
from plumbob.reference.tracking import track
from plumbob.text.sentence import Sentence

from ..case import Case
from ..greeting import Greeting
from .robot_models import (
    BENT,
    PRECISION,
    TOLERANCES,
    Inputs,
    mechanism,
    robot_case,
    robots,
    tool_pose,
)
from .robot_targets import (
    HALF_TURNS,
    TOLERANCE,
    ToolRequest,
    half_turns,
    limited_steps,
    off_by_tolerances,
    tight_limits,
)
from .skeletons import suits

TASK = "robot_track"
CURVE, FLIPPED, STEPS = "curve", "opposite quaternions", "single steps"
BOUNDARY = "boundary of the reach"
JUMP, LIMITED_JUMP = "jump", "jump, limited speeds"
BEYOND_PI = "coordinates beyond pi"
FRAMES, ITERATIONS, H = 24, 40, 0.02
# The last joint of this robot may rotate so far [rad]: further than half a turn.
WRIST = 5.0
# From the bent arm to one on a rail, whose wrist is rotated further than half a turn [m, rad].
RAIL = np.array([4.4, 0.0, 0.0, 0.0, 0.0, 0.0, 4.0])
# How far a target goes along a ray from the bent arm; a sixth of a metre of it is beyond reach [m].
EXCURSION = 0.3
DRAWS = 20
# The reference moves no joint farther in a frame of an easy motion [rad]; beyond reach it goes far.
EASY = 2.0
# The least singular value of the other joints' Jacobian for motions without a joint [m].
SPARE = 0.1
_SEED = 1961
_TABLE = tomllib.loads(Path(__file__).with_name("motions.toml").read_text(encoding="utf-8"))


def cases(greeting: Greeting, method: str, seed: int, thorough: bool) -> list[Case]:
    """Return motions of robots of seven hinges, with axes along their frames' and with others."""
    rng = np.random.default_rng([_SEED, seed])
    collection = robots(rng)
    arm, twisted = collection["seven hinges"], collection["seven hinges in rotated frames 1"]
    arm["upper"][-1], arm["lower"][-1] = WRIST, -WRIST
    motions = list[tuple[str, ToolRequest]]()
    for number in range(1, 4 if thorough else 2):
        q = loop(rng.uniform(-0.6, 0.6, 7), rng)
        curve = ToolRequest(CURVE, twisted, q[0], tool_pose(twisted, q))
        curves = [curve, curve._replace(family=STEPS)]
        motions += [(f"rotated frames {number}", motion) for motion in curves]
        middle = BENT + rng.uniform(-0.1, 0.1, 7)
        motions += [(f"seven hinges {number}", motion) for motion in _motions(arm, middle, rng)]
        tolerances = TOLERANCES[greeting.precision] * np.ones(2)
        requests = [*off_by_tolerances(arm, tolerances, rng)]
        for robot in (arm, twisted):
            requests += [*tight_limits(robot, rng), *limited_steps(robot, rng)]
        motions += [(f"target {i + 1}", _resting(request)) for i, request in enumerate(requests)]
        rail = _on_rail(arm)
        q = loop(BENT + RAIL, np.random.default_rng([_SEED, seed, number]))
        motions += [(f"a rail {number}", ToolRequest(BEYOND_PI, rail, q[0], tool_pose(rail, q)))]
    return [
        _case(name, motion, greeting)
        for name, motion in motions
        if suits(motion.robot["parents"], greeting)
        and (greeting.velocity_limits or "velocity_limit" not in _TABLE[motion.family])
    ]


def _on_rail(arm: Inputs) -> Inputs:
    """Return an arm whose first joint slides along an oblique axis, and which rotates far."""
    slides, axes = np.arange(7) < 1, np.array([[0.36, 0.48, 0.8], *arm["axes"][1:]])
    lower, upper = (np.array([end, *arm[side][1:-1], end])
                    for side, end in (("lower", -6.0), ("upper", 6.0)))  # fmt: skip
    return {**arm, "slides": slides, "axes": axes, "lower": lower, "upper": upper}


def _motions(arm: Inputs, middle: FloatArray, rng: np.random.Generator) -> list[ToolRequest]:
    """Return the motions of a robot about a configuration, as in `motions.toml`."""
    q = loop(middle, rng)
    tool, start = tool_pose(arm, q), q[0]
    signs = np.where(np.arange(FRAMES) // 4 % 2, -1.0, 1.0)[:, None]
    jump = np.stack([start, np.clip(middle + rng.uniform(-0.4, 0.4, 7), -2.0, 2.0)])
    beyond, wrist, elbow = start.copy(), np.tile(start, (FRAMES, 1)), np.tile(start, (FRAMES, 1))
    beyond[1] = arm["lower"][1] - 0.3
    wrist[:, -1] += np.linspace(0.0, 4.0, FRAMES)
    elbow[:, 3] = np.linspace(start[3], -start[3], FRAMES)
    few, leap = Pose(*(part[:8] for part in tool)), tool_pose(arm, jump)
    followed_from_start = {
        CURVE: tool,
        FLIPPED: tool._replace(rotations=signs * tool.rotations),
        STEPS: tool,
        "long time step": few,
        "rest": few,
        JUMP: leap,
        LIMITED_JUMP: leap,
        "laps": Pose(*(np.tile(part, (3, 1)) for part in tool)),
        "more than half a turn": tool_pose(arm, wrist),
        "singularity": tool_pose(arm, elbow),
    }
    return [
        *(ToolRequest(family, arm, start, t) for family, t in followed_from_start.items()),
        ToolRequest("start beyond a limit", arm, beyond, tool),
        _easiest([_draw_excursion(arm, rng) for _ in range(DRAWS)]),
        _easiest([_draw_limited(arm, rng) for _ in range(DRAWS)]),
        *_half_turns(arm, q[:8]),
    ]


def _half_turns(arm: Inputs, q: FloatArray) -> Iterator[ToolRequest]:
    """Yield motions of tools rotated by nearly half a turn, solved and in single steps."""
    for family, turned in zip(HALF_TURNS, half_turns(arm, q[0]), strict=True):
        motion = ToolRequest(family, turned, q[0], tool_pose(turned, q))
        yield from (motion, motion._replace(family=f"{family}, {STEPS}"))


def _resting(request: ToolRequest) -> ToolRequest:
    """Return a motion to a target that rests for a frame."""
    tool = Pose(*(np.repeat(part[None], 2, axis=0) for part in request.tool))
    facts = {**request.facts, "reachable": request.family == TOLERANCE}
    return request._replace(tool=tool, facts=facts)


def loop(middle: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Return joint angles on a small closed curve through a configuration, (frame, joint)."""
    u, w = 0.25 * rng.uniform(-1.0, 1.0, (2, len(middle)))
    t = 2.0 * np.pi * np.arange(FRAMES)[:, None] / FRAMES
    return middle + np.sin(t) * u + (1.0 - np.cos(t)) * w


def _easiest(motions: Sequence[ToolRequest]) -> ToolRequest:
    """Return the first easy motion, or the last."""
    return next(filter(_is_easy, motions), motions[-1])


def _draw_excursion(arm: Inputs, rng: np.random.Generator) -> ToolRequest:
    """Return a motion along a ray from the shoulder, beyond reach and back.

    The tool points along the ray, so that the straight arm has its rotation as well. Coming back,
    the arm may bend otherwise, and meet a limit: a motion is drawn where the reference does not.
    """
    q = np.array([0.3, 0.0, 0.0, 1.2, 0.0, -0.6, 0.4])
    q += rng.uniform(-1.0, 1.0, 7) * [0.2, 0.02, 0.02, 0.02, 0.02, 0.02, 0.2]
    tool = tool_pose(arm, q)
    direction = tool.positions - arm["origins"][:2].sum(axis=0)
    direction /= np.linalg.norm(direction)
    distances = EXCURSION * np.sin(np.linspace(0.0, np.pi, 2 * FRAMES))
    positions = tool.positions + distances[:, None] * direction
    rotations = np.tile(tool.rotations, (len(positions), 1))
    facts = {"reachable": distances < 1e-9}
    return ToolRequest(BOUNDARY, arm, q, Pose(positions, rotations), facts=facts)


def _is_easy(motion: ToolRequest) -> bool:
    """Return whether two of the reference's solvers end on the last target and do not jump."""
    for solver in ("levenberg_marquardt", "damped_least_squares"):
        q = followed(motion.robot, motion.start, motion.tool, solver)
        end = tool_pose(motion.robot, q[-1]).positions
        error = np.linalg.norm(end - motion.tool.positions[-1])
        if error > 1e-3 or np.abs(np.diff(q, axis=0)).max() > EASY:
            return False
    return True


def _draw_limited(arm: Inputs, rng: np.random.Generator) -> ToolRequest:
    """Return a motion of a joint to a limit, possible for the other joints alone."""
    q = loop(BENT + rng.uniform(-0.2, 0.2, 7), rng)
    tool, start, upper = tool_pose(arm, q), q[0], arm["upper"].copy()
    free = followed(arm, start, tool) - start
    joint = max(range(7), key=lambda j: (_is_spare(arm, q, j), free[:, j].max()))
    frame = int(np.argmax(free[:, joint]))
    upper[joint] = start[joint] + 0.1 * free[frame, joint]
    limited, short = {**arm, "upper": upper}, Pose(*(part[: frame + 1] for part in tool))
    return ToolRequest("at a limit", limited, start, short)


def _is_spare(arm: Inputs, q: FloatArray, joint: int) -> bool:
    """Return whether the other joints alone move the tool in every direction."""
    J = np.delete(jacobian(mechanism(arm), q, -1), joint, axis=-1)
    return bool(np.linalg.svd(J, compute_uv=False).min() > SPARE)


def followed(
    inputs: Inputs, start: FloatArray, tool: Pose, solver: str = "levenberg_marquardt"
) -> FloatArray:
    """Return the reference's coordinates in each frame, each from the one before."""
    targets = Target(tool.positions, tool.rotations, -1)
    return track(
        mechanism(inputs), targets, solver, start, tolerance=1e-9, tolerance_rotation=1e-9,
        max_iterations=ITERATIONS,
    ).coordinates  # fmt: skip


def timed_track(inputs: Inputs) -> Callable[[], object]:
    """Return the call of the reference that answers a request, to be timed."""
    targets = Target(inputs["target_positions"], inputs["target_rotations"], -1)
    within = np.clip(inputs["start"], inputs["lower"], inputs["upper"])
    options = {name: inputs[name] for name in PRECISION}
    return partial(track, mechanism(inputs), targets, "levenberg_marquardt", within, **options)


def _case(name: str, motion: ToolRequest, greeting: Greeting) -> Case:
    entry, robot, family = _TABLE[motion.family], motion.robot, motion.family
    reach = float(sum(np.linalg.norm(x) for x in (*robot["origins"], robot["tool_position"])))
    tolerance, rest = TOLERANCES[greeting.precision], entry.get("rest", 0)
    positions, rotations = (
        np.concatenate([part, np.repeat(part[-1:], rest, axis=0)]) for part in motion.tool
    )
    options = {
        "start": motion.start,
        "target_positions": positions,
        "target_rotations": rotations,
        "h": entry.get("h", H),
        "tolerance": tolerance * max(reach, 1.0),
        "tolerance_rotation": tolerance,
        "max_iterations": entry.get("iterations", ITERATIONS),
        **motion.options,
    }
    if "velocity_limit" in entry:  # the limits of joints differ
        limits = entry["velocity_limit"] * np.linspace(1.0, 0.5, len(robot["axes"]))
        options["velocity_limits"] = limits
    is_reachable = np.ones(len(positions), dtype=bool)
    is_reachable[: len(motion.tool.positions)] = motion.facts.get("reachable", True)
    facts = {"size": reach, "rest": rest, "laps": entry.get("laps", 1)}
    # Coming back from beyond reach there are several configurations.
    facts["certain"] = FRAMES if family == BOUNDARY else len(positions)
    facts |= {**motion.facts, "reachable": is_reachable}
    about = Sentence(entry["about"], {})
    return robot_case(f"{name}, {family}", TASK, family, robot, options, facts, about)
