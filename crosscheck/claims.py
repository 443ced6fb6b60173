"""All claims about the reference, each against an engine or a closed form."""

from collections.abc import Callable, Sequence
from functools import partial

from plumbob.reference import arguments
from plumbob.reference.inverse_kinematics import IK_SOLVERS

from . import kinematics, tasks
from .engines import ROBOT_ENGINES, SKELETON_ENGINES
from .mass_spring.claims import MASS_SPRING_CLAIMS
from .robots import comparisons
from .robots.models import CHARACTERS, PACKAGES, ROBOTS, comparable, models
from .tolerances import JACOBIAN, POSITION, ROTATION
from .verdict import Claim, ClaimVerdict, check_claim, each_case

READS = {ROBOTS: "formats.urdf.read", CHARACTERS: "formats.mjcf.read"}
FILES = {ROBOTS: "the URDFs of example-robot-data", CHARACTERS: "characters in MJCF"}
POSES = "forward_kinematics in random configurations"
QUANTITIES = {
    "positions": (comparisons.positions, POSES, POSITION),
    "rotations": (comparisons.rotations, POSES, ROTATION),
    "Jacobians": (comparisons.jacobians, "jacobians.jacobians", JACOBIAN),
}


def skeleton_claims(engine: str) -> list[Claim]:
    """Return the claims about kinematics against an engine."""
    poses = "forward_kinematics on random chains and trees of 2 to 50 joints"
    joints = f"{engine}'s ball joints, matched by name"
    local = f"local_from_global of the rotations {engine} computes"
    inputs = f"the local rotations given to {engine}"
    solutions = f"solve_ik by {', '.join(IK_SOLVERS)}: all joints' positions and the residual"
    forward = f"{engine}'s forward kinematics of the local rotations found"
    rows = (
        ("joint positions", poses, joints, kinematics.joint_positions, POSITION, 100),
        ("joint rotations", poses, joints, kinematics.joint_rotations, ROTATION, 100),
        ("local rotations", local, inputs, kinematics.back_to_local, ROTATION, 100),
        ("IK answers", solutions, forward, kinematics.ik_answers, POSITION, 50 * len(IK_SOLVERS)),
    )
    return [
        Claim(f"{name}, {engine}", quantity, counterpart, each_case(partial(f, engine)), t, cases)
        for name, quantity, counterpart, f, t, cases in rows
    ]


def robot_claims(family: str, engine: str) -> list[Claim]:
    """Return the claims about a family of files against an engine."""
    return [
        Claim(
            f"{family[:-1]} {name}, {engine}",
            f"{READS[family]}, {function}: all links",
            f"{FILES[family]} as {engine} reads them, links and joints matched by name",
            partial(comparisons.compare, quantity, family, engine),
            tolerance,
            cases=len(comparable(family, engine, moving=name == "positions")),
        )
        for name, (quantity, function, tolerance) in QUANTITIES.items()
    ]


def task_claims(engine: str) -> list[Claim]:
    """Return the claims about the tasks of inverse kinematics against an engine."""
    frames = "tasks.FrameTask between links of random trees: place, rotation and their derivatives"
    masses = "tasks.CentreOfMass with the masses that formats.mjcf.parse reads"
    poses = f"{engine}'s link poses and Jacobians, transformed to the frame of the link"
    centre = f"{engine}'s centre of mass"
    rows = (
        ("task frames", frames, poses, tasks.relative_frames, JACOBIAN),
        ("task centre of mass", masses, centre, tasks.centre_of_mass, POSITION),
    )
    return [
        Claim(f"{name}, {engine}", quantity, counterpart, each_case(partial(f, engine)), t, 20)
        for name, quantity, counterpart, f, t in rows
    ]


TASK_CLAIMS = [
    *(claim for engine in ROBOT_ENGINES for claim in task_claims(engine)),
    Claim(
        "task equalities, MuJoCo",
        "residuals of connect, weld and joint that formats.mjcf.parse reads",
        "MuJoCo's efc_pos of the equality constraints",
        each_case(tasks.equalities),
        POSITION,
        20,
    ),
]
ROBOT_CLAIMS = [
    claim
    for family in PACKAGES
    if models(family)
    for engine in ROBOT_ENGINES
    for claim in robot_claims(family, engine)
]
CLAIMS: dict[str, Claim] = {
    claim.name: claim
    for claim in [
        *(claim for engine in SKELETON_ENGINES for claim in skeleton_claims(engine)),
        *TASK_CLAIMS,
        *MASS_SPRING_CLAIMS,
        *ROBOT_CLAIMS,
    ]
}


def run_claims(
    names: Sequence[str] | None = None, progress: Callable[[Claim], None] | None = None
) -> list[ClaimVerdict]:
    """Check the named claims in their order, by default all; call `progress` before each.

    Raise a ValueError if a name is unknown or the list is empty.
    """
    claims = [
        CLAIMS[arguments.choice("names", name, CLAIMS)]
        for name in (CLAIMS if names is None else names)
    ]
    if not claims:
        raise ValueError("names: expected at least one claim, got none")
    verdicts = []
    for claim in claims:
        if progress is not None:
            progress(claim)
        verdicts.append(check_claim(claim))
    return verdicts
