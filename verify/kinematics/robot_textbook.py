"""A robot's kinematics in rotation matrices as textbooks write them, right or with faults.

Coordinates q have the shape (..., joint); leading axes are configurations. Each rule is a formula,
which the rules of a fault replace.
"""

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference import rotation
from plumbob.reference.arguments import FloatArray

from .formulas import evaluate

Inputs = Mapping[str, Any]
Rules = Mapping[str, str]
DIFFERENCE = 1e-6  # of coordinates, for numerical derivatives [rad, m]
# Products of small rotations by larger angles overflow [rad].
MAX_SMALL = 1e3
RIGHT: Rules = {
    # A hinge by Rodrigues' formula: R = cosine 1 + sine K + outer a a^T, where c, s = cos q, sin q
    "cosine": "c", "sine": "s", "outer": "1 - c", "cross": "K",
    "skew": "K",  # the matrix of the cross product with a
    "matrix": "Q", "seen": "R",  # of a quaternion, from its rotation matrix; where the tool seems
    # The rotation of a joint and what rotates its origin, a slide's direction and the tool's
    # position: R of the parent, the frame, the joint's motion and, from then on, the joint.
    "product": "P @ F @ M", "origin": "P", "slide": "P @ F @ a", "tool": "R",
    "end": "R @ T",  # the tool's rotation, of the last joint's and that in its frame
    # Jacobian: an axis; the coordinates, those that arms belong to, an arm, both parts and all.
    "axis": "P @ F @ a", "coordinates": "q", "arms": "q", "arm": "tool - x",
    "linear": "where(slides, a, np.cross(a, arm))", "angular": "where(slides, 0, a)",
    "jacobian": "J", "answer": "J",
}  # fmt: skip
# Rules whose faults make matrices that are no rotations.
UNROTATED = {"cosine", "sine", "outer", "cross", "skew", "matrix"}


class RobotFrames(NamedTuple):
    """Where the joints and the tool are in each configuration."""

    origins: FloatArray  # of the joints [m], (..., joint, 3)
    starts: FloatArray  # the same before the joints move
    axes: FloatArray  # of the joints, (..., joint, 3)
    rotations: FloatArray  # of the joints, (..., joint, 3, 3)
    position: FloatArray  # of the tool [m], (..., 3)
    rotation: FloatArray  # of the tool, (..., 3, 3)


def hinge_matrix(axis: FloatArray, angle: FloatArray, rules: Rules) -> FloatArray:
    """Return the rotations about an axis by Rodrigues' formula, (..., 3, 3)."""
    q = np.clip(angle, -MAX_SMALL, MAX_SMALL)[..., None, None]
    x, y, z = axis
    K = evaluate(rules["skew"], {"K": np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])})
    names = {"q": q, "c": np.cos(angle)[..., None, None], "s": np.sin(angle)[..., None, None]}
    a, b, outer = (evaluate(rules[name], names) for name in ("cosine", "sine", "outer"))
    cross = evaluate(rules["cross"], names | {"K": K})
    return np.asarray(a * np.eye(3) + b * cross + outer * axis[:, None] * axis)


def matrices(quaternions: FloatArray, rules: Rules) -> FloatArray:
    """Return the matrices that a program makes of quaternions, (..., 3, 3)."""
    return np.asarray(evaluate(rules["matrix"], {"Q": rotation.to_matrix(quaternions)}))


def frames_at(inputs: Inputs, q: FloatArray, rules: Rules) -> RobotFrames:
    """Return the frames of a robot at coordinates q; columns may have axes of their own."""
    rules = {**RIGHT, **rules}
    unit = np.broadcast_to(np.eye(3), (*q.shape[:-1], 3, 3))
    quaternions = np.concatenate([inputs["orientations"], [inputs["tool_rotation"]]])
    *frames, tool_frame = matrices(quaternions, rules)
    if "composed" in rules:
        *frames, tool_frame = (_composed(matrix, rules) for matrix in (*frames, tool_frame))
    places, before, directions = list[tuple[FloatArray, FloatArray]](), [], []
    for j, p in enumerate(inputs["parents"]):
        x, P = places[p] if p >= 0 else (np.zeros_like(unit[..., 0]), unit)
        axis, origin, slides = (inputs[name][j] for name in ("axes", "origins", "slides"))
        M = unit if slides else hinge_matrix(axis, q[..., j], rules)
        column_axis = inputs.get("column_axes", inputs["axes"])[j]
        names = {"P": P, "F": frames[j], "M": M, "unit": unit, "a": column_axis, "slides": slides}
        names["R"] = R = evaluate(rules["product"], names)
        before.append(x + P @ origin)
        x = x + evaluate(rules["origin"], names) @ origin
        if slides:
            x = x + q[..., j, None] * evaluate(rules["slide"], names)
        places.append((x, R))
        directions.append(evaluate(rules["axis"], names))
    x, R = places[inputs["effector"]]
    position = x + evaluate(rules["tool"], {"R": R, "unit": unit}) @ inputs["tool_position"]
    columns = ([x for x, _ in places], before, directions)
    origins, starts, axes = (np.stack(vectors, axis=-2) for vectors in columns)
    rotations = np.stack([R for _, R in places], axis=-3)
    end = evaluate(rules["end"], {"R": R, "T": tool_frame})
    return RobotFrames(origins, starts, axes, rotations, position, end)


