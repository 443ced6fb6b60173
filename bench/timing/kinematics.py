"""Forward kinematics of ball chains: a call for one pose, and batches."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np

from crosscheck.engines import SKELETON_ENGINES
from crosscheck.engines.skeleton_engine import coordinates
from reference import forward_kinematics, rotation, scenes

from .case import COMPILED, PLAIN, Case, copying

BATCHES = {10: 10_000, 100: 1_000}
# A joint's local rotation is read, its position and global rotation are written, 8 bytes a number.
BYTES_PER_JOINT = 8 * (4 + 3 + 4)


def cases() -> Iterator[Case]:
    """Yield one pose by everyone, and batches by us with the least that memory allows."""
    for balls, batch in BATCHES.items():
        single = f"kinematics/{balls} balls/one pose a call"
        yield Case(single, COMPILED, partial(by_us, balls, ()))
        yield Case(single, PLAIN, partial(by_us, balls, ()), speed="plain")
        for engine in SKELETON_ENGINES:
            yield Case(single, engine, partial(by_engine, engine, balls))
        many = f"kinematics/{balls} balls/{batch:,} poses a call"
        moved = batch * (balls + 1) * BYTES_PER_JOINT
        yield Case(many, COMPILED, partial(by_us, balls, (batch,)), batch)
        yield copying(many, moved, operations=batch)


def by_us(balls: int, batch: tuple[int, ...]) -> Callable[[], Any]:
    """Return our forward kinematics of random poses."""
    skeleton, _ = scenes.ball_chain(links=balls)
    return partial(forward_kinematics, skeleton, _local_rotations(balls, *batch))


def by_engine(name: str, balls: int) -> Callable[[], Any]:
    """Return an engine's forward kinematics of one random pose; the result stays in the engine."""
    skeleton, _ = scenes.ball_chain(links=balls)
    engine = SKELETON_ENGINES[name](skeleton)
    return partial(engine.place, coordinates(engine, _local_rotations(balls)))


def _local_rotations(balls: int, *batch: int) -> np.ndarray:
    return rotation.random(np.random.default_rng(balls), *batch, balls + 1)
