"""The command `which`: every installed solver on a robot of the user's, and which to choose."""

import tempfile
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from ..terminal import print_filled, print_lines
from .bench import run_with_progress
from .options import SUCCESS, Text, argument, option, valid_name
from .report import FORMATS, formatted

if TYPE_CHECKING:
    from plumbob.bench.harness.block import Choice

SUFFIXES = (".urdf", ".xml", ".mjcf")


def which(
    robot: Annotated[Path, argument("ROBOT", "Your robot: .urdf, or .xml or .mjcf of MuJoCo.")],
    *,
    link: Annotated[Text, option("NAME", "Link or body that must reach the targets.")] = None,
    form: Annotated[
        str, option("FORMAT", f"Print the table as {', '.join(FORMATS)}.", "--format")
    ] = "",
) -> int:
    """Try every installed solver of inverse kinematics on your robot, in about a minute.

    All solve the same 60 poses within 1 mm, 1 mrad and the limits of the joints. Your robot must
    have only hinges from its root to the link.
    """
    from plumbob.bench.harness.record import on_record
    from plumbob.bench.report.which import solvers_on_robot
    from plumbob.bench.tables.results import Results

    if form:
        valid_name("format", form, FORMATS)
    choice = _choice(robot, link)
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


def _choice(robot: Path, link: str | None) -> "Choice":
    """Return each solver on poses that a robot can reach, ten in each of six strata.

    Raises:
        ValueError: if the file is none of a robot, or the bench cannot take it.
    """
    from plumbob.bench.harness.block import SCALES, Choice
    from plumbob.bench.problems.files import read

    if not robot.is_file() or robot.suffix.lower() not in SUFFIXES:
        raise ValueError(f"ROBOT: expected a file of type {' or '.join(SUFFIXES)}, got {robot}")
    try:
        own, (poses, *_) = read([str(robot)], ["ik"], link, None)
    except ValueError as error:
        hint = "" if link else "; --link names the link that must reach the targets"
        raise ValueError(str(error).replace("effector: ", "--link: ") + hint) from None
    scale = replace(SCALES["quick"], problems=tuple(own))
    return Choice("quick", scale, problems=(poses,), is_partial=True)
