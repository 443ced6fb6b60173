"""The tasks that a solver may offer: what goes in and what comes out, by name and shape.

The names are those of the keyword arguments of `reference`. A shape's words stand for counts that
are the same throughout a request: joint, frame, particle, spring, pin. A count of an answer that
no input has, as the points of a resampled curve, may be any.
"""

from collections.abc import Mapping
from typing import Any, Literal, NamedTuple

import numpy as np

Kind = Literal["number", "integer", "boolean", "text"]


class Field(NamedTuple):
    """An array, a number or a text of a request or an answer."""

    name: str
    shape: tuple[str | int, ...]  # counts, as numbers or words; () for a single value
    kind: Kind = "number"
    optional: bool = False  # whether it may be left out
    about: str = ""  # what it is, with its unit


class Task(NamedTuple):
    """What a solver is asked."""

    name: str  # as in a request and as the name of a Python function
    about: str
    inputs: tuple[Field, ...]  # in the order in which `reference` names them
    outputs: tuple[Field, ...]  # all may be left out, but not all at once

    def counts(self, inputs: Mapping[str, Any]) -> dict[str, int]:
        """Return what the words of the shapes stand for in this request."""
        counts: dict[str | int, int] = {}
        for field in self.inputs:
            if inputs.get(field.name) is not None:
                counts |= zip(field.shape, np.shape(inputs[field.name]), strict=True)
        if "steps" in inputs:
            counts["frame"] = inputs["steps"]
        return {word: count for word, count in counts.items() if isinstance(word, str)}


_SKELETON = (
    Field("parents", ("joint",), "integer", about="parent of each joint, -1 for the root"),
    Field("offsets", ("joint", 3), about="from the parent, in its frame; the root's is global [m]"),
    Field("local_rotations", ("joint", 4), about="unit quaternions wxyz, relative to the parent"),
)
_EFFECTOR = (
    Field("effector", (), "integer", about="index of the joint that is to reach the target"),
    Field("tolerance", (), about="distance that counts as reached [m]"),
    Field("max_iterations", (), "integer", about="the most sweeps over the chain"),
    Field("method", (), "text", about="ccd, fabrik or what else the greeting declares"),
)
_SYSTEM = (
    Field("masses", ("particle",), about="[kg]"),
    Field("springs", ("spring", 2), "integer", about="the two particles of each spring"),
    Field("rest_lengths", ("spring",), about="[m]"),
    Field("stiffnesses", ("spring",), about="[N/m]"),
    Field("dampings", ("spring",), about="along the spring [N s/m]"),
    Field("gravity", (3,), about="acceleration [m/s^2]"),
)
_STATE = (
    Field("positions", ("particle", 3), about="[m]"),
    Field("velocities", ("particle", 3), about="[m/s]"),
)
_STEP = (
    *_SYSTEM[:5],
    Field("pinned", ("pin",), "integer", about="indices of particles that do not move"),
    _SYSTEM[5],
    *_STATE,
    Field("h", (), about="time step [s]"),
    Field("previous_positions", ("particle", 3), optional=True, about="positions - h velocities"),
    Field("rest_positions", ("particle", 3), optional=True, about="where lengths are at rest [m]"),
    Field("external_forces", ("particle", 3), optional=True, about="besides gravity [N]"),
    Field("tension_only", ("spring",), "boolean", True, "springs that resist no compression"),
)
_ROBOT = (
    Field("parents", ("joint",), "integer", about="parent of each joint, -1 for the base"),
    Field("origins", ("joint", 3), about="of a joint's frame, in its parent's [m]"),
    Field("orientations", ("joint", 4), about="of that frame in its parent's, wxyz, where q is 0"),
    Field("axes", ("joint", 3), about="of unit length, in the joint's own frame"),
    Field("slides", ("joint",), "boolean", about="moves along its axis, else rotates about it"),
    Field("lower", ("joint",), about="least coordinates [rad, m]"),
    Field("upper", ("joint",), about="greatest coordinates [rad, m]"),
    Field("effector", (), "integer", about="index of the joint that carries the tool"),
    Field("tool_position", (3,), about="of the tool, in that joint's frame [m]"),
    Field("tool_rotation", (4,), about="of the tool, in that joint's frame, wxyz"),
    Field("start", ("joint",), about="coordinates to begin from [rad, m]"),
    Field("target_position", (3,), about="of the tool, global [m]"),
    Field("target_rotation", (4,), about="of the tool, global, wxyz"),
    Field("tolerance", (), about="distance that counts as reached [m]"),
    Field("tolerance_rotation", (), about="angle that counts as reached [rad]"),
    Field("max_iterations", (), "integer", about="the most iterations"),
    Field("urdf", (), "text", True, "the same robot as URDF, its tool the link `tool`"),
)

