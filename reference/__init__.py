"""What is the right answer: readable, validated kinematics and mass-spring dynamics."""

from . import rotation, scenes
from .compiled import speed
from .curve import curves, resample
from .inverse_kinematics import IK_SOLVERS, IKSolution, Outcome, Target, solve_ik
from .kinematics import forward_kinematics, local_from_global
from .skeleton import Pose, Skeleton
from .tracking import track

__all__ = [
    "IK_SOLVERS",
    "IKSolution",
    "Outcome",
    "Pose",
    "Skeleton",
    "Target",
    "curves",
    "forward_kinematics",
    "local_from_global",
    "resample",
    "rotation",
    "scenes",
    "solve_ik",
    "speed",
    "track",
]
