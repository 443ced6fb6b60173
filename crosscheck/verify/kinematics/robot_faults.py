"""The faults that robots' programs may have: requests read otherwise, and wrong kinematics."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from plumbob.reference import rotation
from plumbob.reference.arguments import FloatArray
from plumbob.reference.skeleton import Pose

from ..sentence import Sentence, with_code
from .faults import TABLE
from .robot_models import IDENTITY
from .robot_textbook import (
    UPRIGHT,
    Inputs,
    RobotFrames,
    RobotSwitches,
    ancestors,
    frames_at,
    jacobians_at,
    roll_pitch_yaw,
)

POSITION_ONLY = "position only"
# Faults in reading the target alone.
TARGET_FAULTS = ("scalar last", POSITION_ONLY)


class RobotFault(NamedTuple):
    """A wrong interpretation of a request, or wrong kinematics."""

    sentence: Sentence  # the mistake, and its correction
    misread: Callable[[Inputs], Inputs] = dict  # returns the inputs with another meaning
    scale: float = 1.0  # of the coordinates of hinges, in radians
    relative: bool = False  # whether coordinates count from the start
    order: str = ""  # of the coordinates, if not that of the joints
    switches: RobotSwitches = RobotSwitches()

    def read(self, inputs: Inputs) -> Inputs:
        """Return the inputs as the solver understands them."""
        return {**inputs, **self.misread(inputs)}

    def coordinates(self, inputs: Inputs, q: FloatArray) -> FloatArray:
        """Return the coordinates that an answer q stands for."""
        q = q[..., np.argsort(self._order(inputs))]
        scaled = np.where(inputs["slides"], q, self.scale * q)
        return inputs["start"] + scaled if self.relative else scaled

    def frames(self, inputs: Inputs, q: FloatArray) -> RobotFrames:
        """Return where the solver believes its joints and its tool at an answer q."""
        return frames_at(self.read(inputs), self.coordinates(inputs, q), self.switches)

    def jacobians(self, inputs: Inputs, q: FloatArray) -> Iterator[FloatArray]:
        """Yield the Jacobians at an answer q that the solver may compute."""
        for J in jacobians_at(self.read(inputs), self.coordinates(inputs, q), self.switches):
            yield J[..., self._order(inputs)]

    def _order(self, inputs: Inputs) -> np.ndarray:
        """Return the joint of each coordinate."""
        joints = np.arange(len(inputs["parents"]))
        if self.order == "chain":
            return np.argsort(1.0 - ancestors(inputs), kind="stable")
        return joints[::-1] if self.order == "reversed" else joints

    def targets(self, inputs: Inputs, targets: Pose) -> Pose:
        """Return targets as the solver understands them."""
        read = self.misread({**inputs, "target_rotation": targets.rotations})
        return targets._replace(rotations=read.get("target_rotation", targets.rotations))


RIGHT = RobotFault(Sentence("", {}))
_QUATERNIONS = ("orientations", "tool_rotation", "target_rotation")


def _converted(
    convert: Callable[[FloatArray], FloatArray], names: Sequence[str], inputs: Inputs
) -> Inputs:
    """Return the quaternions of these names, as far as a request has them, converted."""
    return {name: convert(inputs[name]) for name in names if name in inputs}


def _other_angles(
    quaternions: FloatArray,
    order: str = "xyz",
    change: Callable[[FloatArray], FloatArray] = np.asarray,
) -> FloatArray:
    """Return rotations whose roll, pitch and yaw are changed, or applied in another order."""
    matrices = rotation.to_matrix(quaternions).reshape(-1, 3, 3)
    angles = np.array([roll_pitch_yaw(R) for R in matrices])
    others = Rotation.from_euler(order, change(angles)).as_quat(scalar_first=True)
    return np.array(others).reshape(quaternions.shape)


def _scalar_last(quaternions: FloatArray) -> FloatArray:
    return np.roll(quaternions, 1, axis=-1)


# The inputs that a fault reads otherwise.
MISREAD: Mapping[str, Callable[[Inputs], Inputs]] = {
    "tool ignored": lambda inputs: {"tool_position": np.zeros(3), "tool_rotation": IDENTITY},
    "tool's position ignored": lambda inputs: {"tool_position": np.zeros(3)},
    "tool's rotation ignored": lambda inputs: {"tool_rotation": IDENTITY},
    "orientations ignored": lambda inputs: {
        "orientations": rotation.identity(len(inputs["parents"]))
    },
    "axes of the parent": lambda inputs: {
        "axes": rotation.rotate(rotation.conjugate(inputs["orientations"]), inputs["axes"])
    },
    "scalar last": partial(_converted, _scalar_last, _QUATERNIONS[2:]),
    "every scalar last": partial(_converted, _scalar_last, _QUATERNIONS),
    "inverse rotations": partial(_converted, rotation.conjugate, _QUATERNIONS),
    "inverse frames": partial(_converted, rotation.conjugate, _QUATERNIONS[:2]),
    "yaw first": partial(_converted, partial(_other_angles, order="XYZ"), _QUATERNIONS[:2]),
    "roll for yaw": partial(
        _converted, partial(_other_angles, change=lambda angles: angles[:, ::-1]), _QUATERNIONS[:2]
    ),
    "angles taken for degrees": partial(
        _converted, partial(_other_angles, change=np.radians), _QUATERNIONS[:2]
    ),
    "axes along z": lambda inputs: {"axes": np.tile(UPRIGHT, (len(inputs["parents"]), 1))},
    "signs of axes lost": lambda inputs: {"axes": np.abs(inputs["axes"])},
    "origins rotated by their frames": lambda inputs: {
        "origins": rotation.rotate(inputs["orientations"], inputs["origins"]),
        "tool_position": rotation.rotate(inputs["tool_rotation"], inputs["tool_position"]),
    },
    "parents ignored": lambda inputs: {"parents": np.arange(len(inputs["parents"])) - 1},
    "effector ignored": lambda inputs: {"effector": len(inputs["parents"]) - 1},
    "slides rotate": lambda inputs: {"slides": np.zeros_like(inputs["slides"])},
    "slides ignored": lambda inputs: {
        "axes": np.where(inputs["slides"][:, None], 0.0, inputs["axes"])
    },
    POSITION_ONLY: lambda inputs: {"target_rotation": None},
}


def _load(entries: Mapping[str, Any]) -> Iterator[tuple[str, RobotFault]]:
    """Yield the faults of a table by their keys: that of an entry, or one of each in a range."""
    for key, entry in entries.items():
        settings = {k: entry[k] for k in ("scale", "relative", "order") if k in entry}
        words = with_code(entry["code"], Sentence(entry["sentence"], {}))
        fault = RobotFault(words, MISREAD.get(key, dict), **settings)
        switch, numbers = next(iter(entry.get("switch", {}).items()), ("hinge", 0))
        first, last = numbers if isinstance(numbers, list) else (numbers, numbers)
        for number in range(first, last + 1):
            name = key if number == first else f"{key} {number}"
            yield name, fault._replace(switches=RobotSwitches(**{switch: number}))


# Faults that show in coordinates, and those that show in Jacobians and steps only.
FAULTS = dict(_load(TABLE["robots"]))
JACOBIAN_FAULTS = dict(_load(TABLE["robot_jacobian"]))
