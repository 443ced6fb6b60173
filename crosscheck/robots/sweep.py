"""A model in random configurations, read and evaluated by the reference and by an engine."""

import functools
import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from plumbob.reference import jacobians, rotation
from plumbob.reference.arguments import FloatArray
from plumbob.reference.formats.robot import Robot
from plumbob.reference.kinematics import forward_kinematics

from .. import samples
from ..engines import ROBOT_ENGINES
from ..engines.robot_engine import RobotEngine, UnreadableError
from .models import Model, random_coordinates, slots

CONFIGURATIONS = 5
# Jacobians are compared for so many links at a time that they hold at most this many numbers.
PART = 2**22


class LinkKinematics(NamedTuple):
    """Poses and Jacobians of links in each configuration.

    Attributes:
        positions: of the links' origins [m], (configuration, link, 3).
        matrices: their rotations, (configuration, link, 3, 3).
        jacobians: (configuration, link, 6, freedom).
    """

    positions: FloatArray
    matrices: FloatArray
    jacobians: FloatArray


class Sweep(NamedTuple):
    """A model in random configurations with the engine's kinematics of its links.

    Attributes:
        robot: the model as the reference reads it.
        q: the configurations, (configuration, coordinate).
        links: indices of our joints whose links the engine knows.
        theirs: the engine's kinematics of those links.
        free_mimics: why mimic joints move independently here; empty if they follow their leaders.
    """

    robot: Robot
    q: FloatArray
    links: np.ndarray
    theirs: LinkKinematics
    free_mimics: str


def sweep_in_parts(engine: str, model: Model, part: float = PART) -> Iterator[Sweep]:
    """Read a model and evaluate it by an engine in random configurations, some links at a time.

    If the reference or the engine refuses the mimic joints, these move independently for both.

    Raises:
        UnreadableError: if the engine does not read the file.
        ValueError: if only the reference does not read it.
    """
    try:
        yield from _sweep(engine, model, part)
    except (UnreadableError, ValueError) as error:
        reason = str(error).replace(str(model.path), model.path.name)
        yield from _sweep(engine, model, part, reason)


@functools.cache  # because there are several claims about every model
def sweep(engine: str, model: Model) -> Sweep:
    """Return the sweep of all links; raise as `sweep_in_parts` does."""
    return next(sweep_in_parts(engine, model, np.inf))


def reference_kinematics(robot: Robot, q: FloatArray, links: np.ndarray) -> LinkKinematics:
    """Return the kinematics of some links by the reference, from the indices of their joints."""
    pose = forward_kinematics(robot.articulation, q)
    return LinkKinematics(
        pose.positions[:, links],
        rotation.to_matrix(pose.rotations[:, links]),
        jacobians.jacobians(robot.articulation, q, joints=links),
    )


def _sweep(engine: str, model: Model, part: float, free_mimics: str = "") -> Iterator[Sweep]:
    theirs = ROBOT_ENGINES[engine](model.path, mimic=not free_mimics)
    robot = model.read(mimic=not free_mimics)
    articulation = robot.articulation
    q = random_coordinates(articulation, samples.generator(model.name, 0), CONFIGURATIONS)
    known = [j for j, name in enumerate(articulation.names) if name in theirs.links]
    if not known:
        raise UnreadableError("it gives none of the links its name")
    numbers = len(known) * CONFIGURATIONS * 6 * articulation.freedom_count
    for links in np.array_split(known, min(len(known), math.ceil(numbers / part) or 1)):
        names = [articulation.names[j] for j in links]
        yield Sweep(robot, q, links, _kinematics(theirs, robot, q, names), free_mimics)


def _kinematics(
    engine: RobotEngine, robot: Robot, q: FloatArray, links: list[str]
) -> LinkKinematics:
    joints = slots(robot)
    freedoms = {slot.name: slot.freedoms.stop - slot.freedoms.start for slot in joints}
    poses, jacobians = [], []
    for row in q:
        engine.update_kinematics({slot.name: row[slot.coordinates] for slot in joints})
        poses.append(engine.link_poses(links))
        jacobians.append(engine.jacobians(links, freedoms))
    positions, matrices = (np.array(parts) for parts in zip(*poses, strict=True))
    return LinkKinematics(positions, matrices, np.array(jacobians))
