"""The command `show`: an animation or a picture of the arm drawing a curve, or of the cloth."""

from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from ..help_text import block
from ..presentation.text import visible
from ..terminal import progress
from .options import REPORT, SUCCESS, known, writable

EXAMPLES = block(
    "Examples",
    "plumbob show arm",
    "plumbob show heart --solver fabrik",
    "plumbob show star --output star.svg",
    "plumbob show heart --coherent --output heart.bvh",
)


def show(
    scene: Annotated[
        str, typer.Argument(metavar="SCENE", help="arm, cloth, or a curve that the arm draws.")
    ],
    file: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="FILE", help="A .gif, .svg or .bvh.")
    ] = None,
    solver: Annotated[
        str | None, typer.Option(help="For an arm fabrik, ccd, ...; for the cloth newton, ...")
    ] = None,
    coherent: Annotated[
        bool, typer.Option("--coherent", help="Let the arm move as smoothly as it can, in a loop.")
    ] = False,
) -> int:
    """Write an animation (GIF) or a picture (SVG) of the arm drawing a curve, or of the cloth.

    The arm's motion can also be written as BVH, which animation programs open.
    """
    from ..harness.record import check_regular
    from ..show import SCENES, write

    known("scene", scene, SCENES)
    path = file or REPORT / f"{scene}.gif"
    check_regular(path)
    writable(path.parent)
    with progress() as bar:
        task = bar.add_task(scene, total=None)
        drawn = partial(_drawn, bar, task)
        write(scene, path, solver, drawn, coherent)
    print(visible(str(path)))
    return SUCCESS


def _drawn(bar: Any, task: Any, done: int, total: int) -> None:
    bar.update(task, completed=done, total=total)
