"""The claims: what we compute, with what it is held against, in how many cases, how closely."""

from collections.abc import Callable, Sequence
from functools import partial

from reference import arguments
from reference.inverse_kinematics import IK_SOLVERS

from . import kinematics, mass_spring
from .engines import SKELETON_ENGINES
from .tolerances import BALANCE, ENERGY, FORCE, POSITION, ROTATION, STEP
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


MASS_SPRING_CLAIMS = [
    Claim(
        "spring forces",
        "spring_forces: -k (l - r) u",
        "MuJoCo's spatial tendons with stiffness",
        mass_spring.tendon_springs,
        FORCE,
        cases=50,
    ),
    Claim(
        "damper forces",
        "damper_forces: -c ((v_i - v_j)·u) u",
        "MuJoCo's spatial tendons with damping",
        mass_spring.tendon_dampers,
        FORCE,
        cases=50,
    ),
    Claim(
        "potential energy",
        "potential_energy: springs and gravity",
        "MuJoCo's potential energy",
        mass_spring.tendon_potential,
        ENERGY,
        cases=50,
    ),
    Claim(
        "kinetic energy",
        "kinetic_energy: m/2 |v|²",
        "MuJoCo's kinetic energy",
        mass_spring.point_kinetic,
        ENERGY,
        cases=50,
    ),
    Claim(
        "symplectic Euler step",
        "symplectic_euler with dampers and external forces",
        "MuJoCo's integrator Euler",
        mass_spring.symplectic_steps,
        STEP,
        cases=50,
    ),
    Claim(
        "Gauss-Newton step",
        "ImplicitEuler, gauss_newton, without dampers",
        "MuJoCo's integrator discrete",
        partial(mass_spring.gauss_newton_steps, damped=False),
        STEP,
        cases=50,
    ),
    Claim(
        "Gauss-Newton step, damped",
        "ImplicitEuler, gauss_newton, with dampers",
        "MuJoCo's integrator discrete",
        partial(mass_spring.gauss_newton_steps, damped=True),
        STEP,
        cases=50,
    ),
    Claim(
        "implicit Euler balance",
        "ImplicitEuler, newton, converged: M (x - y)",
        "h² f(x) with MuJoCo's forces at our x",
        partial(mass_spring.implicit_balances, damped=False),
        BALANCE,
        cases=25,
    ),
    Claim(
        "implicit Euler balance, damped",
        "ImplicitEuler, newton, converged: M (x - y)",
        "h² f(x) with MuJoCo's forces at our x, dampers as tendons at rest length l_n",
        partial(mass_spring.implicit_balances, damped=True),
        BALANCE,
        cases=25,
    ),
]

CLAIMS: dict[str, Claim] = {
    claim.name: claim
    for claim in [
        *(claim for engine in SKELETON_ENGINES for claim in skeleton_claims(engine)),
        *MASS_SPRING_CLAIMS,
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
