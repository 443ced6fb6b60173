"""Inverse kinematics: local rotations or coordinates that bring effectors to targets.

The route of a call: `solve_ik` checks settings, model and targets; `solve.py` hands them to the
kernel of a solver, which stands at the end of its file (`fabrik.py`, `ccd.py`, `jacobian.py`,
`levenberg_marquardt.py`). The kernel prepares a chain or a mechanism (`chain.py`,
`solve_mechanism.py`). From each start the loops of `restarts.py` call the solver's sweep or update.
"""

from collections.abc import Sequence

from numpy.typing import ArrayLike

from ..model import Model, checked_model
from ..outcome import Outcome
from .branches import IKSolutions, all_solutions
from .nearest import nearest_solution
from .problem import (
    IK_SOLVERS,
    RESTARTS,
    IKSolution,
    Target,
    checked_settings,
    checked_targets,
    default_solver,
)
from .solve import solve_checked, solve_plain

__all__ = [
    "IK_SOLVERS", "RESTARTS", "IKSolution", "IKSolutions", "Outcome", "Target", "all_solutions",
    "solve_ik",
]  # fmt: skip


def solve_ik(
    skeleton: Model,
    local_rotations: ArrayLike,
    target: ArrayLike | Target | Sequence[Target],
    solver: str | None = None,
    effector: int | str | None = None,
    *,
    tolerance: float = 1e-4,
    tolerance_rotation: float = 1e-4,
    max_iterations: int | None = None,
    restarts: int | None = None,
    phases: int | None = None,
    seed: int = 0,
    record: bool = False,
    prefer: str | None = None,
) -> IKSolution:
    """Return the pose that brings effectors to targets, from a start pose.

    The root of a Skeleton rotates but does not move. Joints that move no effector keep their
    rotation; so does an effector whose own rotation is free. A pose is always returned; `outcome`
    says how the solve ended. A stuck start, like a straight chain collinear with its target, is
    first bent, always alike. All joints keep their limits, also joints that move no effector; a
    start outside its limits is brought within.

    On limited joints Levenberg-Marquardt is a fixed portfolio of phases without random numbers.
    More restarts never give a worse answer: a reached target stays reached, and the merit of a
    missed target can only fall. A failed solve is UNREACHABLE only where geometry, limits included,
    proves the target out of reach. docs/inverse_kinematics.md explains all three.

    Args:
        skeleton: the tree; an Articulation for joints of other kinds and for limits, or a Robot
            read from a file.
        local_rotations: the start, unit quaternions, shape (..., joint, 4); of an Articulation its
            coordinates q, (..., coordinate).
        target: global position [m], shape (..., 3), a Target, or several for several effectors.
            Leading axes broadcast with the start's: a batch.
        solver: a name in IK_SOLVERS; by default FABRIK for one position on a Skeleton, else
            Levenberg-Marquardt.
        effector: the joint that is to reach a bare position, by index or name. By
            default the last joint of a Skeleton, and the only tip of an Articulation.
        tolerance: distance that counts as reached [m].
        tolerance_rotation: angle that counts as reached [rad].
        max_iterations: of each attempt over all its phases; by default 100, but 2,000 where
            geometry proves the target out of reach, so that most solves settle.
        restarts: number of further attempts from random poses, made until one reaches the target.
            By default 20 where the solver is the default Levenberg-Marquardt, 100 with several
            effectors, else 0.
        phases: of Levenberg-Marquardt on joints, at most, 1 to 8; by default all. With `phases=1`
            several effectors are redrawn together. Other solvers have one phase.
        seed: of the random poses.
        record: keep the residuals of all iterations in `history`.
        prefer: "nearest" for the solution with the least sum of squared displacements from the
            start; "nearest_linf" for the least largest displacement of a freedom [rad or m].
            Candidates are `all_solutions`, the start and all restarts; for a single start and
            target of an Articulation.

    Raises:
        ValueError: if an argument has another shape or is not finite, a quaternion is further than
            1e-6 from unit length, a number is out of range, or a name is unknown. Also if an
            Articulation has several tips and no effector is named.
    """
    if solver is None:
        solver, default_restarts = default_solver(skeleton, target)
        restarts = default_restarts if restarts is None else restarts
    settings = checked_settings(
        solver, tolerance, tolerance_rotation, max_iterations,
        0 if restarts is None else restarts, seed, record, phases,
    )  # fmt: skip
    model = checked_model(skeleton)
    if prefer is None:
        plain = solve_plain(model, local_rotations, target, effector, settings)
        if plain is not None:
            return plain
    targets = checked_targets(model, target, effector)
    if prefer is not None:
        return nearest_solution(model, local_rotations, targets, settings, prefer)
    return solve_checked(model, local_rotations, targets, settings)
