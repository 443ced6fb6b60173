"""Chains on a line, where springs are linear and MuJoCo's discrete equals implicit Euler."""

import numpy as np

from .. import samples
from ..engines.mujoco_joint_chain import JOINTS, MujocoJointChain
from ..verdict import Comparison
from .integrators import implicit

STEPS = 100
# Residual of a step: a few rounding errors.
TOLERANCE = 1e-14


def joint_chains(case: int) -> Comparison:
    """Compare 100 steps of implicit Euler with those of nested slides and of nested hinges.

    Positions and velocities are relative to the largest of each.
    """
    system, state, external, h = samples.line(case)
    end = implicit("newton", system, h, tolerance=TOLERANCE)(state, external, STEPS)
    chains = [MujocoJointChain(system, h=h, joint=joint) for joint in JOINTS]
    theirs = np.array([chain.step(state, external, steps=STEPS) for chain in chains])
    scales = np.abs(theirs).max(axis=(0, 2))[:, None]
    ours, start = (
        np.tile([s.positions[:, 0], s.velocities[:, 0]], (len(JOINTS), 1, 1)) for s in (end, state)
    )
    return Comparison(ours / scales, theirs / scales, start / scales, scale=1.0)
