"""Arms of at most six joints: a robot with further joints locked at values of a grid."""

import itertools
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ... import arguments
from ...arguments import FLOAT64, FloatArray, IndexArray, frozen
from ...articulation import FIXED, HINGE, Articulation, joint_transform
from ...jacobians import jacobian
from ...skeleton import Skeleton
from ..bounded_step import FULL_CIRCLE
from ..mechanism import Mechanism
from ..reduce import prepare
from .closed_forms import EXACT, FORMS, HINGES, NEAR, closed_form
from .settle import middle

# The method of an arm without a closed form.
SEARCH = "restarts"
# Values of the redundant joint of seven, evenly spaced, if the caller gives none.
GRID_VALUES = 16
# Random configurations to search for the redundant joint, and its least share in the joint motion
# that leaves the effector in place.
SAMPLES, LEAST_SHARE = 16, 0.01


class Arm(NamedTuple):
    """A robot with some joints locked."""

    articulation: Articulation  # its locked joints are fixed
    mechanism: Mechanism  # the joints that move the effector
    method: str  # the name of its closed form, or SEARCH
    is_exact: bool  # whether its axes are those of the form to rounding
    block: FloatArray  # its record (ARM) for the kernel, as floats
    columns: IndexArray  # of the mechanism's coordinates among the robot's
    rest: FloatArray  # coordinates of the robot: locked values, else neutral
    is_plain: bool  # whether it has a closed form, and the robot no other coordinates


class Arms(NamedTuple):
    """All arms of a robot on a grid, and the values of the locked joints by their names."""

    members: tuple[Arm, ...]
    grid: dict[str, FloatArray]
    turn_limits: FloatArray  # see IKSolutions


def arms_of(model: Articulation, effector: int, grid: Mapping[Any, ArrayLike] | None) -> Arms:
    """Return the arms of a robot, by default cached by the robot.

    Raises:
        ValueError: if a joint above the effector is no hinge or slide, a joint of the grid has no
            coordinate, a value is beyond its limits, or more than six joints remain.
    """
    key = "all_solutions", effector
    cached = model.mechanisms.get(key) if grid is None else None
    if cached is not None:
        return cached
    mechanism = prepare(model, (effector,), (True,)).mechanism
    for j, kind in enumerate(model.kinds):
        if kind in ("ball", "free") and j in model.skeleton.path(effector):
            raise ValueError(f"robot: expected hinges and slides, got {kind} {model.names[j]!r}")
    values = _checked_grid(model, grid or {})
    if grid is None and mechanism.freedoms == HINGES + 1:
        values = _default_grid(model, mechanism, effector)
    if mechanism.freedoms - len(set(values) & set(_freedoms(model, mechanism))) > HINGES:
        raise ValueError(
            f"grid: expected joints to lock, so that {HINGES} of {mechanism.freedoms} remain, "
            f"got {len(values)}"
        )
    points = itertools.product(*values.values())
    members = [arm_of(model, effector, dict(zip(values, point, strict=True))) for point in points]
    grid_by_name = {model.names[j]: points for j, points in values.items()}
    arms = Arms(tuple(members), grid_by_name, _turn_limits(members[0]))
    if grid is None:
        model.mechanisms[key] = arms
    return arms


def _freedoms(model: Articulation, mechanism: Mechanism) -> list[int]:
    """Return the joints of a model whose coordinates are a mechanism's."""
    leads = model.joints["leader"] == np.arange(model.joint_count)
    own = leads & (model.joints["kind"] != FIXED)
    return np.flatnonzero(own & np.isin(model.joints["coordinate"], mechanism.columns)).tolist()


def _checked_grid(model: Articulation, grid: Mapping[Any, ArrayLike]) -> dict[int, FloatArray]:
    arguments.instance("grid", grid, Mapping)  # type: ignore[type-abstract]
    values = {}
    for name, numbers in grid.items():
        j = model.index(name, "grid")
        if j in model.mimics or model.kinds[j] not in ("hinge", "slide"):
            raise ValueError(f"grid: expected hinges or slides, no mimics, got {model.names[j]!r}")
        values[j] = np.atleast_1d(arguments.array("grid", numbers, "..."))
        arguments.check_shape("grid", values[j], "value")
        if not len(values[j]):
            raise ValueError(f"grid: expected values of {model.names[j]!r}, got none")
        outside = (values[j] < model.lower[j]) | (values[j] > model.upper[j])
        if outside.any():
            limits = f"from {model.lower[j]:g} to {model.upper[j]:g}"
            raise ValueError(f"grid: expected values {limits}, got {values[j][outside][0]:g}")
    return values


