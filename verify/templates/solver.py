"""A starter for `plumbob verify solver.py`, or `plumbob verify -- python3 solver.py`.

Delete the functions that you do not have. The first command passes NumPy arrays for the lists.
"""

import json
import os
import sys
import time
from typing import Any

# GREETING_FIELDS
PLUMBOB = {"name": "my solver", "language": "Python", "precision": "double"}
Vectors = list[list[float]]  # positions [x, y, z] [m], or unit quaternions [w, x, y, z]


def forward_kinematics(parents: list[int], offsets: Vectors, local_rotations: Vectors) -> Any:
    """Return {"positions": global ones of all joints, "rotations": likewise}.

    Parents precede children, the root's is -1; an offset is in the parent's frame.
    """
    raise RuntimeError("forward_kinematics is not written yet")


def inverse_kinematics(target: list[float], effector: int, tolerance: float, **inputs: Any) -> Any:
    """Return {"local_rotations": those that bring the joint `effector` to the target}.

    The other inputs are parents, offsets, local_rotations, max_iterations and method.
    """
    raise RuntimeError("inverse_kinematics is not written yet")


def mass_spring_step(positions: Vectors, velocities: Vectors, h: float, **system: Any) -> Any:
    """Return {"positions": a time h later, "velocities": likewise}.

    The system has masses, springs (pairs of particles), rest_lengths, stiffnesses, dampings,
    pinned (particles that do not move) and gravity (an acceleration).
    """
    raise RuntimeError("mass_spring_step is not written yet")


def robot_inverse_kinematics(
    start: list[float], target_position: list[float], target_rotation: list[float], **robot: Any
) -> Any:
    """Return {"q": coordinates of the joints, within lower and upper, that bring the tool there}.

    The robot has parents, origins, orientations, axes, slides, lower, upper, effector (the joint
    that carries the tool), tool_position and tool_rotation, and is in urdf as well; the other
    inputs are tolerance, tolerance_rotation and max_iterations.
    """
    raise RuntimeError("robot_inverse_kinematics is not written yet")


def robot_jacobian(q: list[float], **robot: Any) -> Any:
    """Return {"jacobian": the tool's linear and angular velocity by joint, 6 rows}."""
    raise RuntimeError("robot_jacobian is not written yet")


def _answer(task: str, **inputs: Any) -> dict[str, Any]:
    functions = {name: f for name, f in globals().items() if name.count("_") and name[0] != "_"}
    if task == "greeting":
        return {"protocol": 1, "tasks": list(functions), **PLUMBOB}
    try:
        start = time.perf_counter()
        outputs = functions[task](**inputs)
        return {"seconds": time.perf_counter() - start, **outputs}
    except Exception as error:
        return {"error": str(error)}


if __name__ == "__main__":
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")  # what else is printed
    os.dup2(2, 1)  # goes to the errors and does no harm
    for line in sys.stdin:
        request = json.loads(line)
        reply = {"id": request.pop("id"), **_answer(**request)}
        print(json.dumps(reply).replace("NaN", "null"), file=answers, flush=True)
