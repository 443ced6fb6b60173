"""Cases of mass-spring systems, the smallest first, fitted to what a solver takes.

A probe is a small case in which one more aspect of a step matters than in those before it: flight,
a spring, a damper, a pin, a changed h. Faults are sought along the probes.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from plumbob.reference.arguments import FloatArray
from plumbob.reference.scenes.grids import grid_cloth

from ..case import Case
from ..greeting import Greeting, System
from ..sentence import Sentence, sentence
from ..task import TASKS

# In place of the mass 1, which hides what is divided by it.
ONE_MASS = 0.8
MOTION_STEPS = 6


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
    gravity: FloatArray
    h: float
    pinned: tuple[int, ...] = ()
    rest_lengths: FloatArray | None = None
    external_forces: FloatArray | float = 0.0
    tension_only: bool = False
    # attributes of `System` without which it makes no sense: "pinned" and so on
    needs: tuple[str, ...] = ()
    tasks: tuple[str, ...] = ()  # those that it suits; () for all
    follows: str = ""  # the name of the scene that is asked just before it
    probe: bool = False  # whether faults are sought in it
    facts: Mapping[str, Any] = field(default_factory=dict)  # passed on to the laws


def task_cases(task: str, greeting: Greeting, seed: int, thorough: bool) -> list[Case]:
    """Return the cases of a task that suit the solver."""
    system = greeting.system
    suitable = [
        _case(task, scene, system)
        for scene in scenes(seed, thorough)
        if task in (scene.tasks or TASKS) and all(_has(system, need) for need in scene.needs)
    ]
    names = {"", *(case.name for case in suitable)}
    return [case for case in suitable if case.follows in names]


def _has(system: System, need: str) -> bool:
    return system.gravity == "vector" if need == "gravity" else bool(getattr(system, need))


def _case(task: str, scene: SpringScene, system: System) -> Case:
    """Return the scene as a request, with one value for all where the solver has but one."""
    springs = np.asarray(scene.springs, dtype=np.int64).reshape(-1, 2)
    x, v, g = scene.positions, scene.velocities, scene.gravity
    measured = system.rest_lengths == "measured" or scene.rest_lengths is None
    values: dict[str, Any] = {
        "masses": np.full(len(x), ONE_MASS) if system.masses == "one" else scene.masses,
        "springs": springs,
        "rest_lengths": _lengths(scene.rest, springs) if measured else scene.rest_lengths,
        "stiffnesses": _shared(scene.stiffnesses, system.stiffnesses),
        "dampings": _shared(scene.dampings, system.dampings),
        "pinned": np.array(scene.pinned if system.pinned else (), dtype=np.int64),
        "gravity": g if system.gravity == "vector" else np.array([0.0, -np.linalg.norm(g), 0.0]),
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
    inputs = {one.name: values[one.name] for one in TASKS[task].inputs if one.name in values}
    facts = {**scene.facts, "probe": scene.probe}
    return Case(scene.name, task, inputs, scene.family, scene.about, scene.follows, facts)


def _shared(values: FloatArray, how: str) -> FloatArray:
    return np.full(len(values), values.mean()) if how == "one" else values


def _lengths(x: FloatArray, springs: Any) -> FloatArray:
    return np.linalg.norm(x[springs[:, 0]] - x[springs[:, 1]], axis=1)


def scenes(seed: int, thorough: bool) -> list[SpringScene]:
    """Return all scenes in their order; the long list has more random cloths."""
    found = [*_particles(), *_small(seed), *_changes(seed), *_cloths(seed)]
    if thorough:
        found += [_cloth_scene(f"random cloth {i}", seed + 1 + i, 3 + i % 3) for i in range(12)]
    return found


G = np.array([0.0, -9.81, 0.0])
PAIR = np.array([[0.1, 1.5, 0.0], [0.55, 1.3, 0.3]])
PAIR_AT_REST = np.array([[0.1, 1.5, 0.0], [0.5, 1.5, 0.2]])
PAIR_COMPRESSED = np.array([[0.18, 1.52, 0.03], [0.45, 1.51, 0.18]])
PAIR_VELOCITIES = np.array([[0.6, -0.4, 0.2], [-0.5, 1.1, 0.9]])
PAIR_MASSES = np.array([0.7, 1.9])
HEIGHT = np.array([0.0, 1.6, 0.0])
STEPS = ("mass_spring_step", "mass_spring_motion")


def _pair(name: str, family: str, about: Sentence, **changes: Any) -> SpringScene:
    """Return two particles with one spring, moving and stretched."""
    scene = SpringScene(
        name, family, about, PAIR_AT_REST, [(0, 1)], PAIR, PAIR_VELOCITIES, PAIR_MASSES,
        np.array([60.0]), np.array([0.0]), G, 0.05, probe=True,
    )  # fmt: skip
    return replace(scene, **changes)


def _particles() -> list[SpringScene]:
    """Return the scenes of one spring."""
    hanging = {"velocities": PAIR_VELOCITIES * [[0.0], [1.0]], "pinned": (0,), "needs": ("pinned",)}
    damped = {"dampings": np.array([1.5])}
    return [
        _pair("two particles in flight", "flight", sentence(
            "Two particles fly freely: the spring between them has no stiffness."),
            stiffnesses=np.array([0.0])),
        _pair("one spring", "springs", sentence("One stretched spring, both ends moving.")),
        _pair("one spring at rest", "rest", sentence(
            "One spring at its rest length, without gravity: nothing moves."),
            positions=PAIR_AT_REST, velocities=np.zeros((2, 3)), gravity=np.zeros(3), probe=False),
        _pair("one spring, compressed", "springs", sentence(
            "One spring a third shorter than at rest."), positions=PAIR_COMPRESSED),
        _pair("one damped spring", "dampers", sentence(
            "One stretched spring with a damper, both ends moving."), **damped),
        _pair("pendulum", "pins", sentence(
            "One particle hangs from a pinned one by a spring."), **hanging),
        _pair("damped pendulum", "pins", sentence(
            "One particle hangs from a pinned one by a damped spring."), **hanging, **damped),
    ]  # fmt: skip


def _random(
    name: str, family: str, about: Sentence, seed: int, n: int, **changes: Any
) -> SpringScene:
    """Return a triangle or a chain of triangles with values of its own for each spring."""
    rng = np.random.default_rng([11, seed, n])
    springs = [(i, j) for i in range(n) for j in range(i + 1, min(i + 3, n))]
    rest = np.cumsum(rng.uniform(0.2, 0.4, (n, 3)) * [1.0, -0.6, 0.5], axis=0) + HEIGHT
    s = len(springs)
    scene = SpringScene(
        name, family, about, rest, springs,
        rest + 0.05 * rng.standard_normal((n, 3)), rng.standard_normal((n, 3)),
        rng.uniform(0.4, 2.5, n), rng.uniform(30.0, 120.0, s), rng.uniform(0.3, 2.0, s), G, 0.04,
        rest_lengths=_lengths(rest, np.array(springs)) * rng.uniform(0.85, 1.1, s), probe=True,
    )  # fmt: skip
    return _pins_still(replace(scene, **changes))


def _pins_still(scene: SpringScene) -> SpringScene:
    v = scene.velocities.copy()
    v[list(scene.pinned)] = 0.0
    return replace(scene, velocities=v)


def _small(seed: int) -> list[SpringScene]:
    slack = np.array([[0, 1, 0], [0.2, 0.9, 0.1], [0.7, 0.7, 0.2], [0.8, 0.6, 0.5]])
    loads = np.array([[1.0, 2.0, -3.0], [-4.0, 1.0, 2.0], [3.0, -1.0, 1.0]])
    return [
        _random("three particles", "dampers", sentence(
            "Three damped springs between three particles, all different."), seed, 3),
        _random("three particles, two pinned", "pins", sentence(
            "Three damped springs, the first and the last particle pinned."), seed, 3,
            pinned=(0, 2), needs=("pinned",)),
        _random("oblique gravity", "gravity", sentence(
            "Gravity in a direction of its own."), seed, 3,
            gravity=np.array([2.0, -5.0, 3.0]), needs=("gravity",)),
        _random("external forces", "external forces", sentence(
            "A force of its own on each particle."), seed, 3,
            external_forces=loads, needs=("external_forces",), tasks=STEPS),
        _random("slack springs", "tension only", sentence(
            "Springs that resist no compression, some of them slack."), seed, 4,
            tension_only=True, positions=slack, needs=("tension_only",), tasks=STEPS),
        _random("rope of five", "pins", sentence(
            "Five particles on a string, the first one pinned, undamped."), seed, 5,
            springs=[(0, 1), (1, 2), (2, 3), (3, 4)], stiffnesses=np.full(4, 300.0),
            dampings=np.zeros(4), rest_lengths=None, pinned=(0,), needs=("pinned",), h=1 / 60),
    ]  # fmt: skip


def _changes(seed: int) -> list[SpringScene]:
    """Return scenes that are asked one after another, and those for small h."""
    before = _random(
        "before h changes", "h changes", sentence("Three particles, the step before h changes."),
        seed + 1, 3, tasks=STEPS, dampings=np.zeros(3),
    )  # fmt: skip
    after = replace(
        before, name="h changed", about=sentence("The same three particles with half the h."),
        h=before.h / 2, follows=before.name,
    )  # fmt: skip
    again = replace(
        before, name="masses changed", family="system changes",
        about=sentence("The same three particles with other masses and springs."),
        masses=before.masses[::-1] * 1.3, stiffnesses=before.stiffnesses * 2.0,
        h=before.h / 2, follows=after.name,
    )  # fmt: skip
    small = _random(
        "small h", "small h",
        sentence("A step so small that every model comes to the acceleration f / m."),
        seed, 3, h=1e-3, tasks=("mass_spring_step",), facts={"consistent": True}, probe=False,
    )  # fmt: skip
    return [before, after, again, small]


def _cloth_scene(
    name: str, seed: int, n: int, stiffness: float = 100.0, damping: float = 0.2, **changes: Any
) -> SpringScene:
    """Return a moved cloth of n x n particles."""
    rng = np.random.default_rng([12, seed, n])
    system, state = grid_cloth(n, n)
    s = len(system.springs)
    scene = SpringScene(
        name, "cloth", sentence("A moving cloth of {n} x {n} particles.", n=n),
        state.positions, system.springs,
        state.positions + 0.02 * rng.standard_normal((n * n, 3)),
        0.5 * rng.standard_normal((n * n, 3)), rng.uniform(0.5, 1.5, n * n),
        np.full(s, stiffness), np.full(s, damping), G, 1 / 60,
        pinned=tuple(int(i) for i in system.pinned),
    )  # fmt: skip
    return _pins_still(replace(scene, **changes))


def _cloths(seed: int) -> list[SpringScene]:
    base, crumpled = (_cloth_scene(name, seed, 3) for name in ("cloth 3 x 3", "crumpled cloth"))
    middle = crumpled.rest.mean(0)
    return [
        base,
        *_symmetries(base),
        _cloth_scene("free net", seed, 4, damping=0.0, pinned=(), family="momentum", about=sentence(
            "A net of 4 x 4 particles that nothing holds.")),
        _cloth_scene("damped cloth", seed, 4, damping=2.0),
        replace(crumpled, family="compression", stiffnesses=10.0 * crumpled.stiffnesses,
                positions=middle + 0.6 * (crumpled.positions - middle), about=sentence(
                    "A cloth squeezed to 0.6 of its size, stiff enough to buckle.")),
        _cloth_scene("the lab's cloth, small", seed, 5, gravity=np.array([0.0, -0.3, 0.0]),
                     masses=np.ones(25)),
        _cloth_scene("stiff cloth", seed, 5, stiffness=1e4, damping=0.0),
    ]  # fmt: skip


def _symmetries(base: SpringScene) -> list[SpringScene]:
    """Return the scene moved, mirrored, rotated about the vertical, and with other numbers."""
    c, s = 0.6, 0.8
    mirror = np.diag([1.0, 1.0, -1.0])
    rotation = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    order = np.random.default_rng(5).permutation(len(base.masses))
    return [
        _transformed(base, "shifted", sentence("The same cloth elsewhere."),
                     shift=np.array([0.5, -0.25, 0.75])),
        _transformed(base, "mirrored", sentence("The same cloth in a mirror."), matrix=mirror),
        _transformed(base, "rotated", sentence("The same cloth, rotated about the vertical."),
                     matrix=rotation),
        _transformed(base, "renumbered", sentence("The same cloth, its particles renumbered."),
                     order=order),
    ]  # fmt: skip


def _transformed(base: SpringScene, name: str, about: Sentence, **changes: Any) -> SpringScene:
    """Return the scene with x -> matrix x + shift; particle i becomes number order[i]."""
    unchanged = {"matrix": np.eye(3), "shift": np.zeros(3), "order": np.arange(len(base.masses))}
    facts = {"of": base.name, **unchanged, **changes}
    matrix, shift, order = (facts[key] for key in unchanged)
    place = np.argsort(order)
    return replace(
        base,
        name=name,
        family="symmetry",
        about=about,
        rest=(base.rest @ matrix.T)[place] + shift,
        positions=(base.positions @ matrix.T)[place] + shift,
        velocities=(base.velocities @ matrix.T)[place],
        masses=base.masses[place],
        springs=order[np.asarray(base.springs)],
        pinned=tuple(int(order[i]) for i in base.pinned),
        facts=facts,
    )
