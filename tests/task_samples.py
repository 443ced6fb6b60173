"""Robots and tasks of all kinds."""

import numpy as np

from plumbob import Articulation, Skeleton, rotation, tasks

KINDS = ["free", "hinge", "ball", "slide", "hinge", "hinge", "hinge"]


def tree(seed=1):
    """Return joints of all kinds in two branches; each seed has a tree of its own."""
    rng, kinds = np.random.default_rng(seed), list(KINDS)
    if seed > 1:
        kinds[0:5:2] = rng.permutation(["free", "ball", "fixed"]).tolist()
    parents = [-1, 0, 1, 2, 3, 1, 5]
    skeleton = Skeleton(parents, rng.normal(size=(7, 3)) * 0.4, list("abcdefg"))
    return Articulation(skeleton, kinds, rng.normal(size=(7, 3)), mimics={"g": ("f", -0.7, 0.2)})


def arm(limit=3.0):
    """Return seven hinges in a row."""
    axes = np.eye(3)[[2, 1, 2, 1, 2, 1, 2, 0]]
    offsets = [[0.0, 0.0, 0.3]] * 8
    kinds = ["hinge"] * 7 + ["fixed"]
    return Articulation(Skeleton(range(-1, 7), offsets), kinds, axes, lower=-limit, upper=limit)


def quaternion(seed):
    return rotation.random(np.random.default_rng(seed))


X, Q = (0.3, -0.2, 0.5), quaternion(5)
TASKS = {
    "position": tasks.FrameTask("e", X, point=X),
    "pose": tasks.FrameTask("e", X, Q, point=(0.1, 0.2, 0.3)),
    "axes": tasks.FrameTask("e", X, Q, axes=(1.0, 0.0, 2.0, 0.5, 1.0, 0.0)),
    "rotation": tasks.FrameTask("g", rotation=Q),
    "relative": tasks.FrameTask("e", X, Q, relative_to="g", point=X),
    "look at": tasks.LookAt("e", (2.0, 1.0, -1.0), (1.0, 2.0, 0.5), X),
    "look at a frame": tasks.LookAt("e", X, target_frame="g"),
    "centre of mass": tasks.CentreOfMass(np.arange(7.0), np.ones((7, 3)), X, axes=(1.0, 2.0, 0.0)),
    "posture": tasks.Posture(tree().random(np.random.default_rng(3)), axes=0.5),
    "coupling": tasks.Coupling("d", "g", (0.1, 2.0, -0.5, 0.3), 0.2, 0.1),
    "held joint": tasks.Coupling("b", coefficients=(0.4,)),
}


def pose_of(model, seed, joint=7):
    x, R = model.forward(model.random(np.random.default_rng(seed)))
    return x[joint], R[joint]
