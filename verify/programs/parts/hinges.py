"""Rotations within the limits of hinges and cones."""

import numpy as np

from .rotations import multiply


def about(axis, angle):
    return np.array([np.cos(angle / 2.0), *(np.sin(angle / 2.0) * axis)])


def wrapped(angle):
    return (angle + np.pi) % (2.0 * np.pi) - np.pi


def twist_of(q, axis):
    return wrapped(2.0 * np.arctan2(q[1:] @ axis, q[0]))


def nearest(angle, lower, upper):
    """Return the nearest angle within limits, around the circle."""
    if angle >= lower and angle <= upper:
        return angle
    to_lower, to_upper = np.abs(wrapped(angle - lower)), np.abs(wrapped(angle - upper))
    return lower if to_lower <= to_upper else upper


def within(q, axis, cone, lower, upper):
    """Return a rotation with the tilt of an axis and the twist about it within limits."""
    angle = twist_of(q, axis)
    tilt = multiply(q, about(axis, -angle))
    if tilt[0] < 0.0:
        tilt = -tilt
    sine = np.linalg.norm(tilt[1:])
    lean = 2.0 * np.arctan2(sine, tilt[0])
    if lean > cone:
        half = cone / 2.0
        tilt = np.array([np.cos(half), *(np.sin(half) / sine * tilt[1:])])
    twist = about(axis, nearest(angle, lower, upper))
    return multiply(tilt, twist)
