"""The public names of Plumbob; `python -m plumbob` is the command line.

The names are imported when the first of them is used, so that the command line starts at once. On a
terminal a line on stderr says what is compiled, once it takes more than a second.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Any

# Git on Windows may write the links to `reference` and other rooms as text files.
if Path(__file__).with_name("reference").is_file():
    __path__.append(str(Path(__file__).parents[1]))

if TYPE_CHECKING:
    from .reference import *
    from .reference import formats, jacobians, mass_spring

    __version__: str

__all__ = [
    "IK_SOLVERS",
    "STEP_SOLVERS",
    "Articulation",
    "Certificate",
    "Coverage",
    "IKCertificate",
    "IKCoverage",
    "IKSolution",
    "IKSolutions",
    "ImplicitEuler",
    "MassSpring",
    "Mimic",
    "Outcome",
    "Pose",
    "PoseJudgement",
    "PreparedIK",
    "PreparedKinematics",
    "PreparedSolutions",
    "PreparedTasks",
    "Skeleton",
    "State",
    "StepJudgement",
    "StepResult",
    "Target",
    "TaskSolution",
    "__version__",
    "all_solutions",
    "certify_ik",
    "curves",
    "formats",
    "forward_kinematics",
    "jacobians",
    "judge_pose",
    "judge_step",
    "local_from_global",
    "mass_spring",
    "prepare",
    "prepare_all_solutions",
    "prepare_ik",
    "prepare_tasks",
    "resample",
    "rotation",
    "runge_kutta",
    "scenes",
    "set_backend",
    "set_num_threads",
    "solve_ik",
    "solve_tasks",
    "symplectic_euler",
    "tasks",
    "track",
]


def __getattr__(name: str) -> Any:
    """Import the public names, all at once (PEP 562)."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    if name == "__version__":
        from importlib.metadata import version

        return version("plumbob")
    from . import compile_notice, reference
    from .reference import formats, jacobians, mass_spring

    compile_notice.install()
    names = {"formats": formats, "jacobians": jacobians, "mass_spring": mass_spring}
    names |= {public: getattr(reference, public) for public in reference.__all__}
    globals().update(names)
    return names[name]


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
