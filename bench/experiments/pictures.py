"""Pictures and motions of the report: the arm on the custom curve, and the falling cloth."""

from collections.abc import Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from plumbob.reference import IK_SOLVERS, ImplicitEuler, rotation, scenes, track

from ..measure import metrics
from ..measure.block import Block, Measured, Scale
from ..measure.record import Record
from ..measure.values import Fact, Floats1, Floats2, Floats3, Integers1, Values
from ..problems.cloth_swing import TOLERANCE, H, cloth_swing, converged_motion, motion
from ..problems.curves import CUSTOM, MAX_SPACING, MIN_SPACING, custom_curve, evened_custom_curve

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable
    from matplotlib.figure import Figure

# The tasks of records.
ARM, CLOTH = "arm", "cloth"
ARM_MOTION, CLOTH_MOTION = "motion of the arm", "motion of the cloth"
# Poses of the arm in a picture, and states of the cloth.
GHOSTS, FRAMES = 9, 6
# Motions to play: solvers of inverse kinematics; step solvers with their iteration limits.
FOLLOWING = ("ccd", "fabrik", "levenberg_marquardt")
SWINGING = (("local_global", 1), ("newton", 100), ("local_global", 10), ("gauss_newton", 1))
# A step solver with a larger limit of iterations works to the tolerance.
SOLVED = 50
# Steps of the cloth; the intervals at which its states and the arm's frames are kept; decimals.
SWUNG, EVERY, THINNED, PLACES = 200, 4, 2, 6


class ArmDrawing(Values, frozen=True):
    """The arm on a curve, point by point [m], [rad], with the joints in a few frames."""

    evened: bool  # whether the curve was resampled
    curve: Floats2
    residual: Floats1
    iterations: Integers1
    largest_angle: Floats1
    mean_angle: Floats1
    spacing: Floats1
    ghosts: Floats3


class ClothDrawing(Values, frozen=True):
    """A cloth in a few frames: positions [m], (frame, particle, 3), their times [s], the pins."""

    positions: Floats3
    time: Floats1
    pinned: Integers1


class MovingFacts(Values, frozen=True, kw_only=True):
    """The position of a motion in the order."""

    order: Fact[int]


class MovingArm(MovingFacts, frozen=True):
    """The arm's joints [m], (frame, joint, 3), the curve, and the error of each frame [m]."""

    positions: Floats3
    curve: Floats2
    error: Floats1


class MovingCloth(MovingFacts, frozen=True):
    """A cloth's particles [m], (frame, particle, 3), the error of each [m], the pins."""

    h: float  # the step [s]
    every: int  # the interval of recorded steps
    iterations: int  # the iteration limit
    positions: Floats3
    distance: Floats2
    pinned: Integers1


KINDS = {ARM: ArmDrawing, CLOTH: ClothDrawing, ARM_MOTION: MovingArm, CLOTH_MOTION: MovingCloth}


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield the drawings with the first solver, the cloth, and the motions, at every scale."""
    first = next(iter(IK_SOLVERS))
    spacing = {"min_spacing": MIN_SPACING, "max_spacing": MAX_SPACING}
    for evened in (False, True):
        measure = partial(drawing, first, evened)
        yield _block(ARM, f"arm/{CUSTOM}", first, measure, {"evened": evened, **spacing})
    yield _block(CLOTH, "cloth/x1", "newton", converged_cloth, {"h": H, "frames": FRAMES})
    for i, solver in enumerate(FOLLOWING):
        measure, settings = partial(follow_curve, solver), {"every": THINNED}
        yield _block(ARM_MOTION, f"motion/arm/{CUSTOM}", solver, measure, settings, order=i)
    for i, (solver, iterations) in enumerate(SWINGING):
        measure = partial(swing_cloth, solver, iterations)
        limits = {"h": H, "every": EVERY, "iterations": iterations}
        yield _block(CLOTH_MOTION, "motion/cloth/x1", solver, measure, limits, order=i)


def _block(task: str, name: str, solver: str, measure: Any, settings: Any, **facts: int) -> Block:
    return Block("pictures", name, solver, measure, settings, facts={"task": task, **facts})


def follow_curve(solver: str) -> Measured:
    """Follow the evened custom curve; keep each `THINNED`-th frame, to a micrometre."""
    skeleton, rest = scenes.lab_arm()
    curve = evened_custom_curve()
    frames = track(skeleton, curve, solver, rest)
    positions, errors = frames.positions[::THINNED], np.atleast_1d(frames.residual)[::THINNED]
    return {
        "positions": positions.round(PLACES),
        "curve": curve.round(PLACES),
        "error": errors,
    }


def swing_cloth(solver: str, iterations: int) -> Measured:
    """Swing the lab's cloth; keep each `EVERY`-th state and its distance from converged steps."""
    problem = cloth_swing(1)
    exact = np.array([state.positions for state in converged_motion(problem)[: SWUNG + 1]])
    limits: dict[str, Any] = {"max_iterations": iterations}
    limits |= {"tolerance": TOLERANCE if iterations > SOLVED else 0.0}
    integrator = ImplicitEuler(problem.system, h=problem.h, solver=solver, **limits)
    states = motion(problem.start, SWUNG, integrator)
    positions = np.array([state.positions for state in states])
    distance = np.linalg.norm(positions - exact, axis=-1)[::EVERY]
    digits = np.array([[float(f"{d:.2e}") for d in row] for row in distance])
    return {
        "positions": positions[::EVERY].round(PLACES),
        "distance": digits,
        "pinned": problem.system.pinned,
    }


