"""The claims: what we compute, with what it is held against, in how many cases, how closely."""

from collections.abc import Callable, Sequence
from functools import partial

from reference import arguments
from reference.inverse_kinematics import IK_SOLVERS

from . import kinematics
from .engines import SKELETON_ENGINES
from .mass_spring.claims import MASS_SPRING_CLAIMS
from .robots.claims import ROBOT_CLAIMS
from .tolerances import POSITION, ROTATION
from .verdict import Claim, Verdict, judge


def skeleton_claims(engine: str) -> list[Claim]:
    """Return what is claimed of our kinematics beside one engine."""
    return [
        Claim(
            f"joint positions, {engine}",
            "forward_kinematics on random chains and trees of 2 to 50 joints",
            f"{engine}'s ball joints, matched by name",
            partial(kinematics.joint_positions, engine),
            POSITION,
            cases=100,
        ),
        Claim(
            f"joint rotations, {engine}",
            "forward_kinematics on random chains and trees of 2 to 50 joints",
            f"{engine}'s ball joints, matched by name",
            partial(kinematics.joint_rotations, engine),
            ROTATION,
            cases=100,
        ),
        Claim(
            f"local rotations, {engine}",
            f"local_from_global of the rotations {engine} computes",
            f"the local rotations given to {engine}",
            partial(kinematics.back_to_local, engine),
            ROTATION,
            cases=100,
        ),
        Claim(
            f"IK answers, {engine}",
            f"solve_ik by {', '.join(IK_SOLVERS)}: all joints' positions and the residual",
            f"{engine}'s forward kinematics of the local rotations found",
            partial(kinematics.ik_answers, engine),
            POSITION,
            cases=50 * len(IK_SOLVERS),
        ),
    ]


CLAIMS: dict[str, Claim] = {
    claim.name: claim
    for claim in [
        *(claim for engine in SKELETON_ENGINES for claim in skeleton_claims(engine)),
        *MASS_SPRING_CLAIMS,
        *ROBOT_CLAIMS,
    ]
}


def run_claims(
    names: Sequence[str] | None = None, progress: Callable[[Claim], None] | None = None
) -> list[Verdict]:
    """Judge the named claims, or all, in the order of `CLAIMS`.

    Args:
        names: of claims, or None for all.
        progress: called with each claim before it is judged.

    Raises:
        ValueError: if there is no claim of a name, or no name in the list.
    """
    chosen = list(CLAIMS) if names is None else [_known(name) for name in names]
    if not chosen:
        raise ValueError("names: expected at least one claim, got none")
    verdicts = []
    for name in chosen:
        if progress is not None:
            progress(CLAIMS[name])
        verdicts.append(judge(CLAIMS[name]))
    return verdicts


def _known(name: str) -> str:
    return arguments.choice("names", name, CLAIMS)
