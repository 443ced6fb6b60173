"""One solve from plain arrays, with little between the caller and the kernel.

What `solve_checked` does for anything takes as long as the kernel where there is one start and one
target: a third of a call on a chain of ten balls. So it is done here in fewer steps for float64
arrays of the right shape. Whatever else comes, or has a number that the kernel refuses, is left to
`solve_checked`.
"""

from typing import Any

import numpy as np

from ..arguments import FLOAT64, LARGEST_COORDINATE, SMALLEST_POSITIVE, FloatArray
from ..articulation import Articulation
from ..model import effector_of
from ..quaternion import IDENTITY
from ..skeleton import Skeleton
from .mechanism import TARGET
from .problem import IKSolution, Target
from .reduce import prepare
from .result import FIGURES
from .settings import Settings
from .solve import NO_HISTORY, UNRECORDED, single_solution

NAMES = (int, str, type(None))


def solve_single(
    model: Any, start: Any, target: Any, effector: Any, settings: Settings
) -> IKSolution | None:
    """Return the solution, or None where the arguments are not that plain, or not valid."""
    if settings.record:
        return None
    position: Any = target
    rotation: Any = None
    if type(target) is Target:
        if effector is not None:
            return None
        position, rotation, effector, weight = target
        if type(weight) is not float or not SMALLEST_POSITIVE <= weight <= LARGEST_COORDINATE:
            return None
    if type(effector) not in NAMES or not is_plain(position, (3,)):
        return None
    if type(model) is Skeleton and rotation is None and not settings.limits.restarts:
        return _on_chain(model, start, position, effector, settings)
    if type(model) is Articulation and (rotation is None or is_plain(rotation, (4,))):
        return _on_mechanism(model, start, position, rotation, effector, settings)
    return None


def is_plain(values: Any, shape: tuple[int, ...]) -> bool:
    """Return whether values are a float64 array of a shape that kernels take as it is."""
    return (
        type(values) is np.ndarray
        and values.dtype == FLOAT64
        and values.shape == shape
        and values.flags.carray
    )


def _on_chain(
    model: Skeleton,
    start: FloatArray,
    position: FloatArray,
    effector: int | str | None,
    settings: Settings,
) -> IKSolution | None:
    count = model.joint_count
    if not is_plain(start, (count, 4)):
        return None
    joint = count - 1 if effector is None else model.index(effector, "effector")
    local, positions = np.empty((1, count, 4)), np.empty((1, count, 3))
    figures = np.empty((1, len(FIGURES)))
    valid = settings.solver.chain(
        *model.arrays, model.path_array(joint), settings.numbers, start[None], position[None],
        local, positions, figures, UNRECORDED,
    )  # fmt: skip
    return single_solution(local, positions, figures, NO_HISTORY, local) if valid else None


def _on_mechanism(
    model: Articulation,
    start: FloatArray,
    position: FloatArray,
    rotation: FloatArray | None,
    effector: int | str | None,
    settings: Settings,
) -> IKSolution | None:
    if not is_plain(start, (model.coordinate_count,)):
        return None
    asked = effector, rotation is not None, settings.limits.restarts, settings.seed
    prepared = model.mechanisms.get(asked)
    if prepared is None:
        joint = effector_of(model, effector)
        prepared = prepare(model, (joint,), (rotation is not None,), *asked[2:])
        model.mechanisms[asked] = prepared
    targets = np.empty((1, 1), TARGET)
    row = targets.view(FLOAT64)[0]  # of its fields one after the other
    row[:3], row[3:7], row[7] = position, IDENTITY if rotation is None else rotation, 1.0
    count = model.joint_count
    local, positions = np.empty((1, count, 4)), np.empty((1, count, 3))
    figures, q = np.empty((1, len(FIGURES))), np.empty((1, model.coordinate_count))
    valid = settings.solver.mechanism(
        *prepared.flat, settings.numbers, start[None], targets, local, positions, figures,
        UNRECORDED, q,
    )  # fmt: skip
    return single_solution(local, positions, figures, NO_HISTORY, q) if valid else None