_TASKS = (
    Task(
        "forward_kinematics", "Return the global positions and rotations of all joints.", _SKELETON,
        (
            Field("positions", ("joint", 3), about="global [m]"),
            Field("rotations", ("joint", 4), about="global, unit quaternions wxyz"),
        ),
    ),
    Task(
        "inverse_kinematics",
        "Bring a joint to a target by rotating its ancestors; the root stays where it is.",
        (*_SKELETON, Field("target", (3,), about="global position [m]"), *_EFFECTOR),
        (
            Field("local_rotations", ("joint", 4), about="of all joints"),
            Field("positions", ("joint", 3), about="global, of all joints [m]"),
            Field("residual", (), about="distance left, as the solver sees it [m]"),
            Field("iterations", (), "integer", about="sweeps made"),
            Field("converged", (), "boolean", about="whether it claims to have arrived"),
        ),
    ),
    Task(
        "track", "Follow a curve with a joint, each frame from the one before.",
        (*_SKELETON, Field("curve", ("frame", 3), about="targets [m]"), *_EFFECTOR),
        (
            Field("local_rotations", ("frame", "joint", 4), about="of every frame"),
            Field("positions", ("frame", "joint", 3), about="global, of every frame [m]"),
        ),
    ),
    Task(
        "resample", "Return points evenly spaced along a polyline.",
        (
            Field("curve", ("point", 3), about="the polyline [m]"),
            Field("strokes", ("stroke",), "integer", about="first point of each stroke"),
            Field("closed", (), "boolean", about="whether the end joins the start"),
            Field("count", (), "integer", True, "how many points, or"),
            Field("spacing", (), "number", True, "how far apart they are at most [m]"),
        ),
        (Field("points", ("sample", 3), about="[m]"),),
    ),
    Task(
        "mass_spring_forces",
        "Return the forces of springs, dampers and gravity on each particle.", (*_SYSTEM, *_STATE),
        (Field("forces", ("particle", 3), about="[N]"),),
    ),
    Task(
        "energy", "Return the energies of a state.", (*_SYSTEM, *_STATE),
        (
            Field("total", (), about="[J]"),
            Field("kinetic", (), about="[J]"),
            Field("potential", (), about="elastic and gravitational [J]"),
            Field("elastic", (), about="[J]"),
            Field("gravitational", (), about="- sum of m gravity . x [J]"),
        ),
    ),
    Task("mass_spring_step", "Return the state one time step later.", _STEP, _STATE),
    Task(
        "mass_spring_motion", "Return the states after each of several time steps.",
        (*_STEP, Field("steps", (), "integer", about="how many")),
        (
            Field("positions", ("frame", "particle", 3), about="after each step [m]"),
            Field("velocities", ("frame", "particle", 3), about="likewise [m/s]"),
        ),
    ),
    Task(
        "robot_inverse_kinematics",
        "Bring a robot's tool to a position and a rotation, each joint within its limits.", _ROBOT,
        (
            Field("q", ("joint",), about="coordinates [rad, m]"),
            Field("converged", (), "boolean", about="whether it claims to have arrived"),
        ),
    ),
)  # fmt: skip
TASKS = {task.name: task for task in _TASKS}
