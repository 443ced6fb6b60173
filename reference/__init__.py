"""Right answers: readable, validated kinematics and mass-spring dynamics."""

from . import rotation, scenes
from .articulation import Articulation, Mimic
from .backend.compiled import set_backend
from .backend.threads import set_num_threads
from .curve import curves, resample
from .explicit import runge_kutta, symplectic_euler
from .implicit_euler import STEP_SOLVERS, ImplicitEuler, StepResult
from .implicit_euler.certificate import Certificate, Coverage
from .inverse_kinematics import (
    IK_SOLVERS,
    IKSolution,
    IKSolutions,
    Target,
    all_solutions,
    solve_ik,
    tasks,
)
from .inverse_kinematics.branches import PreparedSolutions, prepare_all_solutions
from .inverse_kinematics.certificate import IKCertificate, IKCoverage, certify_ik
from .inverse_kinematics.prepared import PreparedIK, prepare_ik
from .inverse_kinematics.solve_tasks import PreparedTasks, TaskSolution, prepare_tasks, solve_tasks
from .judging import PoseJudgement, StepJudgement, judge_pose, judge_step
from .kinematics import PreparedKinematics, forward_kinematics, local_from_global, prepare
from .mass_spring import MassSpring, State
from .outcome import Outcome
from .skeleton import Pose, Skeleton
from .tracking import track

__all__ = [
    "IK_SOLVERS", "STEP_SOLVERS", "Articulation", "Certificate", "Coverage", "IKCertificate",
    "IKCoverage", "IKSolution", "IKSolutions", "ImplicitEuler", "MassSpring", "Mimic", "Outcome",
    "Pose", "PoseJudgement", "PreparedIK", "PreparedKinematics", "PreparedSolutions",
    "PreparedTasks", "Skeleton", "State", "StepJudgement", "StepResult", "Target", "TaskSolution",
    "all_solutions", "certify_ik", "curves", "forward_kinematics", "judge_pose", "judge_step",
    "local_from_global", "prepare", "prepare_all_solutions", "prepare_ik", "prepare_tasks",
    "resample", "rotation", "runge_kutta", "scenes", "set_backend", "set_num_threads", "solve_ik",
    "solve_tasks", "symplectic_euler", "tasks", "track",
]  # fmt: skip
