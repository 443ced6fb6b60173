"""How programs of robots read a request and compute kinematics, right or with a fault."""

from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import scipy

from plumbob.reference import rotation
from plumbob.reference.arguments import FloatArray
from plumbob.reference.rotation import roll_pitch_yaw
from plumbob.reference.skeleton import Pose
from plumbob.text.sentence import Sentence

from .formulas import evaluate
from .robot_models import IDENTITY
from .robot_textbook import RIGHT as RIGHT_RULES
from .robot_textbook import Inputs, RobotFrames, Rules, ancestors, frames_at, jacobians_at, matrices

POSITION_ONLY = "position only"


# Kinematics that differ by less than this are the same [m, rad].
SAME = 1e-9


class RobotFault(NamedTuple):
    """A wrong interpretation of a request, or wrong kinematics."""

    sentence: Sentence  # the mistake, and its correction
    change: Mapping[str, str] = MappingProxyType(
        {}
    )  # formulas of the inputs that it reads otherwise
    scale: float = 1.0  # of the coordinates of hinges, in radians
    relative: bool = False  # whether coordinates count from the start
    order: str = ""  # of the coordinates, if not that of the joints
    rules: Rules = MappingProxyType({})  # that it breaks

    @property
    def is_of_target(self) -> bool:
        """Whether it concerns only where the tool is to go, or seems to be."""
        return {*self.change, *self.rules} in ({"target_rotation"}, {"seen"})

    def read(self, inputs: Inputs) -> dict[str, Any]:
        """Return the inputs as the solver understands them."""
        names = {**inputs, "identity": IDENTITY, "euler": _with_other_angles}
        return {**inputs} | {
            name: evaluate(formula, names) for name, formula in self.change.items() if name in names
        }

    def changes(self, inputs: Inputs) -> bool:
        """Return whether a solver with the fault may differ from a right one on a request."""
        read = self.read(inputs)
        if not all(name in inputs and np.array_equal(read[name], inputs[name]) for name in read):
            return True
        wrong, right = (
            (*fault.frames(inputs, inputs["start"]), *fault.jacobians(inputs, inputs["start"]))
            for fault in (self, RIGHT)
        )
        is_like = [one.shape == other.shape and np.allclose(one, other, atol=SAME)
                   for one, other in zip(wrong, right, strict=False)]  # fmt: skip
        return len(wrong) != len(right) or not all(is_like)

    def coordinates(self, inputs: Inputs, q: FloatArray) -> FloatArray:
        """Return the coordinates that an answer q stands for."""
        q = q[..., np.argsort(self._order(inputs))]
        scaled = np.where(inputs["slides"], q, self.scale * q)
        return inputs["start"] + scaled if self.relative else scaled

    def frames(self, inputs: Inputs, q: FloatArray) -> RobotFrames:
        """Return where the solver believes its joints and its tool at an answer q."""
        frames = frames_at(self.read(inputs), self.coordinates(inputs, q), self.rules)
        seen = self.rules.get("seen", RIGHT_RULES["seen"])
        return frames._replace(rotation=evaluate(seen, {"R": frames.rotation}))

    def jacobians(self, inputs: Inputs, q: FloatArray) -> Iterator[FloatArray]:
        """Yield the Jacobians at an answer q that the solver may compute.

        Axes may be misread in the joints' rotations alone.
        """
        readings = [self.read(inputs)]
        if "axes" in self.change:
            readings.append(readings[0] | {"column_axes": inputs["axes"]})
        for reading in readings:
            for J in jacobians_at(reading, self.coordinates(inputs, q), self.rules):
                yield J[..., self._order(inputs)]

    def _order(self, inputs: Inputs) -> np.ndarray:
        """Return the joint of each coordinate."""
        joints = np.arange(len(inputs["parents"]))
        if self.order == "chain":
            return np.argsort(1.0 - ancestors(inputs), kind="stable")
        return joints[::-1] if self.order == "reversed" else joints

    def targets(self, inputs: Inputs, targets: Pose) -> tuple[FloatArray, FloatArray | None]:
        """Return positions, (..., 3), and matrices of targets as the solver understands them."""
        read = self.read({**inputs, "target_rotation": targets.rotations})["target_rotation"]
        turned = None if read is None else matrices(read, {**RIGHT_RULES, **self.rules})
        return targets.positions, turned


RIGHT = RobotFault(Sentence("", {}))


def _with_other_angles(
    quaternions: FloatArray, order: str, columns: Sequence[int] = (0, 1, 2), scale: float = 1.0
) -> FloatArray:
    """Return rotations whose roll, pitch and yaw are changed, or applied in another order."""
    turns = rotation.to_matrix(quaternions).reshape(-1, 3, 3)
    angles = scale * np.array([roll_pitch_yaw(R) for R in turns])[:, columns]
    alternatives = scipy.spatial.transform.Rotation.from_euler(order, angles).as_quat(
        scalar_first=True
    )
    return np.array(alternatives).reshape(quaternions.shape)
