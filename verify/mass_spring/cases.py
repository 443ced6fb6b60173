"""Cases of mass-spring systems, the smallest first, fitted to the systems that a solver takes.

Each probe is a small case with another aspect of a step than the cases before: flight, a spring, a
damper, a pin, a changed h. Faults are sought along the probes.
"""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from plumbob.reference.arguments import FloatArray
from plumbob.reference.scenes.grids import grid_cloth
from plumbob.text.sentence import Sentence, sentence

from ..case import Case
from ..greeting import Greeting, System
from ..task import TASKS

# The telling requests of a single spring.
TELLING_PAIRS = 16
# In place of the mass 1, which hides what is divided by it.
ONE_MASS = 0.8
MOTION_STEPS = 6
# Families without sense in a plane: turned about an axis in the plane, or free to buckle there.
SPATIAL = ("symmetry", "compression")
# Families without a need of gravity, or with gravity in another direction.
OF_GRAVITY = ("rest", "gravity")
# Families of steps of different lengths, or of a short step.
OF_H = ("h changes", "small h")
# Dampers of a step that add no forces of springs' dampers.
UNDAMPED = ("none", "global_factor")
# Scenes of more particles are cloths, which lie level.
MOST_IN_TRIANGLES = 5
GRAVITY = np.array([0.0, -9.81, 0.0])
_TABLE = tomllib.loads(Path(__file__).with_name("scenes.toml").read_text(encoding="utf-8"))


@dataclass(frozen=True, eq=False)
class SpringScene:
    """A system, its state and a step."""

    name: str
    family: str
    about: Sentence
    rest: FloatArray
    springs: Any
    positions: FloatArray
    velocities: FloatArray
    masses: FloatArray
    stiffnesses: FloatArray
    dampings: FloatArray
    h: float
    gravity: FloatArray = field(default_factory=GRAVITY.copy)
    pinned: Any = ()
    rest_lengths: FloatArray | str = "measured"  # or those of `rest`
    external_forces: FloatArray | float = 0.0
    tension_only: bool = False
    # attributes of `System` without which it makes no sense: "pinned" and so on
    needs: tuple[str, ...] = ()
    tasks: tuple[str, ...] = ()  # those that it suits; () for all
    methods: tuple[str, ...] = ()  # the declared methods that it is for; () for all
    follows: str = ""  # the name of the scene that is asked just before it
    probe: bool = True  # whether faults are sought in it
    facts: Mapping[str, Any] = field(default_factory=dict)  # passed on to the laws


def task_cases(task: str, greeting: Greeting, seed: int, thorough: bool) -> list[Case]:
    """Return the cases of a task that suit the solver."""
    return _suitable(task, greeting, scenes(seed, thorough))


def telling_cases(task: str, greeting: Greeting, seed: int) -> list[Case]:
    """Return requests to ask after a wrong verdict, of which each spring's pull can be solved."""
    about = sentence("a request that tells mistakes apart; no part of the verdict")
    drawn = [_random(seed, about=about, **entry) for entry in _TABLE["telling"]]
    drawn += [_telling_pair(number, about) for number in range(TELLING_PAIRS)]
    return _suitable(task, greeting, drawn)


def _telling_pair(number: int, about: Sentence) -> SpringScene:
    """Return two free particles with one spring, by turns stretched and compressed."""
    rng = np.random.default_rng([14, number])
    pair = _random(number, 2, name=f"pair {number + 1}", family="several springs", about=about)
    lengths = _lengths(pair.positions, np.array(pair.springs))
    return replace(
        pair,
        rest_lengths=lengths * rng.uniform(*((0.6, 0.9), (1.1, 1.5))[number % 2]),
        dampings=0.0 * pair.dampings,
        gravity=rng.uniform(-9.0, 3.0, 3),
        h=float(rng.uniform(0.01, 0.06)),
    )


def _suitable(task: str, greeting: Greeting, drawn: Sequence[SpringScene]) -> list[Case]:
    system = greeting.system
    if greeting.planar:
        drawn = [_in_plane(scene) for scene in drawn if scene.family not in SPATIAL]
    if greeting.fixed.gravity is not None:
        drawn = _with_gravity(drawn, np.array(greeting.fixed.gravity))
    if (h := greeting.fixed.h) is not None:
        drawn = [replace(scene, h=h) for scene in drawn if scene.family not in OF_H]
    if task == "mass_spring_forces" and greeting.step.damper in UNDAMPED:
        drawn = [replace(scene, dampings=0.0 * scene.dampings) for scene in drawn]
    suitable = [
        _case(task, scene, system)
        for scene in drawn
        if task in (scene.tasks or TASKS)
        and greeting.step.method in (scene.methods or (greeting.step.method,))
        and all(_has(system, need) for need in scene.needs)
    ]
    names = {"", *(case.name for case in suitable)}
    return [case for case in suitable if case.follows in names]


