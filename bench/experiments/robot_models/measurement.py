"""Files of others in both engines, and the bench's own robots in engines of peers."""

import importlib
from collections.abc import Iterator, Mapping
from functools import partial

import numpy as np

from plumbob.crosscheck import samples
from plumbob.crosscheck.engines import ROBOT_ENGINES
from plumbob.crosscheck.engines.robot_engine import UnreadableError
from plumbob.crosscheck.robots.comparisons import CONFIGURATIONS, differences, sweep
from plumbob.crosscheck.robots.models import CAUSES, PACKAGES, RobotFile, models, moving_joints
from plumbob.reference import forward_kinematics, rotation
from plumbob.reference.formats import mjcf, urdf

from ...harness.block import Block, Measured, Scale
from ...harness.isolation import Calculation, worker_process
from ...peers.catalogue import KINEMATICS
from ...peers.peer import Peer
from ...problems.robots import ROBOTS, is_installed, robot, title
from . import PEERS

SUITE = "robot_models"
ROBOT_CONFIGURATIONS = 100


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield every installed file for every engine, and every installed robot for every peer's."""
    settings: dict[str, int | str] = {"configurations": CONFIGURATIONS}
    for family in PACKAGES:
        for model in models(family):
            for engine in ROBOT_ENGINES:
                measure = partial(compare, engine, model)
                facts = {"title": model.name}
                yield Block(SUITE, f"{family}/{model.name}", engine, measure, settings, facts=facts)
    for name in filter(is_installed, ROBOTS):
        for peer in (peer for peer in KINEMATICS if peer.version):
            settings = {"configurations": ROBOT_CONFIGURATIONS, "version": peer.version}
            facts = {"task": PEERS, "title": title(name)}
            measure = partial(compare_effectors, peer, name)
            yield Block(SUITE, f"peers/{name}", peer.title, measure, settings, facts=facts)


def compare(engine: str, model: RobotFile) -> Measured:
    """Compare a file in random configurations; keep why the engine refuses the file."""
    try:
        comparison = sweep(engine, model)
    except (UnreadableError, ValueError) as error:
        reason = f"{engine} reads it, the reference does not"
        if isinstance(error, UnreadableError):
            reason = f"{engine} does not read it"
        sentence = f"{reason}: {error}".replace(str(model.path), model.path.name)
        return {"unread": sentence}
    articulation = comparison.robot.articulation
    joints = len(moving_joints(comparison.robot)) + len(articulation.mimics)
    sizes = (len(comparison.links), joints, articulation.freedom_count)
    return {
        **dict(zip(("links", "joints", "freedoms"), sizes, strict=True)),
        **differences([comparison])._asdict(),
        "cause": CAUSES.get((engine, model.name), ""),
        "free_mimics": comparison.free_mimics,
    }


def compare_effectors(peer: Peer, name: str) -> Measured:
    """Compare a robot in a process of the engine's own; keep why the engine refuses the robot."""
    outcome = worker_process().perform(Calculation(effector_differences, (peer.module, name)))
    return {**(outcome.numbers or {}), "remark": outcome.note}


def effector_differences(module: str, name: str) -> Mapping[str, float]:
    """Return the largest differences of the effectors' positions [m] and rotation matrices."""
    model = robot(name)
    kinematics = importlib.import_module(module).kinematics(model)
    articulation = (urdf if model.is_chain else mjcf).parse(model.text).articulation
    effectors = [articulation.names.index(effector) for effector in model.effectors]
    q = model.draw(samples.generator(name, 0), ROBOT_CONFIGURATIONS)
    pose = forward_kinematics(articulation, q)
    transforms = np.reshape([*map(kinematics, q)], (len(q), len(effectors), 4, 4))
    matrices = rotation.to_matrix(pose.rotations[:, effectors])
    return {
        "positions": float(np.abs(transforms[..., :3, 3] - pose.positions[:, effectors]).max()),
        "rotations": float(np.abs(transforms[..., :3, :3] - matrices).max()),
    }
