"""Coherent motions: of all that follow a curve, one whose poses change least from frame to frame.

Over all frames q_f together, half the sum of the squared jumps |q_{f+1} - q_f|^2 is made least,
subject to every effector being on its goal and every joint within its limits. The differences are
velocities: angles of hinges, rotation vectors of balls, ways over the reach. A closed motion also
counts the jump from the last frame to the first. Where it comes to rest no small change of the
motion lowers the sum; another motion far away may still be calmer. Steps are Newton's, within the
null spaces of all frames (`descent.py`), and limits are kept by the method of multipliers
(`limits.py`).

Long motions are first found in a few frames, and then in twice as many again and again.
"""

import numpy as np

from ..arguments import FloatArray, IndexArray
from ..inverse_kinematics.mechanism import Mechanism
from .problem import Course, jumps, moved, restored, stuck, worth_of
from .riemannian_newton import cost, descend

__all__ = ["smooth"]

# The fewest frames that a motion is thinned out to.
FEWEST = 64


def smooth(
    mechanism: Mechanism, goals: FloatArray, q: FloatArray, reached: np.ndarray, closed: bool
) -> tuple[FloatArray, int]:
    """Return the coherent motion nearest to one that follows a curve, and the steps to it.

    Limits are kept to about 1e-10 rad.

    Args:
        mechanism: what moves.
        goals: of each frame, (frame, effector, 8), see `inverse_kinematics/mechanism.py`.
        q: the mechanism's coordinates in each frame, (frame, coordinate).
        reached: in which frames the goal is reached; the others are drawn to theirs as near as they
            come, (frame,).
        closed: whether the last frame leads back to the first.
    """
    course = Course(mechanism, worth_of(mechanism), goals, reached, closed and len(q) > 2)
    back, on = restored(course, q)
    q = np.where(on[:, None], back, q)
    course = course._replace(strict=reached & on & ~stuck(course, q))
    found, steps = refined(course, q)
    free = np.zeros((len(q), len(mechanism.joints.integers), 3))
    if cost(course, found, free) > cost(course, q, free):
        found, more = descend(course, q)
        steps += more
    return found, steps


def refined(course: Course, q: FloatArray) -> tuple[FloatArray, int]:
    """Return the coherent motion near q, found in ever more frames, and all steps to it."""
    stride = 1
    while len(q) >= 2 * stride * FEWEST:
        stride *= 2
    at = thinned(len(q), stride, course.closed)
    found, steps = descend(course.at(at), q[at])
    while stride > 1:
        stride //= 2
        finer = thinned(len(q), stride, course.closed)
        start, on = restored(course.at(finer), filled_in(course.at(at), found, at, finer, len(q)))
        if not on[course.strict[finer]].all():
            start = q[finer]
        at = finer
        found, more = descend(course.at(at), start)
        steps += more
    return found, steps


def thinned(frames: int, stride: int, closed: bool) -> IndexArray:
    """Return every so many frames, of an open motion the last one too."""
    at = np.arange(0, frames, stride)
    return at if closed or at[-1] == frames - 1 else np.append(at, frames - 1)


def filled_in(
    course: Course, q: FloatArray, at: IndexArray, finer: IndexArray, frames: int
) -> FloatArray:
    """Return the frames `finer` between the frames `at`, on the way from each to the next."""
    d, ends = jumps(course, q), np.append(at, frames)
    before = np.searchsorted(at, finer, side="right") - 1
    share = (finer - at[before]) / (ends[before + 1] - at[before])
    return moved(course, q[before], share[:, None] * d[np.minimum(before, len(d) - 1)])
