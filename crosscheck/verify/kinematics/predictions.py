"""What the textbook, right or with faults, answers to a case."""

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np

from plumbob.reference import rotation
from plumbob.reference.arguments import FloatArray, IndexArray

from ..case import Case
from ..explain import Variant
from .faults import Switches, combinations, switches
from .textbook import Chain, Damping, Ending, Pose, ccd_all, fabrik_all, place_all

UNDAMPED = Damping()
RIGHT = Switches()


def path_to(parents: IndexArray, effector: int) -> IndexArray:
    """Return the joints from the root to the effector, both included."""
    path = [int(effector)]
    while parents[path[-1]] >= 0:
        path.append(int(parents[path[-1]]))
    return np.array(path[::-1], dtype=np.int64)


def forward(
    inputs: Mapping[str, Any], switched: Switches = RIGHT, local: FloatArray | None = None
) -> tuple[FloatArray, FloatArray]:
    """Return positions and global rotations of all joints."""
    local = _read(inputs["local_rotations"], switched) if local is None else local
    pose = _unplaced(local)
    chain = Chain(inputs["parents"], inputs["offsets"], np.zeros(0, dtype=np.int64))
    place_all(chain, switched.forward, pose)
    return pose.positions, pose.rotations


def _unplaced(local: FloatArray) -> Pose:
    return Pose(local, np.empty((len(local), 3)), np.empty((len(local), 4)))


def solve(
    method: str,
    inputs: Mapping[str, Any],
    switched: Switches = RIGHT,
    damping: Damping = UNDAMPED,
) -> tuple[FloatArray, FloatArray, int]:
    """Return local rotations, positions as the solver has them, and the number of sweeps."""
    parents = inputs["parents"]
    pose = _unplaced(np.array(_read(inputs["local_rotations"], switched)))
    last = switched.ccd.effector == 1 or switched.fabrik.effector == 1
    path = path_to(parents, len(parents) - 1 if last else inputs["effector"])
    chain = Chain(parents, inputs["offsets"], path)
    target = tuple(inputs["target"].tolist())
    ending = Ending(float(inputs["tolerance"]), int(inputs["max_iterations"]), switched.stop)
    if method == "ccd":
        made = ccd_all(chain, target, ending, switched.forward, switched.ccd, damping, pose)
    else:
        made = fabrik_all(chain, target, ending, switched.forward, switched.fabrik, pose)
    return _written(pose.local, switched), pose.positions, made


def _read(local: FloatArray, switched: Switches) -> FloatArray:
    """Return quaternions as a solver of another order understands them."""
    return np.roll(local, 1, axis=-1) if switched.order.numbers in (1, 2) else local


def _written(local: FloatArray, switched: Switches) -> FloatArray:
    return np.roll(local, -1, axis=-1) if switched.order.numbers in (2, 3) else local


def variants(method: str, most_faults: int = 3) -> Iterator[Variant]:
    """Yield the textbook's method with all combinations of its faults, the fewest first."""
    predict: Callable[[Switches, Case], Mapping[str, Any]]
    if method == "forward":
        predict = predict_forward
    elif method.startswith("track "):
        predict = partial(predict_track, method.removeprefix("track "))
    else:
        predict = partial(predict_inverse, method)
    for faults in combinations(method):
        if len(faults) > most_faults:
            return
        keys = tuple(fault.key for fault in faults)
        yield Variant(keys, partial(predict, switches(faults)))


def predict_forward(switched: Switches, case: Case) -> Mapping[str, Any]:
    """Return what forward kinematics answers."""
    positions, rotations = forward(case.inputs, switched)
    return {"positions": positions, "rotations": _written(rotations, switched)}


def predict_inverse(
    method: str, switched: Switches, case: Case, damping: Damping = UNDAMPED
) -> Mapping[str, Any]:
    """Return what a solver answers, with `placed`: where its local rotations put the joints.

    The rotations that FABRIK's positions stand for are not unique: each link may twist.
    """
    inputs = case.inputs
    local, positions, _ = solve(method, inputs, switched, damping)
    local = with_effector_of(local, inputs)
    if method == "ccd":
        return {"positions": positions, "local_rotations": local}
    return {"positions": positions, "placed": forward(inputs, local=local)[0]}


def predict_track(method: str, switched: Switches, case: Case) -> Mapping[str, Any]:
    """Return what a solver answers that follows a curve frame by frame."""
    first = case.inputs["local_rotations"]
    inputs = {key: value for key, value in case.inputs.items() if key != "curve"}
    curve, follow, start = case.inputs["curve"], switched.follow, first
    frames = []
    for i in range(len(curve)):
        shift = (0, -1, 1)[follow.aim]
        inputs["target"] = curve[np.clip(i + shift, 0, len(curve) - 1)]
        inputs["local_rotations"] = start
        frames.append(predict_inverse(method, switched, Case("", "", inputs, "", case.about)))
        if follow.start == 0:
            local, _, _ = solve(method, inputs, switched)
            start = with_effector_of(local, inputs)
        elif follow.start == 2:
            start = rotation.identity(len(first))
    found = {name: np.array([frame[name] for frame in frames]) for name in frames[0]}
    for local in found.get("local_rotations", ()):
        with_effector_of(local, case.inputs)
    return found


def with_effector_of(local: FloatArray, inputs: Mapping[str, Any]) -> FloatArray:
    """Return rotations with the effector's own as they were, if it moves no joint."""
    effector = inputs["effector"]
    if not (inputs["parents"] == effector).any():
        local[effector] = inputs["local_rotations"][effector]
    return local
