"""The command `show`: the arm drawing a curve or the cloth, by Plumbob's solvers and the user's."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from plumbob.text.printable import visible

from .options import REPORT, SUCCESS, File, Text, argument, option, valid_name, writable
from .terminal import progress
from .verify import program_of

if TYPE_CHECKING:
    from plumbob.bench.show.scene_solver import SceneSolver


Scene = Annotated[Text, argument("SCENE", "arm, cloth, or a curve that the arm draws.")]
Output = Annotated[File, option("FILE", "File in .html, .svg or .bvh.", "--output", "-o")]
OwnSolver = Annotated[
    Text, option("SOLVER", "Your solver, my_ik.py; or -- and a program.", "--with")
]
Solver = Annotated[
    Text, option("NAME", "Plumbob's solver: fabrik, ccd ...; for the cloth: newton ...")
]


def show(
    context: typer.Context,
    scene: Scene = None,
    *,
    file: Output = None,
    solver: Solver = None,
    own_solver: OwnSolver = None,
) -> int:
    """Write a page that plays the arm or the cloth, or a picture.

    Your solver moves beside Plumbob's, with errors in colour. The motion of the arm can also be
    written as BVH, which animation programs open.
    """
    from plumbob.bench.show.scene_solver import SceneSolver
    from plumbob.bench.show.scenes import SCENES

    program = program_of(context)
    if own_solver is not None and program:
        raise ValueError("with: expected one solver, got --with and a program behind --")
    words = program if own_solver is None else [own_solver]
    if scene is None and not words:
        raise ValueError(f"SCENE: expected one of {', '.join(SCENES)}, got none")
    if scene is not None:
        valid_name("scene", scene, SCENES)
    user_solver = SceneSolver.open(words) if words else None
    try:
        name = scene or (user_solver.scene if user_solver else "")
        path = file or REPORT / f"{name}.html"
        _draw(name, path, solver, user_solver)
    finally:
        if user_solver:
            user_solver.close()
    print(visible(str(path)))
    return SUCCESS


def _draw(name: str, path: Path, solver: str | None, user_solver: "SceneSolver | None") -> None:
    """Write a scene to a file with a progress bar."""
    from plumbob.bench.show.scenes import write
    from plumbob.process.paths import check_regular

    check_regular(path)
    writable(path.parent)
    with progress() as bar:
        task = bar.add_task(name, total=None)

        def update(frame: int, total: int) -> None:
            bar.update(task, completed=frame, total=total)

        write(name, path, solver, update, user_solver)
