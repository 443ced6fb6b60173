"""Our models in other engines, and the translation of all conventions."""

from .mujoco_mass_spring import MujocoFlex, MujocoJointChain, MujocoMassSpring
from .mujoco_robot import MujocoRobot
from .pinocchio_robot import PinocchioRobot
from .pinocchio_skeleton import PinocchioSkeleton
from .robot_engine import RobotEngine
from .skeleton_engine import MujocoSkeleton, SkeletonEngine, forward_kinematics_by

SKELETON_ENGINES: dict[str, type[SkeletonEngine]] = {
    "Pinocchio": PinocchioSkeleton,
    "MuJoCo": MujocoSkeleton,
}
ROBOT_ENGINES: dict[str, type[RobotEngine]] = {"Pinocchio": PinocchioRobot, "MuJoCo": MujocoRobot}

__all__ = [
    "ROBOT_ENGINES",
    "SKELETON_ENGINES",
    "MujocoFlex",
    "MujocoJointChain",
    "MujocoMassSpring",
    "MujocoRobot",
    "SkeletonEngine",
    "forward_kinematics_by",
]
