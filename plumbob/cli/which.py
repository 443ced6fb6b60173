"""The command `which`: every installed solver on a robot of the user's, and which to choose."""

import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from .bench import run_with_progress
from .options import SUCCESS, Text, UserSolvers, argument, option, valid_name
from .report import FORMATS, formatted
from .terminal import print_filled, print_lines

if TYPE_CHECKING:
    from plumbob.bench.measure.block import Choice

SUFFIXES = (".urdf", ".xml", ".mjcf")


def which(
    robot: Annotated[Path, argument("ROBOT", "Your robot: .urdf, or .xml or .mjcf of MuJoCo.")],
    *,
    user_solvers: UserSolvers = None,
    link: Annotated[Text, option("NAME", "Link or body that must reach the targets.")] = None,
    form: Annotated[
        str, option("FORMAT", f"Print the table as {', '.join(FORMATS)}.", "--format")
    ] = "",
) -> int:
    """Try every installed solver of inverse kinematics, and yours, on your robot, in a minute.

    All solve the same 60 poses within 1 mm, 1 mrad and the limits of the joints. Your robot must
    have only hinges from its root to the link.
    """
    from plumbob.bench.measure.record import on_record
    from plumbob.bench.page.which import solvers_on_robot
    from plumbob.bench.tables.results import Results

    if form:
        valid_name("format", form, FORMATS)
    choice = _choice(robot, link, user_solvers or ())
    with tempfile.TemporaryDirectory(prefix="plumbob-which-") as folder:
        run_with_progress(["ik"], choice, Path(folder))
        table = solvers_on_robot(Results(on_record(Path(folder)).records), robot.name)
    if form:
        print(formatted(table, form), end="")
        return SUCCESS
    print_filled(table.title)
    print_lines(table)
    for sentence in (*table.summary.points, table.summary.sentence):
        print_filled(sentence)
    return SUCCESS


def _choice(robot: Path, link: str | None, user_solvers: Sequence[str]) -> "Choice":
    """Return each solver on poses that a robot can reach, ten in each of six strata.

    Raises:
        ValueError: if the file is none of a robot, the bench cannot take the robot, or a solver of
            the user cannot be opened or takes no robots.
    """
    from plumbob.bench.measure.block import SCALES, Choice
    from plumbob.bench.peers import opening
    from plumbob.bench.peers.user_solver import ROBOT_TASK
    from plumbob.bench.problems.files import read

    if not robot.exists():
        raise ValueError(f"ROBOT: expected a file, got {robot}, which does not exist")
    if not robot.is_file() or robot.suffix.lower() not in SUFFIXES:
        raise ValueError(f"ROBOT: expected a file of type {' or '.join(SUFFIXES)}, got {robot}")
    try:
        own, (poses, *_) = read([str(robot)], ["ik"], link)
    except ValueError as error:
        hint = "" if link else "; --link names the link that must reach the targets"
        raise ValueError(str(error).replace("effector: ", "--link: ") + hint) from None
    own_solvers = opening.open_solvers(opening.addresses(user_solvers), ["ik"])
    if chains_only := [s.address for s in own_solvers if ROBOT_TASK not in s.tasks]:
        raise ValueError(f"with: expected a solver with {ROBOT_TASK}, got {chains_only[0]}")
    scale = replace(SCALES["quick"], user_solvers=tuple(own_solvers), problems=tuple(own))
    return Choice("quick", scale, problems=(poses,), is_partial=True)
