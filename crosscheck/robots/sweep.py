"""A model in random configurations, by the reference and by an engine, each with its own reader."""

import functools
from typing import NamedTuple

import numpy as np

from reference import jacobians, rotation
from reference.arguments import FloatArray
from reference.formats.robot import Robot
from reference.kinematics import forward_kinematics

from .. import samples
from ..engines import ROBOT_ENGINES
from ..engines.robot_engine import RobotEngine, UnreadableError
from .models import Model, draw, slots

CONFIGURATIONS = 5


class Motion(NamedTuple):
    """Where links are, and how they move, in each configuration.

    Attributes:
        positions: of the links' origins [m], (configuration, link, 3).
        matrices: their rotations, (configuration, link, 3, 3).
        jacobians: (configuration, link, 6, freedom).
    """

    positions: FloatArray
    matrices: FloatArray
    jacobians: FloatArray


class Sweep(NamedTuple):
    """A model that both read, and what the engine makes of random configurations.

    Attributes:
        robot: what the reference read.
        q: the configurations, (configuration, coordinate).
        links: the indices of the joints of ours whose links the engine knows.
        theirs: what the engine says of those links.
        free_mimics: why mimic joints move by themselves here; empty if they follow.
    """

    robot: Robot
    q: FloatArray
    links: np.ndarray
    theirs: Motion
    free_mimics: str


def sweep_anew(engine: str, model: Model) -> Sweep:
    """Return a model as an engine sees it, read from its file.

    Where one of both does not take the file's mimic joints, they move by themselves for both.

    Raises:
        UnreadableError: if the engine does not read the file.
        ValueError: if the engine does but the reference does not.
    """
    try:
        return _sweep(engine, model, "")
    except (UnreadableError, ValueError) as error:
        return _sweep(engine, model, str(error).replace(str(model.path), model.path.name))


# The same, kept: several claims are made of every model.
sweep = functools.cache(sweep_anew)


def ours(robot: Robot, q: FloatArray, links: np.ndarray) -> Motion:
    """Return what the reference says of some links, given by the indices of their joints."""
    pose = forward_kinematics(robot.articulation, q)
    return Motion(
        pose.positions[:, links],
        rotation.to_matrix(pose.rotations[:, links]),
        jacobians.jacobians(robot.articulation, q)[:, links],
    )


def _sweep(engine: str, model: Model, free_mimics: str) -> Sweep:
    theirs = ROBOT_ENGINES[engine](model.path, mimic=not free_mimics)
    robot = model.read(mimic=not free_mimics)
    articulation = robot.articulation
    q = draw(articulation, samples.generator(model.name, 0), CONFIGURATIONS)
    known = [j for j, name in enumerate(articulation.names) if name in theirs.links]
    names = [articulation.names[j] for j in known]
    if not known:
        raise UnreadableError("it gives none of the links its name")
    return Sweep(robot, q, np.array(known), _motion(theirs, robot, q, names), free_mimics)


def _motion(engine: RobotEngine, robot: Robot, q: FloatArray, links: list[str]) -> Motion:
    places = slots(robot)
    freedoms = {slot.name: slot.freedoms.stop - slot.freedoms.start for slot in places}
    placements, jacobians = [], []
    for row in q:
        engine.place({slot.name: row[slot.coordinates] for slot in places})
        placements.append(engine.placement(links))
        jacobians.append(engine.jacobians(links, freedoms))
    positions, matrices = (np.array(parts) for parts in zip(*placements, strict=True))
    return Motion(positions, matrices, np.array(jacobians))
