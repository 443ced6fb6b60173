"""The kinematics of peers' engines on the bench's own robots, beside the reference's."""

import importlib
from collections.abc import Iterator, Mapping
from functools import partial

import numpy as np

from plumbob.crosscheck import samples
from plumbob.reference import forward_kinematics, rotation
from plumbob.reference.formats import mjcf, urdf

from ...harness.block import Block, Measured
from ...harness.job import worker_process
from ...harness.worker import Calculation
from ...peers.registry import KINEMATICS, Peer
from ...problems.robots import ALL, is_installed, robot, title
from . import PEERS
from .values import RobotValues

CONFIGURATIONS = 100


def blocks(suite: str) -> Iterator[Block]:
    """Yield every installed robot for every engine that is installed."""
    for name in filter(is_installed, ALL):
        for peer in KINEMATICS:
            if peer.version:
                settings = {"configurations": CONFIGURATIONS, "version": peer.version}
                facts = {"task": PEERS, "title": title(name)}
                measure = partial(beside, peer, name)
                yield Block(suite, f"peers/{name}", peer.title, measure, settings, facts=facts)


def beside(peer: Peer, name: str) -> Measured:
    """Compare in a process of the engine's own; keep what it says where it cannot."""
    outcome = worker_process().perform(Calculation(differences, (peer.module, name)))
    return Measured(outcome.numbers and RobotValues(**outcome.numbers), {"remark": outcome.note})


def differences(module: str, name: str) -> Mapping[str, float]:
    """Return the largest differences of the effectors' positions [m] and rotation matrices."""
    known = robot(name)
    theirs = importlib.import_module(module).kinematics(known)
    articulation = (urdf if known.is_chain else mjcf).parse(known.text).articulation
    effectors = [articulation.names.index(effector) for effector in known.effectors]
    q = known.draw(samples.generator(name, 0), CONFIGURATIONS)
    pose = forward_kinematics(articulation, q)
    positions, rotations = map(np.array, zip(*map(theirs, q), strict=True))
    matrices = rotation.to_matrix(pose.rotations[:, effectors])
    return {
        "positions": float(np.abs(positions - pose.positions[:, effectors]).max()),
        "rotations": float(np.abs(rotations - matrices).max()),
    }