def trace_of(family: str) -> Sentence:
    """Return where to look if a scene of this family is the first that a solver gets wrong."""
    traces = _TABLE["traces"]
    return Sentence(traces.get(family, traces["cloth"])["sentence"], {})


def _has(system: System, need: str) -> bool:
    return bool(getattr(system, need))


def _with_gravity(drawn: Sequence[SpringScene], gravity: FloatArray) -> list[SpringScene]:
    """Return the scenes for a constant gravity [m/s²]."""
    return [
        replace(scene, gravity=gravity)
        for scene in drawn
        if scene.family not in OF_GRAVITY
        and np.allclose(np.asarray(scene.facts.get("matrix", np.eye(3))) @ gravity, gravity)
    ]


def _in_plane(scene: SpringScene) -> SpringScene:
    """Return a scene projected onto the plane z = 0, a level cloth set upright before."""
    axes = [0, 2, 1] if len(scene.rest) > MOST_IN_TRIANGLES else [0, 1, 2]
    keep = np.array([1.0, 1.0, 0.0])
    return replace(
        scene, rest=scene.rest[:, axes] * keep, positions=scene.positions[:, axes] * keep,
        velocities=scene.velocities[:, axes] * keep, gravity=scene.gravity * keep,
        external_forces=scene.external_forces * keep,
    )  # fmt: skip


def _case(task: str, scene: SpringScene, system: System) -> Case:
    """Return the scene as a request, with equal numbers where the solver takes a single number."""
    springs = np.asarray(scene.springs, dtype=np.int64).reshape(-1, 2)
    x, v, g = scene.positions, scene.velocities, scene.gravity
    lengths = scene.rest_lengths
    if system.rest_lengths == "measured" or isinstance(lengths, str):
        lengths = _lengths(scene.rest, springs)
    if system.rest_lengths == "one":  # the least, so that nothing buckles
        lengths = np.full(len(springs), np.min(lengths))
    values: dict[str, Any] = {
        "masses": np.full(len(x), ONE_MASS) if system.masses == "one" else scene.masses,
        "springs": springs,
        "rest_lengths": lengths,
        "stiffnesses": _shared(scene.stiffnesses, system.stiffnesses),
        "dampings": _shared(scene.dampings, system.dampings),
        "pinned": np.array(scene.pinned if system.pinned else (), dtype=np.int64),
        "gravity": g if system.gravity == "vector" else g * [0.0, 1.0, 0.0],
        "positions": x,
        "velocities": v,
        "h": scene.h,
        "steps": MOTION_STEPS,
    }
    if system.rest_lengths == "measured":
        values["rest_positions"] = scene.rest
    if system.state == "previous_positions":
        values["previous_positions"] = x - scene.h * v
    if system.external_forces:
        values["external_forces"] = np.zeros_like(x) + scene.external_forces
    if system.tension_only:
        values["tension_only"] = np.full(len(springs), scene.tension_only)
    names = (definition.name for definition in TASKS[task].inputs)
    inputs = {name: values[name] for name in names if name in values}
    facts = {**scene.facts, "probe": scene.probe}
    return Case(scene.name, task, inputs, scene.family, scene.about, scene.follows, facts)


def _shared(values: FloatArray, number: str) -> FloatArray:
    return np.full(len(values), values.mean()) if number == "one" else values


def _lengths(x: FloatArray, springs: Any) -> FloatArray:
    return np.linalg.norm(x[springs[:, 0]] - x[springs[:, 1]], axis=1)


def scenes(seed: int, thorough: bool) -> list[SpringScene]:
    """Return all scenes in their order; the long list has more random cloths."""
    more, base = 12 if thorough else 0, _cloth(seed, 3, name="cloth 3 x 3")
    pair, stiff, zero = (
        [SpringScene(**_fields(_TABLE["pair_defaults"] | entry)) for entry in _TABLE[name]]
        for name in ("pair", "stiff", "zero")
    )
    return [
        *pair,
        *(_random(seed, **entry) for entry in _TABLE["random"]),
        *_changes(seed),
        *(_random(seed, **entry) for entry in _TABLE["small_step"]),
        *stiff,
        *zero,
        base,
        *(_transformed(base, **_fields(entry)) for entry in _TABLE["symmetry"]),
        *(_cloth(seed, **entry) for entry in _TABLE["cloth"]),
        *(_cloth(seed + 1 + i, 3 + i % 3, name=f"random cloth {i}") for i in range(more)),
    ]


