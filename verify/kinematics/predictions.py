"""Answers of the textbook's solvers, or of honest programs that make other choices."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from plumbob.reference import rotation
from plumbob.reference.arguments import FloatArray, IndexArray
from plumbob.reference.backend.compiled import Kernel
from plumbob.reference.kinematics import forward_pose

from ..case import Case
from .textbook import SOLVERS, Choices, Ending, TextbookChain, TextbookPose

TEXTBOOK = Choices()
PLACE = Kernel(forward_pose, label="forward kinematics of the judge")


def path_to(parents: IndexArray, effector: int) -> IndexArray:
    """Return the joints from the root to the effector, both included."""
    path = [int(effector)]
    while parents[path[-1]] >= 0:
        path.append(int(parents[path[-1]]))
    return np.array(path[::-1], dtype=np.int64)


def forward(inputs: Mapping[str, Any]) -> tuple[FloatArray, FloatArray]:
    """Return positions and global rotations of all joints."""
    pose = _start(inputs)
    PLACE(inputs["parents"], inputs["offsets"], *pose)
    return pose.positions, pose.rotations


def solve(
    method: str, inputs: Mapping[str, Any], choices: Choices = TEXTBOOK
) -> tuple[FloatArray, FloatArray, int]:
    """Return local rotations, the solver's positions, and the number of sweeps."""
    parents, pose = inputs["parents"], _start(inputs)
    chain = TextbookChain(parents, inputs["offsets"], path_to(parents, inputs["effector"]))
    target = tuple(inputs["target"].tolist())
    ending = Ending(float(inputs["tolerance"]), int(inputs["max_iterations"]))
    sweeps = SOLVERS[method](chain, target, ending, choices, pose)
    return pose.local, pose.positions, sweeps


def _start(inputs: Mapping[str, Any]) -> TextbookPose:
    local = np.array(inputs["local_rotations"])
    return TextbookPose(local, np.zeros((len(local), 3)), rotation.identity(len(local)))


def predict_inverse(method: str, choices: Choices, case: Case) -> Mapping[str, Any]:
    """Return the outputs of a solver; of FABRIK the path's: its points, and those of its rotations.

    Joints off the path depend on how a program turns a link about itself, which is its choice.
    """
    return _outputs(method, choices, case.inputs)[0]


def _outputs(
    method: str, choices: Choices, inputs: Mapping[str, Any]
) -> tuple[dict[str, Any], FloatArray]:
    """Return the outputs of a solver, and its local rotations."""
    local, positions, _ = solve(method, inputs, choices)
    local = with_effector_of(local, inputs)
    with np.errstate(all="ignore"):  # as the answers are read
        local = local / np.linalg.norm(local, axis=-1, keepdims=True)
    path = path_to(inputs["parents"], inputs["effector"])
    outputs = {"path_positions": positions[path], "all_positions": positions}
    if method == "ccd":
        return outputs | {"positions": positions, "local_rotations": local}, local
    placed, _ = forward({**inputs, "local_rotations": local})
    return outputs | {"path_placed": placed[path]}, local


def predict_track(method: str, case: Case, starts_anew: bool = False) -> Mapping[str, Any]:
    """Return the outputs of a solver that follows a curve, from the frame before or the start."""
    inputs, frames = dict(case.inputs), list[dict[str, Any]]()
    for target in case.inputs["curve"]:
        frame, local = _outputs(method, TEXTBOOK, {**inputs, "target": target})
        frames.append(frame)
        if not starts_anew:
            inputs["local_rotations"] = local
    outputs = {name: np.array([frame[name] for frame in frames]) for name in frames[0]}
    for local in outputs.get("local_rotations", ()):
        with_effector_of(local, case.inputs)
    return outputs


def with_effector_of(local: FloatArray, inputs: Mapping[str, Any]) -> FloatArray:
    """Put back the rotation of an effector without children, which moves no joint."""
    effector = inputs["effector"]
    if not (inputs["parents"] == effector).any():
        local[effector] = inputs["local_rotations"][effector]
    return local
