"""The command `show`: the arm drawing a curve or the cloth, by our solvers and by yours."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from plumbob.bench.text import visible

from ..help_text import block
from ..terminal import progress
from .options import REPORT, SUCCESS, known, writable
from .verify import PROGRAM

if TYPE_CHECKING:
    from plumbob.bench.show.your_solver import YourSolver

EXAMPLES = block(
    "Examples",
    "plumbob show arm",
    "plumbob show heart --solver fabrik",
    "plumbob show star --output star.svg",
    "plumbob show heart --coherent --output heart.bvh",
    "plumbob show heart --with my_ik.py -o heart.html     yours beside ours, to be played",
    "plumbob show cloth -o cloth.gif -- ./my_solver --flag",
)


def show(
    context: typer.Context,
    scene: Annotated[
        str | None,
        typer.Argument(metavar="SCENE", help="arm, cloth, or a curve that the arm draws."),
    ] = None,
    file: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE", help="A .gif, .svg, .html or .bvh."),
    ] = None,
    solver: Annotated[
        str | None, typer.Option(help="For an arm fabrik, ccd, ...; for the cloth newton, ...")
    ] = None,
    coherent: Annotated[
        bool, typer.Option("--coherent", help="Let the arm move as smoothly as it can, in a loop.")
    ] = False,
    yours: Annotated[
        str | None,
        typer.Option("--with", metavar="SOLVER", help="Yours, my_ik.py; or -- and a program."),
    ] = None,
) -> int:
    """Write an animation, a picture or a page of the arm drawing a curve, or of the cloth.

    With a solver of yours it moves beside ours, and errors are in colour. The arm's motion can also
    be written as BVH, which animation programs open.
    """
    from plumbob.bench.harness.record import check_regular
    from plumbob.bench.show.scenes import SCENES
    from plumbob.bench.show.your_solver import YourSolver

    words = _words(yours, context.meta.get(PROGRAM, ()))
    if scene is None and not words:
        raise ValueError(f"SCENE: expected one of {', '.join(SCENES)}, got none")
    if scene is not None:
        known("scene", scene, SCENES)
    entrant = YourSolver(words) if words else None
    try:
        name = scene or (entrant.scene if entrant else "")
        path = file or REPORT / f"{name}.gif"
        check_regular(path)
        writable(path.parent)
        _write(name, path, solver, coherent, entrant)
    finally:
        if entrant:
            entrant.close()
    print(visible(str(path)))
    return SUCCESS


def _words(yours: str | None, program: Any) -> list[str]:
    """Return the words that mean a solver: a file, or what stands behind --."""
    if yours is not None and program:
        raise ValueError("with: expected one solver, got --with and a program behind --")
    return [yours] if yours is not None else list(program)[1:]


def _write(
    name: str, path: Path, solver: str | None, coherent: bool, yours: "YourSolver | None"
) -> None:
    from plumbob.bench.show.scenes import write

    with progress() as bar:
        task = bar.add_task(name, total=None)
        write(name, path, solver, partial(_drawn, bar, task), coherent, yours)


def _drawn(bar: Any, task: Any, done: int, total: int) -> None:
    bar.update(task, completed=done, total=total)
