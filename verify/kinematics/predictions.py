"""Answers of the textbook's solvers, right or with faults."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import scipy

from plumbob.reference import rotation
from plumbob.reference.arguments import FloatArray, IndexArray

from ..case import Case
from .switches import ANGLES, EULER_ORDERS, Switches
from .textbook import (
    SOLVERS,
    Ending,
    TextbookChain,
    TextbookPose,
    place_all,
)

RIGHT = Switches()
IN_DEGREES = "degrees for radians"
REVERSED, CONJUGATED = "product of quaternions reversed", "local rotation conjugated"


def path_to(parents: IndexArray, effector: int) -> IndexArray:
    """Return the joints from the root to the effector, both included."""
    path = [int(effector)]
    while parents[path[-1]] >= 0:
        path.append(int(parents[path[-1]]))
    return np.array(path[::-1], dtype=np.int64)


def forward(inputs: Mapping[str, Any], switched: Switches = RIGHT) -> tuple[FloatArray, FloatArray]:
    """Return positions and global rotations of all joints."""
    pose = _read(inputs, switched)
    chain = TextbookChain(inputs["parents"], inputs["offsets"], np.zeros(0, dtype=np.int64))
    place_all(chain, switched, pose)
    return pose.positions, pose.rotations


def solve(
    method: str, inputs: Mapping[str, Any], switched: Switches = RIGHT
) -> tuple[FloatArray, FloatArray, int]:
    """Return local rotations, the solver's positions, and the number of sweeps."""
    parents = inputs["parents"]
    pose = _read(inputs, switched)
    effector = len(parents) - 1 if switched.effector == 1 else inputs["effector"]
    path = path_to(parents, effector)[int(switched.effector == 2) :]
    chain = TextbookChain(parents, np.array(inputs["offsets"]), path)
    target = tuple(inputs["target"].tolist())
    ending = Ending(float(inputs["tolerance"]), int(inputs["max_iterations"]))
    sweeps = SOLVERS[method](chain, target, ending, switched, pose)
    return _reordered(pose.local, switched), pose.positions, sweeps


def _read(inputs: Mapping[str, Any], switched: Switches) -> TextbookPose:
    """Return the start, its quaternions in the order that the solver expects."""
    local = np.array(inputs["local_rotations"])
    if switched.numbers in (1, 2):
        local = np.roll(local, 1, axis=-1)
    elif switched.numbers == 4:  # w is computed as a square root
        local[:, 0] = np.abs(local[:, 0])
    elif switched.numbers in (5, 13):
        local[:, 1:] *= -1.0
    elif switched.numbers in (8, 9):
        local = np.roll(local, -1, axis=-1)
    if switched.angles:
        local = _as_euler_angles(local, *ANGLES[switched.angles - 1])
    if switched.euler:
        local = _through_euler_angles(local, *EULER_ORDERS[switched.euler - 1])
    return TextbookPose(local, np.zeros((len(local), 3)), rotation.identity(len(local)))


def _through_euler_angles(local: FloatArray, order: str, other_order: str) -> FloatArray:
    """Return rotations with Euler angles of an order put together in another."""
    angles = scipy.spatial.transform.Rotation.from_quat(local, scalar_first=True).as_euler(
        order, suppress_warnings=True
    )
    columns = [order.upper().index(axis) for axis in other_order.upper()]
    if order[0] == order[2]:
        columns = [0, 1, 2]
    rotations = scipy.spatial.transform.Rotation.from_euler(other_order, angles[:, columns])
    return np.array(rotations.as_quat(scalar_first=True))


def _as_euler_angles(local: FloatArray, order: str, is_degrees: bool) -> FloatArray:
    """Return rotations of Euler angles in degrees as if in radians, or of x, y, z as angles."""
    if is_degrees:
        rotations = scipy.spatial.transform.Rotation.from_quat(local, scalar_first=True)
        angles = np.degrees(rotations.as_euler(order, suppress_warnings=True))
    else:
        angles = local[:, 1:][:, ["XYZ".index(axis) for axis in order]]
    return np.array(
        scipy.spatial.transform.Rotation.from_euler(order, angles).as_quat(scalar_first=True)
    )


def _reordered(rotations: FloatArray, switched: Switches) -> FloatArray:
    """Return quaternions in the order in which the solver writes them."""
    if switched.numbers in (6, 13):  # the conjugates
        return rotations * [1.0, -1.0, -1.0, -1.0]
    if switched.numbers == 9:
        return np.roll(rotations, 1, axis=-1)
    if switched.numbers == 14:  # all rows as one
        return np.roll(np.roll(rotations, -1, axis=-1), 1)
    if switched.numbers == 10:
        return np.abs(rotations)
    if switched.numbers == 11:
        return np.column_stack([np.abs(rotations[:, 0]), rotations[:, 1:]])
    return np.roll(rotations, -1, axis=-1) if switched.numbers in (2, 3) else rotations


def predict_forward(switched: Switches, case: Case) -> Mapping[str, Any]:
    """Return the outputs of forward kinematics."""
    positions, rotations = forward(case.inputs, switched)
    local, parents = case.inputs["local_rotations"], case.inputs["parents"]
    if switched.numbers == 7:
        rotations = local
    elif switched.numbers == 12:
        above = np.where((parents >= 0)[:, None], local[parents], rotation.identity(len(parents)))
        rotations = rotation.multiply(above, local)
    elif switched.numbers == 15:
        rotations = rotations[np.maximum(parents, 0)]
    elif switched.numbers == 16:
        rotations = forward(case.inputs, Switches(product=1))[1]
    return {"positions": positions, "rotations": _reordered(rotations, switched)}