def drawing(solver: str, evened: bool) -> Measured:
    """Draw the custom curve; keep its points and the arm's joints in a few frames."""
    skeleton, rest = scenes.lab_arm()
    curve = evened_custom_curve() if evened else custom_curve()
    motion = track(skeleton, curve, solver, rest)
    joints = motion.local_rotations[:, :-1]
    angles = rotation.angle(joints[:-1], joints[1:])
    ghosts = np.linspace(0, len(curve) - 1, GHOSTS).round().astype(int)
    return {
        "curve": curve,
        "residual": np.atleast_1d(motion.residual),
        "iterations": np.atleast_1d(motion.iterations),
        "largest_angle": angles.max(axis=-1),
        "mean_angle": angles.mean(axis=-1),
        "spacing": np.linalg.norm(np.diff(curve, axis=0), axis=-1),
        "ghosts": motion.positions[ghosts],
    }


def converged_cloth() -> Measured:
    """Swing the lab's cloth by converged steps; keep the particles in evenly spaced frames."""
    problem = cloth_swing(1)
    states = converged_motion(problem)
    frames = np.linspace(0, len(states) - 1, FRAMES).round().astype(int)
    positions = np.array([states[i].positions for i in frames])
    return {"positions": positions, "time": frames * problem.h, "pinned": problem.system.pinned}


# What is shown.

from ..figures.sketch import Sketch
from ..figures.view import ARM_VIEW, CLOTH_VIEW, project
from ..player.motion import Moving, Scene
from ..tables.captions import Captions
from ..tables.columns import text, words_in
from ..tables.results import Results, counted, label, listed, solvers
from ..tables.table import Column, Summary, words

CAPTIONS = Captions(__file__)
# Shades of the scale of spacings: few enough to be drawn as shapes rather than as an image.
SHADES = 40
# Frames beside each other in the filmstrip.
FILMSTRIP = 3
# Motions of a kind on the page, users’ solvers first: a cloth adds some 60 kB to the page.
MAX_ARMS, MAX_CLOTHS = 6, 4
# Time in which the arm draws the curve [s].
DRAWING = 12.0
# A solver with a larger limit of iterations converges: its label has no count.
FEW = 50


def arm_draws(results: Results) -> Sketch | None:
    """Show the arm on the custom curve before and after resampling, the points by their spacing."""
    records = results.all("pictures", task=ARM)
    if not records:
        return None
    drawings = [
        (r.values.evened, r.values.curve, r.values.spacing, r.values.ghosts) for r in records
    ]
    return Sketch(**CAPTIONS.figure("arm_draws"), data=drawings, draw=_draw_arms)


def falling_cloth(results: Results) -> Sketch | None:
    """Show a filmstrip of the falling cloth."""
    records = results.all("pictures", task=CLOTH)
    if not records:
        return None
    cloth: ClothDrawing = records[0].values
    data = (cloth.positions, cloth.time, cloth.pinned)
    return Sketch(**CAPTIONS.figure("falling_cloth"), data=data, draw=_draw_cloths)


def _draw_arms(drawings: Any) -> "Figure":
    from ..figures.canvas import canvas
    from ..figures.drawing import power
    from ..figures.scene_drawing import draw_arm

    figure, axes = canvas(5.2, len(drawings), sharex=True, sharey=True)
    for ax, (evened, curve, spacing, ghosts) in zip(axes, drawings, strict=True):
        points = _points_by_spacing(ax, curve, spacing)
        for joints, alpha in zip(ghosts, [0.12] * (len(ghosts) - 1) + [0.9], strict=True):
            draw_arm(ax, joints, alpha)
        ax.set_title("after resampling" if evened else "before: as it is drawn")
        ax.set_aspect("equal")
        ax.axis("off")
    bar = figure.colorbar(points, ax=axes, shrink=0.5, aspect=35, location="bottom")
    bar.ax.xaxis.set_major_formatter(power)
    bar.ax.minorticks_off()
    bar.set_label("distance to the next point [m], log scale")
    bar.outline.set_visible(False)
    return figure


