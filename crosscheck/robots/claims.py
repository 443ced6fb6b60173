"""The claims about robots and characters, for the packages of files that are installed."""

from functools import partial

from ..engines import ROBOT_ENGINES
from ..tolerances import JACOBIAN, POSITION, ROTATION
from ..verdict import Claim
from . import comparisons
from .models import CHARACTERS, PACKAGES, ROBOTS, comparable, models

READS = {ROBOTS: "formats.urdf.read", CHARACTERS: "formats.mjcf.read"}
FILES = {ROBOTS: "the URDFs of example-robot-data", CHARACTERS: "characters in MJCF"}
POSES = "forward_kinematics in random configurations"
QUANTITIES = {
    "positions": (comparisons.positions, POSES, POSITION),
    "rotations": (comparisons.rotations, POSES, ROTATION),
    "Jacobians": (comparisons.jacobians, "jacobians.jacobians", JACOBIAN),
}


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


ROBOT_CLAIMS = [
    claim
    for family in PACKAGES
    if models(family)
    for engine in ROBOT_ENGINES
    for claim in robot_claims(family, engine)
]