def predict_inverse(method: str, switched: Switches, case: Case) -> Mapping[str, Any]:
    """Return the outputs of a solver; of FABRIK the path's: its points, and those of its rotations.

    Joints off the path depend on how a program turns a link about itself, which is its choice.
    """
    return _outputs(method, switched, case.inputs)[0]


def _outputs(
    method: str, switched: Switches, inputs: Mapping[str, Any]
) -> tuple[dict[str, Any], FloatArray, int]:
    """Return the outputs of a solver, its local rotations and the number of its sweeps."""
    local, positions, sweeps = solve(method, inputs, switched)
    local = with_effector_of(local, inputs)
    with np.errstate(all="ignore"):  # as the answers are read
        local = local / np.linalg.norm(local, axis=-1, keepdims=True)
    path = path_to(inputs["parents"], inputs["effector"])
    if switched.returned and method == "ccd":
        positions = _older_positions(method, switched, inputs)
    outputs = {"path_positions": positions[path], "all_positions": positions}
    if method == "ccd":
        return outputs | {"positions": positions, "local_rotations": local}, local, sweeps
    placed, _ = forward({**inputs, "local_rotations": local})
    return outputs | {"path_placed": placed[path]}, local, sweeps


def _older_positions(method: str, switched: Switches, inputs: Mapping[str, Any]) -> FloatArray:
    """Return the positions before the last rotation (1) or sweep (2) of a solve, or its start's."""
    _, latest, sweeps = solve(method, inputs, switched)
    links = len(path_to(inputs["parents"], inputs["effector"])) - 1
    counts = (sweeps, sweeps * links - 1, sweeps - 1, 0)
    if sweeps == 0:
        return latest
    switched = switched._replace(budget=3 if switched.returned == 1 else switched.budget)
    inputs = {**inputs, "tolerance": 0.0, "max_iterations": counts[switched.returned]}
    return solve(method, inputs, switched)[1]


def predict_track(method: str, switched: Switches, case: Case) -> Mapping[str, Any]:
    """Return the outputs of a solver that follows a curve frame by frame."""
    first, budget = case.inputs["local_rotations"], case.inputs["max_iterations"]
    start, frames = first, list[dict[str, Any]]()
    curve = _targets(case.inputs, switched.frame_target)
    for i, target in enumerate(curve):
        left_out = (False, i % 2 == 1, i == 0, False, i == len(curve) - 1)
        inputs = {**case.inputs, "target": target, "local_rotations": start}
        inputs["max_iterations"] = 0 if left_out[switched.frame_solved] else budget
        frame, local, sweeps = _outputs(method, switched, inputs)
        budget -= sweeps * (switched.frame_solved == 3)
        if switched.frame_saved == 4:
            frame |= _with_global_rotations(inputs, local, frame)
        frames.append(frame)
        start = (local, first, rotation.identity(len(first)))[min(switched.frame_start, 2)]
        if switched.frame_start == 3:
            start = forward({**inputs, "local_rotations": local})[1]
    if switched.frame_saved in (1, 5):  # before it is solved
        first_case = {**case.inputs, "target": curve[0], "max_iterations": 0}
        earlier = [_outputs(method, switched, first_case)[0], *frames[:-1]]
        names = [name for name in frames[0] if switched.frame_saved == 1 or "positions" in name]
        frames = [
            {**frame, **{name: before[name] for name in names}}
            for frame, before in zip(frames, earlier, strict=True)
        ]
    outputs = {name: np.array([frame[name] for frame in frames]) for name in frames[0]}
    for name in {2: ("local_rotations", "path_placed"), 3: outputs}.get(switched.frame_saved, ()):
        if name in outputs:
            outputs[name][:] = outputs[name][-1]
    if switched.frame_saved == 6:
        outputs["path_positions"][:, -1] = case.inputs["curve"]
        for name in {"positions", "all_positions"} & outputs.keys():
            outputs[name][:, case.inputs["effector"]] = case.inputs["curve"]
    for local in outputs.get("local_rotations", ()):
        with_effector_of(local, case.inputs)
    return outputs


def _targets(inputs: Mapping[str, Any], fault: int) -> FloatArray:
    """Return the target of each frame, as a solver with a fault has them, (frame, 3)."""
    curve, frame = inputs["curve"], np.arange(len(inputs["curve"]))
    effector = forward(inputs)[0][inputs["effector"]]
    shift = {1: -1, 2: 1}.get(fault, 0)
    targets = np.array(curve[np.clip(frame + shift, 0, len(curve) - 1)])
    if fault == 3:
        targets[1:-1] = (curve[:-2] + curve[1:-1] + curve[2:]) / 3.0
    elif fault in (4, 6):
        targets += effector - curve[0] if fault == 4 else forward(inputs)[0][0]
    for i in frame if fault == 5 else ():
        targets[i] = 0.5 * (targets[i] + (targets[i - 1] if i else effector))
    return targets


def _with_global_rotations(
    inputs: Mapping[str, Any], local: FloatArray, frame: Mapping[str, Any]
) -> dict[str, Any]:
    """Return the outputs in which global rotations stand for local ones."""
    rotations = forward({**inputs, "local_rotations": local})[1]
    if "local_rotations" in frame:
        return {"local_rotations": rotations}
    path = path_to(inputs["parents"], inputs["effector"])
    return {"path_placed": forward({**inputs, "local_rotations": rotations})[0][path]}


def with_effector_of(local: FloatArray, inputs: Mapping[str, Any]) -> FloatArray:
    """Put back the rotation of an effector without children, which moves no joint."""
    effector = inputs["effector"]
    if not (inputs["parents"] == effector).any():
        local[effector] = inputs["local_rotations"][effector]
    return local
