"""The named scenes by our solvers."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from plumbob.reference import (
    IKSolution,
    ImplicitEuler,
    MassSpring,
    Skeleton,
    State,
    curves,
    resample,
    scenes,
    track,
)
from plumbob.reference.arguments import FloatArray

from ..figures.view import ARM_VIEW, CLOTH_VIEW
from ..motion.motion import Moving, Scene
from ..problems.curves import CUSTOM, MAX_SPACING, MIN_SPACING
from ..tables.results import label

ARM, CLOTH = "arm", "cloth"
SCENES = (ARM, CLOTH, *curves)
H = 1 / 60
SECONDS = 5
# An animation shows each third step; an arm's frames are thinned out to about as many.
EVERY = 3
RATE = 20
FRAMES = SECONDS * RATE
# The exact motion of a cloth, to which others are compared.
EXACT = "newton"


class Drawn(NamedTuple):
    """An arm, the curve that it follows, a frame a point, and its motion."""

    skeleton: Skeleton
    rest: FloatArray
    curve: FloatArray
    motion: IKSolution


def drawn(scene: str, solver: str, coherent: bool) -> Drawn:
    """Return the arm drawing a curve, evened out; a coherent motion can be repeated for ever."""
    skeleton, rest = scenes.lab_arm()
    points = curves[CUSTOM if scene == ARM else scene]()
    even = resample(points, min_spacing=MIN_SPACING, max_spacing=MAX_SPACING, closed=coherent)
    motion = track(skeleton, even, solver, rest, coherent=coherent, closed=coherent)
    return Drawn(skeleton, rest, even, motion)


def arm_scene(
    scene: str, found: Drawn, named: str, yours: tuple[str, FloatArray] | None = None
) -> Scene:
    """Return what is seen of the arm and its curve; `yours` are a name and joints' positions."""
    points = found.curve
    shown = np.linspace(0, len(points) - 1, min(len(points), FRAMES)).round().astype(int)
    moves = [(named, found.motion.positions), *([yours] if yours else [])]
    made = [
        Moving(name, x[shown], np.linalg.norm(x[shown, -1] - points[shown], axis=-1))
        for name, x in reversed(moves)
    ]
    curve = "the custom curve" if scene == ARM else f"the curve “{scene.replace('_', ' ')}”"
    return Scene(
        "arm",
        f"The lab’s arm draws {curve}{_beside(made)}",
        "The line drawn has the colour of its error.",
        made,
        SECONDS / len(shown),
        "distance to the target",
        ARM_VIEW,
        len(made),
        points,
    ).checked()


class Fallen(NamedTuple):
    """The lab's cloth, its start, and where it is after each step, the start first."""

    system: MassSpring
    start: State
    positions: FloatArray


def fallen(solver: str) -> Fallen:
    """Return the lab's cloth, let go."""
    system, start = scenes.lab_cloth()
    integrator, state = ImplicitEuler(system, h=H, solver=solver), start
    positions = [state.positions]
    for _ in range(FRAMES * EVERY):
        state = integrator.step(state).state
        positions.append(state.positions)
    return Fallen(system, start, np.array(positions))


def cloth_scene(found: Fallen, solver: str, yours: tuple[str, FloatArray] | None = None) -> Scene:
    """Return what is seen of the cloth, and how far it is from converged steps of Newton's."""
    exact = found.positions if solver == EXACT else fallen(EXACT).positions
    moves = [(f"Plumbob {label(solver)}", found.positions), *([yours] if yours else [])]
    made = []
    for name, x in reversed(moves):
        apart = np.linalg.norm(x[::EVERY] - exact[::EVERY], axis=-1)
        made.append(Moving(name, x[::EVERY], np.sqrt(np.mean(apart**2, axis=-1)), apart))
    return Scene(
        "cloth",
        f"The lab’s cloth swings from two corners{_beside(made)}",
        "Every particle has the colour of its distance to where converged steps of implicit Euler "
        "bring it; the numbers are root mean squares over the particles.",
        made,
        H * EVERY,
        "distance to the exact implicit motion",
        CLOTH_VIEW,
        len(made),
        marked=found.system.pinned.tolist(),
    ).checked()


def _beside(made: Sequence[Moving]) -> str:
    """Return who is beside whom, "" of one that is shown without another."""
    return f": {made[0].label} beside {made[1].label}" if len(made) > 1 else ""
