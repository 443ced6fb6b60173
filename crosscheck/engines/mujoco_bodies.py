"""Point masses in MuJoCo, the bodies of skeletons and mass-spring systems."""

import mujoco
import numpy as np

from plumbob.reference.arguments import FloatArray


def add_point_mass(
    parent: mujoco.MjsBody, name: str, position: FloatArray, mass: float
) -> mujoco.MjsBody:
    """Return a new body at a position in its parent's frame, with its mass at its origin."""
    body = parent.add_body(name=name, pos=position)
    body.mass, body.ipos, body.inertia = mass, np.zeros(3), np.ones(3)
    body.explicitinertial = True
    return body
