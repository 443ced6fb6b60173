"""All claims about the reference, each against an engine or a closed form."""

import tomllib
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

from plumbob.reference import arguments
from plumbob.reference.inverse_kinematics import IK_SOLVERS

from . import kinematics, tasks
from .engines import ABSENT, ROBOT_ENGINES, SKELETON_ENGINES
from .mass_spring import equilibria, forces, integrators, orders, steps
from .robots import comparisons
from .robots.models import CHARACTERS, PACKAGES, ROBOTS, comparable, models
from .tolerances import JACOBIAN, POSITION, ROTATION, TOLERANCES
from .verdict import Claim, ClaimVerdict, check_claim, each_case

MODULES: dict[str, ModuleType] = {
    module.__name__.rpartition(".")[2]: module
    for module in (kinematics, tasks, equilibria, forces, integrators, orders, steps)
}
_TABLE = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
READS = {ROBOTS: "formats.urdf.read", CHARACTERS: "formats.mjcf.read"}
FILES = {ROBOTS: "the URDFs of example-robot-data", CHARACTERS: "characters in MJCF"}
POSES = "forward_kinematics in random configurations"
QUANTITIES = {
    "positions": (comparisons.positions, POSES, POSITION),
    "rotations": (comparisons.rotations, POSES, ROTATION),
    "Jacobians": (comparisons.jacobians, "jacobians.jacobians", JACOBIAN),
}


def claims_about(subject: str, *engine: str) -> list[Claim]:
    """Return the claims about a subject of `claims.toml`, against an engine if given."""
    return [_claim(name, entry, *engine) for name, entry in _TABLE[subject].items()]


def _claim(name: str, entry: dict[str, Any], engine: str = "") -> Claim:
    module, _, function = entry["compare"].partition(".")
    settings = [*filter(None, [engine]), *entry.get("arguments", ())]
    words = {"engine": engine, "solvers": ", ".join(IK_SOLVERS)}
    return Claim(
        f"{name}, {engine}" if engine else name,
        entry["quantity"].format(**words),
        entry["counterpart"].format(**words),
        each_case(partial(getattr(MODULES[module], function), *settings)),
        TOLERANCES[entry["tolerance"]],
        entry["cases"],
        ABSENT.get(engine, ""),
    )


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
            obstacle=ABSENT.get(engine, ""),
        )
        for name, (quantity, function, tolerance) in QUANTITIES.items()
    ]


skeleton_claims = partial(claims_about, "skeletons")
TASK_CLAIMS = [
    *(claim for engine in (*ABSENT, *ROBOT_ENGINES) for claim in claims_about("tasks", engine)),
    *claims_about("equalities"),
]
MASS_SPRING_CLAIMS = claims_about("masses and springs")
ROBOT_CLAIMS = [
    claim
    for family in PACKAGES
    if models(family)
    for engine in (*ABSENT, *ROBOT_ENGINES)
    for claim in robot_claims(family, engine)
]
CLAIMS: dict[str, Claim] = {
    claim.name: claim
    for claim in [
        *(claim for engine in (*ABSENT, *SKELETON_ENGINES) for claim in skeleton_claims(engine)),
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
