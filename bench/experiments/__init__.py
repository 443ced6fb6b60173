"""What is measured: a suite is a list of blocks, each of which makes one record."""

import importlib
from collections.abc import Iterator

from ..harness.block import SCALES, Block, Measured, Scale

__all__ = ["SCALES", "SUITES", "Block", "Measured", "Scale", "blocks"]

# Name and what it answers, in the order of the report.
SUITES = {
    "check": "the reference against Pinocchio and MuJoCo, claim by claim",
    "robot_models": "robots and characters from files of others, beside both engines",
    "arm": "the lab's arm on every curve, and reaching for what is too far",
    "tracking": "closed curves: frames from rest, from the last solution, and coherently",
    "ik": "a chain of ten ball joints, robots and a character, beside every solver installed",
    "cloth": "the lab's cloth at three stiffnesses: convergence; one cloth for every solver",
    "energy": "what integrators do to the energy of a cloth over 10,000 steps",
    "newton": "one step of a heavy cloth by every solver: how far from a minimiser, proven",
    "cloth_scale": "cloths of a thousand particles and more: factors, solves, memory",
    "timing": "forward kinematics, solves and steps beside both engines",
    "first_call": "the first call of each public function, with nothing compiled yet",
    "pictures": "the poses and cloths that the report draws",
}

# The folders of suites that are called otherwise.
FOLDERS = {"ik": "chain", "tracking": "closed_curves"}


def blocks(suite: str, scale: Scale) -> Iterator[Block]:
    """Yield the blocks of a suite; engines are imported only now.

    Raises:
        KeyError: if there is no such suite.
    """
    if suite not in SUITES:
        raise KeyError(suite)
    folder = FOLDERS.get(suite, suite)
    yield from importlib.import_module(f".{folder}.measurement", __package__).blocks(scale)
