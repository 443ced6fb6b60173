"""On a line springs are linear: there MuJoCo's discrete is implicit Euler itself."""

from collections.abc import Iterator

import numpy as np

from reference.implicit_euler import ImplicitEuler

from .. import samples
from ..engines.mujoco_joint_chain import JOINTS, MujocoJointChain
from ..verdict import Comparison

STEPS = 100
# What a step is solved to, in terms of its residual: a few roundings.
TOLERANCE = 1e-14


def joint_chains(cases: int) -> Iterator[Comparison]:
    """Compare 100 steps of implicit Euler with those of nested slides and of nested hinges.

    Positions are taken over the largest, velocities likewise.
    """
    for case in range(cases):
        system, state, external, h = samples.line(case)
        integrator = ImplicitEuler(system, h=h, tolerance=TOLERANCE)
        end = state
        for _ in range(STEPS):
            end = integrator.step(end, external).state
        theirs = np.array(
            [
                MujocoJointChain(system, h=h, joint=joint).step(state, external, steps=STEPS)
                for joint in JOINTS
            ]
        )
        scales = np.abs(theirs).max(axis=(0, 2))[:, None]
        ours, still = (np.stack([s.positions[:, 0], s.velocities[:, 0]]) for s in (end, state))
        both = np.ones((len(JOINTS), 1, 1))
        yield Comparison(both * ours / scales, theirs / scales, both * still / scales, scale=1.0)
