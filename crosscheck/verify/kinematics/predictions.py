"""What the textbook, right or with faults, answers to a case."""

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np

from plumbob.reference import rotation
from plumbob.reference.arguments import FloatArray, IndexArray

from ..case import Case
from ..explain import Variant
from .faults import combinations, switches
from .textbook import SOLVERS, Chain, Ending, Pose, Switches, place_all

RIGHT = Switches()


def path_to(parents: IndexArray, effector: int) -> IndexArray:
    """Return the joints from the root to the effector, both included."""
    path = [int(effector)]
    while parents[path[-1]] >= 0:
        path.append(int(parents[path[-1]]))
    return np.array(path[::-1], dtype=np.int64)


def forward(inputs: Mapping[str, Any], switched: Switches = RIGHT) -> tuple[FloatArray, FloatArray]:
    """Return positions and global rotations of all joints."""
    pose = _unplaced(_read(inputs["local_rotations"], switched))
    chain = Chain(inputs["parents"], inputs["offsets"], np.zeros(0, dtype=np.int64))
    place_all(chain, switched, pose)
    return pose.positions, pose.rotations


def _unplaced(local: FloatArray) -> Pose:
    return Pose(local, np.empty((len(local), 3)), np.empty((len(local), 4)))


def solve(
    method: str, inputs: Mapping[str, Any], switched: Switches = RIGHT
) -> tuple[FloatArray, FloatArray, int]:
    """Return local rotations, positions as the solver has them, and the number of sweeps."""
    parents = inputs["parents"]
    pose = _unplaced(np.array(_read(inputs["local_rotations"], switched)))
    effector = len(parents) - 1 if switched.effector == 1 else inputs["effector"]
    chain = Chain(parents, inputs["offsets"], path_to(parents, effector))
    target = tuple(inputs["target"].tolist())
    ending = Ending(float(inputs["tolerance"]), int(inputs["max_iterations"]))
    made = SOLVERS[method](chain, target, ending, switched, pose)
    return _written(pose.local, switched), pose.positions, made


def _read(local: FloatArray, switched: Switches) -> FloatArray:
    """Return quaternions as a solver of another order understands them."""
    return np.roll(local, 1, axis=-1) if switched.numbers in (1, 2) else local


def _written(local: FloatArray, switched: Switches) -> FloatArray:
    return np.roll(local, -1, axis=-1) if switched.numbers in (2, 3) else local


def variants(method: str, most_faults: int = 3) -> Iterator[Variant]:
    """Yield the textbook's method with all combinations of its faults, the fewest first."""
    task, _, solver = method.rpartition(" ")
    predict: Callable[[Switches, Case], Mapping[str, Any]] = predict_forward
    if method != "forward":
        predict = partial(predict_track if task else predict_inverse, solver)
    for faults in combinations(method):
        if len(faults) > most_faults:
            return
        keys = tuple(fault.key for fault in faults)
        yield Variant(keys, partial(predict, switches(faults)))


def predict_forward(switched: Switches, case: Case) -> Mapping[str, Any]:
    """Return what forward kinematics answers."""
    positions, rotations = forward(case.inputs, switched)
    return {"positions": positions, "rotations": _written(rotations, switched)}


def predict_inverse(method: str, switched: Switches, case: Case) -> Mapping[str, Any]:
    """Return what a solver answers, with `placed`: where its local rotations put the joints.

    The rotations that FABRIK's positions stand for are not unique: each link may twist.
    """
    return _predicted(method, switched, case.inputs)[0]


def _predicted(
    method: str, switched: Switches, inputs: Mapping[str, Any]
) -> tuple[dict[str, Any], FloatArray]:
    """Return what a solver answers, and its local rotations."""
    local, positions, _ = solve(method, inputs, switched)
    local = with_effector_of(local, inputs)
    if method == "ccd":
        return {"positions": positions, "local_rotations": local}, local
    placed, _ = forward({**inputs, "local_rotations": local})
    return {"positions": positions, "placed": placed}, local


def predict_track(method: str, switched: Switches, case: Case) -> Mapping[str, Any]:
    """Return what a solver answers that follows a curve frame by frame."""
    first, curve = case.inputs["local_rotations"], case.inputs["curve"]
    start, shift, frames = first, (0, -1, 1)[switched.frame_target], []
    for i in range(len(curve)):
        target = curve[np.clip(i + shift, 0, len(curve) - 1)]
        inputs = {**case.inputs, "target": target, "local_rotations": start}
        frame, local = _predicted(method, switched, inputs)
        frames.append(frame)
        start = (local, first, rotation.identity(len(first)))[switched.frame_start]
    answer = {name: np.array([frame[name] for frame in frames]) for name in frames[0]}
    for local in answer.get("local_rotations", ()):
        with_effector_of(local, case.inputs)
    return answer


def with_effector_of(local: FloatArray, inputs: Mapping[str, Any]) -> FloatArray:
    """Return rotations with the effector's own as they were, if it moves no joint."""
    effector = inputs["effector"]
    if not (inputs["parents"] == effector).any():
        local[effector] = inputs["local_rotations"][effector]
    return local