def _draw_cloths(frames: Any) -> "Figure":
    from ..figures.canvas import canvas
    from ..figures.scene_drawing import draw_cloth

    moments, times, pinned = frames
    rows = -(-len(times) // FILMSTRIP)
    figure, axes = canvas(2.1 * rows, FILMSTRIP, rows, sharex=True, sharey=True)
    for ax in axes:
        ax.set_aspect("equal")
        ax.axis("off")
    for ax, positions, time in zip(axes, moments, times, strict=False):
        draw_cloth(ax, positions, pinned)
        ax.set_title(f"{time:.1f} s", fontweight="normal", loc="center")
    return figure


def _points_by_spacing(ax: "Axes", curve: Any, spacing: Any) -> "ScalarMappable":
    """Draw the points of a shade as a single path, a tenth of the file; return the scale."""
    import matplotlib as mpl
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LogNorm

    scale = ScalarMappable(LogNorm(1e-4, 1), mpl.colormaps["viridis"].resampled(SHADES))
    points, shades = np.stack(project(curve[:-1], ARM_VIEW)[:2], axis=-1), scale.to_rgba(spacing)
    for shade in np.unique(shades, axis=0):
        ends = points[(shades == shade).all(axis=-1)][:, None] + [[0, 0], [1e-3, 0], [np.nan, 0]]
        ax.plot(*ends.reshape(-1, 2).T, color=shade, lw=2, solid_capstyle="round", zorder=5)
    return scale


def arm_motion(results: Results) -> Scene | None:
    """Return the arm on the custom curve, by each solver on record; None if there is none."""
    records = _first(results, ARM_MOTION, MAX_ARMS)
    if not records:
        return None
    return Scene(
        **CAPTIONS.figure("arm"),
        motions=[Moving(label(r.solver), r.values.positions, r.values.error) for r in records],
        seconds=DRAWING / len(records[0].values.positions),
        view=ARM_VIEW,
        panes=2,
        curve=records[0].values.curve,
    ).checked()


def cloth_motion(results: Results) -> Scene | None:
    """Return the falling cloth by each solver on record; None if there is none."""
    records = _first(results, CLOTH_MOTION, MAX_CLOTHS)
    if not records:
        return None
    return Scene(
        **CAPTIONS.figure("cloth"),
        motions=[_cloth(record) for record in records],
        seconds=records[0].values.h * records[0].values.every,
        view=CLOTH_VIEW,
        panes=2,
        marked=records[0].values.pinned.tolist(),
    ).checked()


def _cloth(record: Record) -> Moving:
    motion: MovingCloth = record.values
    count = record.values.iterations
    iterations = "converged" if count > FEW else counted(count, "iteration")
    rms = np.sqrt(np.mean(motion.distance**2, axis=-1))
    name = f"{label(record.solver)}, {iterations}"
    return Moving(name, motion.positions, rms, motion.distance)


def _first(results: Results, task: str, maximum: int) -> Sequence[Record]:
    """Return the visible records of a task: users’ solvers first, then in their order."""
    records = results.all("pictures", task=task)
    order = sorted(records, key=lambda r: (r.solver not in results.user_solvers, r.values.order))
    return order[:maximum]


def _curve(record: Record) -> str:
    return "resampled" if record.values.evened else "as drawn"


def _largest_rotation(record: Record) -> float:
    return float(record.values.largest_angle.max())


_gap = partial(Column, unit="m", group="gap")
_rotation = partial(Column, unit="°", group="rotation of a joint")
COLUMNS = (
    text("curve", _curve),
    Column("points", read=lambda record: len(record.values.curve)),
    _gap("gap, smallest", read=lambda record: record.values.spacing.min()),
    _gap("gap, median", read=lambda record: np.median(record.values.spacing)),
    _gap("gap, largest", read=lambda record: record.values.spacing.max()),
    _rotation("rotation of a joint, mean", read=lambda record: record.values.mean_angle.mean()),
    _rotation("rotation of a joint, largest", read=_largest_rotation),
    Column("largest number of iterations", read=lambda record: record.values.iterations.max()),
    Column("largest residual", "m", read=lambda record: record.values.residual.max()),
)


def _summary(records: Sequence[Record]) -> Summary:
    angles = [words_in(_largest_rotation(record), "°") for record in records]
    angle = " when the curve is as drawn, and by up to ".join(angles[:2])
    resampled = " when it is resampled" * (len(records) > 1)
    sentence = f"Between frames a joint rotates by up to {angle}{resampled}."
    return Summary(sentence, tuple(map(_point, records)))


def _point(record: Record) -> str:
    drawing: ArmDrawing = record.values
    gaps = " to ".join(words(gap) for gap in metrics.extent(drawing.spacing))
    return (
        f"{_curve(record)}: {words(len(drawing.curve))} points, {gaps} m apart; a joint rotates by "
        f"up to {words_in(_largest_rotation(record), '°')} between frames"
    )


def _solvers(records: Sequence[Record]) -> dict[str, str]:
    return {"solvers": listed([label(name) for name in solvers(records)])}


resampling = CAPTIONS.layout(
    "resampling",
    lambda results: results.all("pictures", task=ARM),
    _summary,
    measured=_solvers,
    columns=COLUMNS,
    figures=(arm_draws,),
)

LAYOUTS = (resampling,)
