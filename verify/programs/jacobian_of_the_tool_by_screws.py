"""Jacobian of the tool by screws."""

from .parts.screws import adjoint, inverse, screws_of, spatial_jacobian


def robot_jacobian(q, **robot):
    path, screws, home = screws_of(**robot)
    J, T = spatial_jacobian(q, path, screws)
    tool = T @ home
    return {"jacobian": adjoint(inverse(tool)) @ J}
