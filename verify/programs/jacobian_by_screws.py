"""Jacobian by screws."""

from .parts.screws import screws_of, spatial_jacobian


def robot_jacobian(q, **robot):
    path, screws, home = screws_of(**robot)
    J, T = spatial_jacobian(q, path, screws)
    return {"jacobian": J}
