"""Skeletons and their rest poses."""

import numpy as np

from .. import rotation
from ..arguments import FloatArray, count, number
from ..skeleton import Skeleton


def lab_arm() -> tuple[Skeleton, FloatArray]:
    """Return the lab's vertical arm and its rest pose of identity rotations, shape (5, 4).

    Five joints at heights 1.7, 0.9, 0.5, 0.3 and -0.9: links of 0.8, 0.4, 0.2 and 1.2 m.
    """
    heights = np.array([1.7, 0.9, 0.5, 0.3, -0.9])
    offsets = np.zeros((5, 3))
    offsets[:, 1] = np.diff(heights, prepend=0.0)
    names = ["shoulder", "elbow", "wrist", "palm", "tip"]
    return Skeleton(np.arange(-1, 4), offsets, names), rotation.identity(5)


def ball_chain(*, links: int = 10, link_length: float = 0.1) -> tuple[Skeleton, FloatArray]:
    """Return a straight chain of equal links [m] along x from the origin, and its rest pose.

    Each link starts at a ball joint, and the last ends at the effector. No links, or a length not
    positive, are a ValueError.
    """
    links = count("links", links, minimum=1)
    offsets = np.zeros((links + 1, 3))
    offsets[1:, 0] = number("link_length", link_length, above=0.0)
    return Skeleton(np.arange(-1, links), offsets), rotation.identity(links + 1)
