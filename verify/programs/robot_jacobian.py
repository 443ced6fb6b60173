"""Robot jacobian."""

from .parts.mechanism import tool_jacobian


def robot_jacobian(q, **robot):
    J, tool, tool_rotation = tool_jacobian(q, **robot)
    return {"jacobian": J}
