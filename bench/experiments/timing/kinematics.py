"""Forward kinematics of chains and a tree: a call for one pose, and batches."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np

from plumbob.crosscheck.engines import SKELETON_ENGINES
from plumbob.crosscheck.engines.skeleton_engine import coordinates
from plumbob.reference import Skeleton, forward_kinematics, rotation, scenes
from plumbob.reference.kinematics import THREAD_JOINTS

from .case import COMPILED, PLAIN, Case, Work, streaming

# Of each joint a local rotation is read, its position and global rotation are written.
READ, WRITTEN = 8 * 4, 8 * (3 + 4)
# A batch for all cores is so many times longer than one for a single core.
LONGER = 5
# The joints of a body's limbs, each from a joint that is there already: spine, legs, arms.
LIMBS = ((0, 5), (0, 5), (0, 5), (4, 7), (4, 7))


def cases() -> Iterator[Case]:
    """Yield one pose by everyone, and batches by us, each with a plain copy of its bytes."""
    for name, (skeleton, batch) in models().items():
        bytes_moved = np.array([READ, WRITTEN]) * skeleton.joint_count
        one = _work(name, "one pose a call")
        yield Case(one, COMPILED, partial(by_us, skeleton))
        yield Case(one, PLAIN, partial(by_us, skeleton), backend="python")
        for engine in SKELETON_ENGINES:
            yield Case(one, engine, partial(by_engine, engine, skeleton))
        yield streaming(one, *bytes_moved)
        many = _work(name, f"{batch:,} poses a call")
        yield Case(many, COMPILED, partial(by_us, skeleton, batch), batch)
        yield streaming(many, *(batch * bytes_moved), operations=batch)
        batch *= LONGER
        many = _work(name, f"{batch:,} poses a call, all cores")
        yield Case(many, COMPILED, partial(by_us, skeleton, batch), batch, cores=None)
        yield streaming(
            many, *(batch * bytes_moved), operations=batch, cores=None, least=READ * THREAD_JOINTS
        )


def _work(name: str, title: str) -> Work:
    return Work(f"kinematics/{name}/{title}", "kinematics", name, title)


def models() -> dict[str, tuple[Skeleton, int]]:
    """Return the skeletons by name, and how many poses make a batch that no near cache holds."""
    return {
        "10 balls": (scenes.ball_chain(links=10)[0], 10_000),
        "100 balls": (scenes.ball_chain(links=100)[0], 1_000),
        "30-joint tree": (body(), 3_000),
    }


def body() -> Skeleton:
    """Return a tree of 30 joints with the limbs of a body, all links along random directions."""
    parents = [-1]
    for begin, length in LIMBS:
        parents += [begin, *range(len(parents), len(parents) + length - 1)]
    return Skeleton(parents, np.random.default_rng(30).standard_normal((len(parents), 3)))


def by_us(skeleton: Skeleton, *batch: int) -> Callable[[], Any]:
    """Return our forward kinematics of random poses."""
    return partial(forward_kinematics, skeleton, _local_rotations(skeleton, *batch))


def by_engine(name: str, skeleton: Skeleton) -> Callable[[], Any]:
    """Return an engine's forward kinematics of one random pose; the result stays in the engine."""
    engine = SKELETON_ENGINES[name](skeleton)
    return partial(engine.update_kinematics, coordinates(engine, _local_rotations(skeleton)))


def _local_rotations(skeleton: Skeleton, *batch: int) -> np.ndarray:
    return rotation.random(np.random.default_rng(0), *batch, skeleton.joint_count)
