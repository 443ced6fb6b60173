"""What is claimed of robots and characters, where the packages with their files are installed."""

from functools import partial

from ..engines import ROBOT_ENGINES
from ..tolerances import JACOBIAN, POSITION, ROTATION
from ..verdict import Claim
from . import comparisons
from .models import CHARACTERS, PACKAGES, ROBOTS, comparable, models

READS = {ROBOTS: "formats.urdf.read", CHARACTERS: "formats.mjcf.read"}
FILES = {ROBOTS: "the URDFs of example-robot-data", CHARACTERS: "characters in MJCF"}


def robot_claims(family: str, engine: str) -> list[Claim]:
    """Return what is claimed of one family of files beside one engine that reads them itself."""
    files = FILES[family]
    quantities = {
        "positions": (
            f"{READS[family]}, forward_kinematics in random configurations: all links",
            POSITION,
        ),
        "rotations": (
            f"{READS[family]}, forward_kinematics in random configurations: all links",
            ROTATION,
        ),
        "Jacobians": (f"{READS[family]}, jacobians.jacobians: all links", JACOBIAN),
    }
    return [
        Claim(
            f"{family[:-1]} {quantity}, {engine}",
            ours,
            f"{files} as {engine} reads them, links and joints matched by name",
            partial(getattr(comparisons, quantity.lower()), family, engine),
            tolerance,
            cases=len(comparable(family, engine, moving=quantity == "positions")),
        )
        for quantity, (ours, tolerance) in quantities.items()
    ]


ROBOT_CLAIMS = [
    claim
    for family in PACKAGES
    if models(family)
    for engine in ROBOT_ENGINES
    for claim in robot_claims(family, engine)
]
