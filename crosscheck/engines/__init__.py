"""Our models in other engines, and the translation of all conventions."""

from .mujoco_flex import MujocoFlex
from .mujoco_joint_chain import MujocoJointChain
from .mujoco_mass_spring import MujocoMassSpring
from .mujoco_robot import MujocoRobot
from .mujoco_skeleton import MujocoSkeleton
from .pinocchio_engine import PinocchioSkeleton
from .pinocchio_robot import PinocchioRobot
from .robot_engine import RobotEngine
from .skeleton_engine import SkeletonEngine, forward_kinematics_by

SKELETON_ENGINES: dict[str, type[SkeletonEngine]] = {
    "Pinocchio": PinocchioSkeleton,
    "MuJoCo": MujocoSkeleton,
}

ROBOT_ENGINES: dict[str, type[RobotEngine]] = {
    "Pinocchio": PinocchioRobot,
    "MuJoCo": MujocoRobot,
}

__all__ = [
    "ROBOT_ENGINES",
    "SKELETON_ENGINES",
    "MujocoFlex",
    "MujocoJointChain",
    "MujocoMassSpring",
    "MujocoRobot",
    "MujocoSkeleton",
    "PinocchioRobot",
    "PinocchioSkeleton",
    "RobotEngine",
    "SkeletonEngine",
    "forward_kinematics_by",
]
