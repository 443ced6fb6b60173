"""Our models as the engines see them; every convention is translated here and nowhere else."""

from .mujoco_engine import MujocoMassSpring, MujocoSkeleton
from .pinocchio_engine import PinocchioSkeleton
from .skeleton_engine import SkeletonEngine, forward_kinematics_by

SKELETON_ENGINES: dict[str, type[SkeletonEngine]] = {
    "Pinocchio": PinocchioSkeleton,
    "MuJoCo": MujocoSkeleton,
}

__all__ = [
    "SKELETON_ENGINES",
    "MujocoMassSpring",
    "MujocoSkeleton",
    "PinocchioSkeleton",
    "SkeletonEngine",
    "forward_kinematics_by",
]