def _default_grid(model: Articulation, mechanism: Mechanism, effector: int) -> dict[int, Any]:
    """Return values of the joint with the largest motion while the effector stays.

    Joints without which the arm has a closed form come first.
    """
    joints = _freedoms(model, mechanism)
    q = model.random(np.random.default_rng(0), SAMPLES)
    freedoms = [model.freedoms_of(j).start for j in joints]
    motions = np.linalg.svd(jacobian(model, q, effector)[..., freedoms])[2][:, -1]
    scores = np.abs(motions).mean(axis=0)
    for i, j in enumerate(joints):
        locked = {j: float(q[0, model.coordinates_of(j)][0])}
        scores[i] += arm_of(model, effector, locked).method != SEARCH and scores[i] > LEAST_SHARE
    j = joints[int(scores.argmax())]
    center = middle(model.lower[j], model.upper[j])
    span = min(model.upper[j] - model.lower[j], FULL_CIRCLE)
    ends = center - 0.5 * span, center + 0.5 * span
    return {j: np.linspace(*ends, GRID_VALUES, endpoint=bool(span < FULL_CIRCLE))}


def arm_of(model: Articulation, effector: int, values: Mapping[int, float]) -> Arm:
    """Return a robot with some joints locked at values."""
    rest = model.neutral()
    for j, value in values.items():
        rest[model.coordinates_of(j)] = value
    articulation, remaining = model, np.arange(model.coordinate_count)
    if values:
        articulation = _locked(model, rest, values)
        remaining = np.delete(remaining, [model.coordinates_of(j).start for j in values])
    mechanism = prepare(articulation, (effector,), (True,)).mechanism
    form = closed_form(mechanism) if mechanism.freedoms == HINGES else None
    columns = remaining[mechanism.columns]
    if form is None or _is_singular(articulation, mechanism, effector):
        return Arm(articulation, mechanism, SEARCH, False, np.empty(0), columns, rest, False)
    is_plain = np.array_equal(columns, np.arange(len(rest)))
    method, is_exact = FORMS[form["form"][0]], bool(form["deviation"][0] <= EXACT)
    block = form.view(FLOAT64)
    return Arm(articulation, mechanism, method, is_exact, block, columns, rest, is_plain)


def _turn_limits(arm: Arm) -> FloatArray:
    """Return the limits of an arm's hinges without followers, else infinity, (2, coordinate)."""
    limits = np.repeat([[-np.inf], [np.inf]], len(arm.rest), axis=1)
    joints = arm.mechanism.joints
    is_single = (joints["leader"] == np.arange(len(joints))) & ~joints["followed"]
    hinges = joints[is_single & (joints["kind"] == HINGE)]
    limits[:, arm.columns[hinges["coordinate"]]] = hinges["lower"], hinges["upper"]
    return frozen(limits)


def _is_singular(model: Articulation, mechanism: Mechanism, effector: int) -> bool:
    """Return whether an arm of hinges is singular in every pose, so that solutions are continua."""
    rng = np.random.default_rng(0)
    q = model.random(rng, SAMPLES)
    q[:, mechanism.columns] = rng.uniform(-np.pi, np.pi, (SAMPLES, HINGES))
    J = jacobian(model, q, effector)
    J[:, :3] /= mechanism.reach
    return bool((np.linalg.svd(J, compute_uv=False)[:, HINGES - 1] < NEAR).all())


def _locked(model: Articulation, q: FloatArray, joints: Mapping[int, float]) -> Articulation:
    """Return a robot with some joints and their followers fixed at coordinates."""
    kinds, frames, offsets = list(model.kinds), model.frames.copy(), model.skeleton.offsets.copy()
    for j, leader in enumerate(model.joints["leader"].tolist()):
        if leader in joints:
            offsets[j], frames[j] = joint_transform(model.joints, j, q)
            kinds[j] = "fixed"
    mimics: dict[int | str, Any] = {
        j: mimic for j, mimic in model.mimics.items() if kinds[j] != "fixed"
    }
    skeleton = Skeleton(model.skeleton.parents, offsets, model.names)
    return Articulation(
        skeleton, kinds, model.axes, frames=frames, lower=model.lower, upper=model.upper,
        cones=model.cones, mimics=mimics,
    )  # fmt: skip
