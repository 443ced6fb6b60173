"""The records of the lab's arm: curves to draw, and targets beyond reach."""

from ...harness.values import Floats1, Integers1
from ..chain.values import ChainSolves, SolveWords
from . import BEYOND, CURVE


class FollowedMotion(SolveWords, frozen=True):
    """A motion along a curve, (frame,): an outcome is the number of an `Outcome`.

    The angles are the rotations of joints from each frame to the next [rad].
    """

    residual: Floats1
    iterations: Integers1
    outcome: Integers1
    largest_angle: Floats1
    mean_angle: Floats1


KINDS = {CURVE: FollowedMotion, BEYOND: ChainSolves}
