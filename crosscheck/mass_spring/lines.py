"""Chains on a line, where springs are linear and MuJoCo's discrete equals implicit Euler."""

import numpy as np

from plumbob.reference.implicit_euler import ImplicitEuler

from .. import samples
from ..engines.mujoco_joint_chain import JOINTS, MujocoJointChain
from ..verdict import Comparison

STEPS = 100
# Residual of a step: a few rounding errors.
TOLERANCE = 1e-14


def joint_chains(case: int) -> Comparison:
    """Compare 100 steps of implicit Euler with those of nested slides and of nested hinges.

    Positions and velocities are relative to the largest of each.
    """
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
    ours, start = (
        np.tile([s.positions[:, 0], s.velocities[:, 0]], (len(JOINTS), 1, 1)) for s in (end, state)
    )
    return Comparison(ours / scales, theirs / scales, start / scales, scale=1.0)