def _fields(entry: Mapping[str, Any]) -> dict[str, Any]:
    """Return an entry of the table as fields of a scene."""
    fields: dict[str, Any] = {
        name: np.array(content)
        if isinstance(content, list) and name not in ("needs", "tasks", "methods")
        else content
        for name, content in entry.items()
    }
    if "sentence" in fields:
        fields["about"] = Sentence(fields.pop("sentence"), {})
    return fields


def _random(seed: int, count: int, **entry: Any) -> SpringScene:
    """Return a triangle or a chain of triangles in which every spring has numbers of its own.

    Every third spring is listed from its higher end.
    """
    rng = np.random.default_rng([11, seed, count])
    springs = [(i, j) for i in range(count) for j in range(i + 1, min(i + 3, count))]
    springs[1::3] = [(j, i) for i, j in springs[1::3]]
    rest = np.cumsum(rng.uniform(0.2, 0.4, (count, 3)) * [1.0, -0.6, 0.5], axis=0)
    rest += [0.0, 1.6, 0.0]
    n = len(springs)
    fields: dict[str, Any] = {
        "rest": rest,
        "springs": springs,
        "positions": rest + 0.05 * rng.standard_normal((count, 3)),
        "velocities": rng.standard_normal((count, 3)),
        "masses": rng.uniform(0.4, 2.5, count),
        "stiffnesses": rng.uniform(30.0, 120.0, n),
        "dampings": rng.uniform(0.3, 2.0, n),
        "rest_lengths": _lengths(rest, np.array(springs)) * rng.uniform(0.85, 1.1, n),
        "h": 0.04,
    }
    return _pins_still(SpringScene(**fields | _fields(entry)))


def _pins_still(scene: SpringScene) -> SpringScene:
    v = scene.velocities.copy()
    v[list(scene.pinned)] = 0.0
    return replace(scene, velocities=v)


def _changes(seed: int) -> list[SpringScene]:
    """Return scenes whose requests follow each other."""
    first, second, third = map(_fields, _TABLE["change"])
    before = replace(_random(seed + 1, 3, **first), dampings=np.zeros(3))
    after = replace(before, h=before.h / 2, **second)
    other_masses = replace(
        after, masses=before.masses[::-1] * 1.3, stiffnesses=before.stiffnesses * 2.0, **third
    )
    return [before, after, other_masses]


def _cloth(
    seed: int,
    count: int,
    stiffness: float = 100.0,
    damping: float = 0.2,
    mass: float | None = None,
    squeeze: float | None = None,
    **entry: Any,
) -> SpringScene:
    """Return a moved cloth, with random masses if none is given."""
    rng = np.random.default_rng([12, seed, count])
    system, state = grid_cloth(count, count)
    n, rest = len(system.springs), state.positions
    fields: dict[str, Any] = {
        "family": "cloth",
        "rest": rest,
        "springs": system.springs,
        "positions": rest + 0.02 * rng.standard_normal((count**2, 3)),
        "velocities": 0.5 * rng.standard_normal((count**2, 3)),
        "masses": rng.uniform(0.5, 1.5, count**2),
        "stiffnesses": np.full(n, stiffness),
        "dampings": np.full(n, damping),
        "h": 1 / 60,
        "pinned": system.pinned,
        "probe": False,
        "about": sentence("A moving cloth of {n} x {n} particles.", n=count),
    }
    if mass is not None:
        fields["masses"] = np.full(count**2, mass)
    if squeeze is not None:
        middle = rest.mean(0)
        fields["positions"] = middle + squeeze * (fields["positions"] - middle)
    return _pins_still(SpringScene(**fields | _fields(entry)))


def _transformed(base: SpringScene, name: str, about: Sentence, **changes: Any) -> SpringScene:
    """Return the scene with x -> matrix x + shift; particle i becomes number order[i]."""
    unchanged = {"matrix": np.eye(3), "shift": np.zeros(3), "order": np.arange(len(base.masses))}
    facts = {"of": base.name, **unchanged, **changes}
    matrix, shift, order = (facts[key] for key in unchanged)
    inverse = np.argsort(order)
    return replace(
        base, name=name, family="symmetry", about=about, facts=facts,
        rest=(base.rest @ matrix.T)[inverse] + shift,
        positions=(base.positions @ matrix.T)[inverse] + shift,
        velocities=(base.velocities @ matrix.T)[inverse],
        masses=base.masses[inverse],
        springs=order[np.asarray(base.springs)],
        pinned=order[base.pinned],
    )  # fmt: skip
