"""Animations and pictures of the named scenes, pages that play them, and motions as BVH."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from plumbob.reference import IK_SOLVERS, STEP_SOLVERS, scenes
from plumbob.reference.arguments import choice
from plumbob.reference.formats import bvh

from ..motion import motion
from ..motion.motion import Scene
from ..tables.results import label
from .ours import CLOTH, EXACT, SCENES, SECONDS, arm_scene, cloth_scene, drawn, fallen
from .yours import ARM_TASKS, CLOTH_TASKS, Yours

GIF, SVG, HTML, BVH = ".gif", ".svg", ".html", ".bvh"
PICTURES = (GIF, SVG, HTML)
Told = Callable[[int, int], None]


def write(
    scene: str,
    path: Path,
    solver: str | None,
    progress: Told,
    coherent: bool = False,
    yours: Yours | None = None,
) -> None:
    """Write a scene as an animated GIF or, by the file's suffix, an SVG, a page or a BVH motion.

    Args:
        scene: its name.
        path: of the file.
        solver: of ours; FABRIK or Newton's if None.
        progress: told how much is done.
        coherent: whether our arm moves as smoothly as it can.
        yours: a solver to be shown beside ours; a BVH file then holds ours all the same.

    Raises:
        ValueError: if the suffix is another or not one for this scene, scene or solver are unknown,
            a cloth is to be coherent, or yours does not answer.
    """
    is_cloth = choice("scene", scene, SCENES) == CLOTH
    has_bones = not is_cloth and yours is None
    choice("suffix of the file", path.suffix, (*PICTURES, BVH) if has_bones else PICTURES)
    if is_cloth and coherent:
        raise ValueError("coherent: expected an arm that follows a curve, got a cloth")
    if is_cloth:
        made = _cloth(choice("solver", solver or EXACT, STEP_SOLVERS), progress, yours)
        return _write(made, path, progress)
    if yours:
        yours.offered("an arm", ARM_TASKS)
    name = choice("solver", solver or "fabrik", IK_SOLVERS)
    found = drawn(scene, name, coherent)
    if path.suffix == BVH:
        skeleton, _ = scenes.lab_arm()
        frame_time = SECONDS / len(found.curve)
        return bvh.write(path, skeleton, found.motion.local_rotations, frame_time)
    named = f"Plumbob {label(name)}" + (", coherent" if coherent else "")
    theirs = (yours.name, yours.draws(found, progress)) if yours else None
    return _write(arm_scene(scene, found, named, theirs), path, progress)


def _cloth(solver: str, progress: Told, yours: Yours | None) -> Scene:
    if yours:
        yours.offered("a cloth", CLOTH_TASKS)
    found = fallen(solver)
    return cloth_scene(found, solver, (yours.name, yours.falls(found, progress)) if yours else None)


def _write(scene: Scene, path: Path, progress: Told) -> None:
    if path.suffix == HTML:
        path.write_text(motion.page(scene), encoding="utf-8")
        return
    from .film import animate, picture

    write_as: Any = animate if path.suffix == GIF else picture
    write_as(scene, path, progress)
