"""The poses and Jacobians of the links of robots and characters, beside an engine's."""

import contextlib
import functools
import math
from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple

import numpy as np

from plumbob.reference import jacobians as jacobians_of
from plumbob.reference import rotation
from plumbob.reference.arguments import FloatArray
from plumbob.reference.kinematics import forward_kinematics
from plumbob.reference.model import Robot

from .. import samples
from ..engines import ROBOT_ENGINES
from ..engines.robot_engine import RobotEngine, UnreadableError
from ..verdict import Comparison
from .models import RobotFile, comparable, moving_joints, random_coordinates

# Random configurations of each robot. A wrong axis or origin shows in any configuration.
CONFIGURATIONS = 5
# Jacobians are compared for a few links at a time, with at most this many numbers in all.
PART = 2**22


class LinkKinematics(NamedTuple):
    """Poses and Jacobians of links in each configuration."""

    positions: FloatArray  # of the links' origins [m], (configuration, link, 3)
    matrices: FloatArray  # their rotations, (configuration, link, 3, 3)
    jacobians: FloatArray  # (configuration, link, 6, freedom)


class Sweep(NamedTuple):
    """A model in random configurations with the engine's kinematics of its links."""

    robot: Robot  # as the reference reads it
    q: FloatArray  # the configurations, (configuration, coordinate)
    links: np.ndarray  # indices of our joints whose links the engine knows
    expected: LinkKinematics  # of those links by the engine
    free_mimics: str  # why mimic joints move independently; empty if they follow their leaders


def sweep_in_parts(engine: str, model: RobotFile, part: float = PART) -> Iterator[Sweep]:
    """Read a model and evaluate it by an engine in random configurations, some links at a time.

    If the reference or the engine refuses the mimic joints, these move independently for both.
    Raise UnreadableError if the engine does not read the file, ValueError if only the reference
    does not.
    """
    try:
        yield from _sweep(engine, model, part)
    except (UnreadableError, ValueError) as error:
        reason = str(error).replace(str(model.path), model.path.name)
        yield from _sweep(engine, model, part, reason)


@functools.cache  # because there are several claims about every model
def sweep(engine: str, model: RobotFile) -> Sweep:
    """Return the sweep of all links; raise as `sweep_in_parts` does."""
    return next(sweep_in_parts(engine, model, np.inf))


def reference_kinematics(robot: Robot, q: FloatArray, links: np.ndarray) -> LinkKinematics:
    """Return the kinematics of some links by the reference, from the indices of their joints."""
    pose = forward_kinematics(robot.articulation, q)
    return LinkKinematics(
        pose.positions[:, links],
        rotation.to_matrix(pose.rotations[:, links]),
        jacobians_of.jacobians(robot.articulation, q, joints=links),
    )


def _sweep(engine: str, model: RobotFile, part: float, free_mimics: str = "") -> Iterator[Sweep]:
    adapter = ROBOT_ENGINES[engine](model.path, mimic=not free_mimics)
    robot = model.read(mimic=not free_mimics)
    articulation = robot.articulation
    q = random_coordinates(articulation, samples.generator(model.name, 0), CONFIGURATIONS)
    matched = [joint for joint, name in enumerate(articulation.names) if name in adapter.links]
    if not matched:
        raise UnreadableError("it gives none of the links its name")
    numbers = len(matched) * CONFIGURATIONS * 6 * articulation.freedom_count
    for links in np.array_split(matched, min(len(matched), math.ceil(numbers / part) or 1)):
        names = [articulation.names[link] for link in links]
        yield Sweep(robot, q, links, _engine_kinematics(adapter, robot, q, names), free_mimics)


def _engine_kinematics(
    adapter: RobotEngine, robot: Robot, q: FloatArray, links: list[str]
) -> LinkKinematics:
    joints = moving_joints(robot)
    freedoms = {joint.name: joint.freedoms.stop - joint.freedoms.start for joint in joints}
    rows = []
    for row in q:
        adapter.update_kinematics({joint.name: row[joint.coordinates] for joint in joints})
        rows.append((*adapter.link_poses(links), adapter.jacobians(links, freedoms)))
    return LinkKinematics(*map(np.array, zip(*rows, strict=True)))


Quantity = Callable[[Sweep, LinkKinematics], Comparison]


def positions(sweep: Sweep, actual: LinkKinematics) -> Comparison:
    """Compare the positions of all links, relative to their extent."""
    zero = _at_zero(sweep).positions
    return Comparison(actual.positions, sweep.expected.positions, zero, extent(actual))


def rotations(sweep: Sweep, actual: LinkKinematics) -> Comparison:
    """Compare the rotation matrices of all links."""
    return Comparison(actual.matrices, sweep.expected.matrices, _at_zero(sweep).matrices, 1.0)


def jacobians(sweep: Sweep, actual: LinkKinematics) -> Comparison:
    """Compare the Jacobians of all links, linear velocities relative to the links' extent."""
    size: FloatArray = np.repeat([extent(actual) or 1.0, 1.0], 3)[:, None]  # of the rows, (6, 1)
    expected = sweep.expected.jacobians / size
    return Comparison(actual.jacobians / size, expected, np.zeros_like(expected), 1.0)


def compare(quantity: Quantity, family: str, engine: str, cases: int) -> Iterator[Comparison]:
    """Yield the comparisons of the first few models, except those that the engine cannot read."""
    for model in comparable(family, engine, moving=quantity is positions)[:cases]:
        with contextlib.suppress(UnreadableError):
            part = sweep(engine, model)
            yield quantity(part, reference_kinematics(part.robot, part.q, part.links))


class Differences(NamedTuple):
    """The largest differences in a model."""

    positions: float  # relative to the extent of the links
    rotations: float  # of matrices
    jacobians: float  # of linear velocities relative to the extent, of angular ones to a radian


def differences(parts: Iterable[Sweep]) -> Differences:
    """Return the largest differences between the reference and the engine in parts of a model."""
    boxes, largest = [], []
    for part in parts:
        actual = reference_kinematics(part.robot, part.q, part.links)
        x, R, J = (np.abs(a - b) for a, b in zip(actual, part.expected, strict=True))
        boxes += [actual.positions.min(axis=(0, 1)), actual.positions.max(axis=(0, 1))]
        largest.append([e.max(initial=0.0) for e in (x, R, J[..., :3, :], J[..., 3:, :])])
    size = np.ptp(boxes, axis=0).max() or 1.0
    position, rotation, linear, angular = np.max(largest, axis=0)
    jacobian = np.maximum(linear / size, angular)
    return Differences(float(position / size), float(rotation), float(jacobian))


def extent(links: LinkKinematics) -> float:
    """Return the largest side of the box around all links in all configurations [m]."""
    return float(np.ptp(links.positions.reshape(-1, 3), axis=0).max())


def _at_zero(sweep: Sweep) -> LinkKinematics:
    """Return the kinematics by the reference with all coordinates at zero."""
    zero = np.tile(sweep.robot.articulation.zero(), (len(sweep.q), 1))
    return reference_kinematics(sweep.robot, zero, sweep.links)