def _composed(R: FloatArray, rules: Rules) -> FloatArray:
    """Return the product of rotations by roll, pitch and yaw that hinges with faults make."""
    x, y, z = (
        hinge_matrix(axis, np.array(angle), rules)
        for axis, angle in zip(np.eye(3), rotation.roll_pitch_yaw(R), strict=True)
    )
    return np.asarray(z @ y @ x)


def jacobians_at(inputs: Inputs, q: FloatArray, rules: Rules) -> Iterator[FloatArray]:
    """Yield the Jacobians, (..., 6, joint), that programs with these rules may compute.

    Their axes are those before the joint moves, or those after; they go from frame to frame back
    from the tool; or they are differences.
    """
    if "before" in rules:
        yield _differences(inputs, q, rules, *(float(rules[name]) for name in ("before", "after")))
        return
    yield geometric_jacobian(inputs, q, rules)
    if "product" in rules or "column_axes" in inputs:
        yield geometric_jacobian(inputs, q, {**rules, "axis": "R @ a"})
        yield geometric_jacobian(inputs, q, {**rules, "arm": "tool - x0"})
    if UNROTATED & rules.keys():
        yield geometric_jacobian(inputs, q, {**rules, "recursion": "T(R)"})
    if (UNROTATED | {"product", "origin", "slide", "tool"}) & rules.keys():
        yield _differences(inputs, q, rules, DIFFERENCE, DIFFERENCE)
    if (UNROTATED - {"matrix"}) & rules.keys() and "composed" not in rules:
        yield from jacobians_at(inputs, q, {**rules, "composed": ""})


def _differences(
    inputs: Inputs, q: FloatArray, rules: Rules, before: float, after: float
) -> FloatArray:
    """Return the tool's moves between coordinates so far before and after, over the distance."""
    unit = np.eye(q.shape[-1])
    first, last = (frames_at(inputs, q[..., None, :] + h * unit, rules) for h in (-before, after))
    moves = np.concatenate(
        [last.position - first.position, rotation_error(first.rotation, last.rotation)], -1
    )
    return np.asarray(np.swapaxes(moves, -1, -2) / (before + after))


def geometric_jacobian(inputs: Inputs, q: FloatArray, rules: Rules) -> FloatArray:
    """Return the axes and their moments about the tool, (..., 6, joint).

    By `recursion` they pass from the joint's frame to the tool's and from there to the world: a
    formula of the tool's rotation in the joint's frame leads to the tool's.
    """
    slides = inputs["slides"]
    rules, names = {**RIGHT, **rules}, {"q": q, "slides": slides}
    frames = frames_at(inputs, q, rules)
    placed, ends = (
        frames if rules[name] == "q" else frames_at(inputs, evaluate(rules[name], names), rules)
        for name in ("coordinates", "arms")
    )
    names = {
        "a": placed.axes, "x": ends.origins, "x0": ends.starts, "tool": ends.position[..., None, :],
        "last": ends.origins[..., inputs["effector"], None, :], "p": inputs["parents"],
        "slides": slides[:, None], "R": frames.rotation, "R0": placed.rotation,
    }  # fmt: skip
    names["arm"] = evaluate(rules["arm"], names)
    if "recursion" in rules:  # matrices that are no rotations have no inverse like theirs
        to_joint, tool = np.linalg.pinv(placed.rotations), placed.rotation[..., None, :, :]
        names |= {name: (to_joint @ names[name][..., None])[..., 0] for name in ("a", "arm")}
    J = np.concatenate([evaluate(rules[name], names) for name in ("linear", "angular")], axis=-1)
    if "recursion" in rules:
        to_tool = evaluate(rules["recursion"], {"R": to_joint @ tool})
        J = np.concatenate([(tool @ to_tool @ part[..., None])[..., 0]
                            for part in np.split(J, 2, axis=-1)], axis=-1)  # fmt: skip
    J = np.swapaxes(J, -1, -2) * ancestors(inputs)
    J = evaluate(rules["jacobian"], names | {"J": J, "slides": slides})
    return np.asarray(evaluate(rules["answer"], {"J": J}))


def ancestors(inputs: Inputs) -> FloatArray:
    """Return 1 for the joints that move the tool, 0 for the others, (joint,)."""
    moves, j = np.zeros(len(inputs["parents"])), inputs["effector"]
    while j >= 0:
        moves[j], j = 1.0, inputs["parents"][j]
    return moves


def rotation_error(R: FloatArray, target: FloatArray) -> FloatArray:
    """Return the rotation vectors from matrices, also such that are no rotations, to others."""
    sines = sine_error(R, target)
    sine = np.linalg.norm(sines, axis=-1, keepdims=True)
    trace = np.einsum("...ij,...ij->...", R, target)[..., None]
    return np.arctan2(sine, 0.5 * (trace - 1.0)) / np.maximum(sine, 1e-300) * sines


def sine_error(R: FloatArray, target: FloatArray) -> FloatArray:
    """Return half the sum of the cross products of columns, which is the axis times the sine."""
    return np.asarray(0.5 * np.cross(R, target, axis=-2).sum(axis=-1))
