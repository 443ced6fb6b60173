"""Forward kinematics of chains and a tree: single poses and batches."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import mujoco
import numpy as np

from plumbob.crosscheck.engines import SKELETON_ENGINES
from plumbob.crosscheck.engines.skeleton_engine import MujocoSkeleton, coordinates
from plumbob.reference import Skeleton, forward_kinematics, prepare, rotation, scenes
from plumbob.reference.kinematics import THREAD_JOINTS

from .case import COMPILED, PLAIN, PREPARED, PRESET, TimedCase, TimedWork, streaming

# Bytes of each joint: its local rotation is read, its position and global rotation are written.
READ, WRITE = 8 * 4, 8 * (3 + 4)
# A batch for all cores is longer by this factor than a batch for a single core.
LONGER = 5
# The limbs of a body, each a joint to start from and a number of joints: spine, legs, arms.
LIMBS = ((0, 5), (0, 5), (0, 5), (4, 7), (4, 7))


def cases() -> Iterator[TimedCase]:
    """Yield poses and batches, each with a plain copy of its bytes."""
    for name, (skeleton, batch) in models().items():
        size = skeleton.joint_count * np.array([READ, WRITE])
        pose = _work(name, "one pose a call")
        yield TimedCase(pose, COMPILED, partial(compiled_poses, skeleton))
        yield TimedCase(pose, PREPARED, partial(prepared_poses, skeleton))
        yield TimedCase(pose, PLAIN, partial(compiled_poses, skeleton), backend="python")
        for engine in SKELETON_ENGINES:
            yield TimedCase(pose, engine, partial(engine_poses, engine, skeleton))
        yield TimedCase(pose, PRESET, partial(preset_pose, skeleton))
        yield streaming(pose, *size)
        for count, cores, suffix, minimum in (
            (batch, 1, "", 0),
            (LONGER * batch, None, ", all cores", READ * THREAD_JOINTS),
        ):
            poses = _work(name, f"{count:,} poses a call{suffix}")
            prepare = partial(compiled_poses, skeleton, count)
            yield TimedCase(poses, COMPILED, prepare, count, cores=cores)
            for engine in SKELETON_ENGINES if cores else ():
                loop = partial(engine_poses, engine, skeleton, count)
                yield TimedCase(poses, engine, loop, count)
            yield streaming(poses, *(count * size), operations=count, cores=cores, minimum=minimum)


def _work(name: str, title: str) -> TimedWork:
    return TimedWork(f"kinematics/{name}/{title}", "kinematics", name, title)


def models() -> dict[str, tuple[Skeleton, int]]:
    """Return the skeletons by name, and the size of a batch beyond the nearest caches."""
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


def compiled_poses(skeleton: Skeleton, *batch: int) -> Callable[[], Any]:
    """Return our forward kinematics of random poses."""
    return partial(forward_kinematics, skeleton, _local_rotations(skeleton, *batch))


def prepared_poses(skeleton: Skeleton) -> Callable[[], Any]:
    """Return our forward kinematics of a random pose; the result stays in its own arrays."""
    return partial(prepare(skeleton), _local_rotations(skeleton))


def engine_poses(name: str, skeleton: Skeleton, *batch: int) -> Callable[[], Any]:
    """Return an engine's forward kinematics of random poses; the last stays in the engine."""
    engine = SKELETON_ENGINES[name](skeleton)
    q = coordinates(engine, _local_rotations(skeleton, *batch))
    call = engine.update_kinematics
    return (lambda: [*map(call, q)]) if batch else partial(call, q)


def preset_pose(skeleton: Skeleton) -> Callable[[], Any]:
    """Return MuJoCo's forward kinematics of a random pose already in its memory."""
    engine = MujocoSkeleton(skeleton)
    engine.update_kinematics(coordinates(engine, _local_rotations(skeleton)))
    return partial(mujoco.mj_kinematics, engine.model, engine.data)


def _local_rotations(skeleton: Skeleton, *batch: int) -> np.ndarray:
    return rotation.random(np.random.default_rng(0), *batch, skeleton.joint_count)
