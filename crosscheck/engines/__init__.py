"""Our models in other engines, and the translation of all conventions.

Pinocchio has no wheels for Windows: there its claims are not checked.
"""

from importlib.util import find_spec

from .mujoco_mass_spring import MujocoFlex, MujocoJointChain, MujocoMassSpring
from .mujoco_robot import MujocoRobot
from .robot_engine import RobotEngine
from .skeleton_engine import MujocoSkeleton, SkeletonEngine, forward_kinematics_by

ABSENT: dict[str, str] = {}  # why an engine is absent here
SKELETON_ENGINES: dict[str, type[SkeletonEngine]] = {"MuJoCo": MujocoSkeleton}
ROBOT_ENGINES: dict[str, type[RobotEngine]] = {"MuJoCo": MujocoRobot}
if find_spec("pinocchio"):
    from .pinocchio_robot import PinocchioRobot
    from .pinocchio_skeleton import PinocchioSkeleton

    SKELETON_ENGINES = {"Pinocchio": PinocchioSkeleton, **SKELETON_ENGINES}
    ROBOT_ENGINES = {"Pinocchio": PinocchioRobot, **ROBOT_ENGINES}
else:
    ABSENT["Pinocchio"] = "Pinocchio has no wheel here"

__all__ = [
    "ABSENT",
    "ROBOT_ENGINES",
    "SKELETON_ENGINES",
    "MujocoFlex",
    "MujocoJointChain",
    "MujocoMassSpring",
    "MujocoRobot",
    "SkeletonEngine",
    "forward_kinematics_by",
]
