"""Robots and characters from files of others, each beside both engines, a block each."""

from collections.abc import Iterator
from functools import partial

from plumbob.crosscheck.engines import ROBOT_ENGINES
from plumbob.crosscheck.engines.robot_engine import UnreadableError
from plumbob.crosscheck.robots.comparisons import CONFIGURATIONS, differences, sweep
from plumbob.crosscheck.robots.models import CAUSES, PACKAGES, RobotFile, models, moving_joints

from ...harness.block import Block, Measured, Scale
from . import peers
from .values import FileValues

SUITE = "robot_models"


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield every file for every engine, none where the files are not installed; then the peers."""
    settings = {"configurations": CONFIGURATIONS}
    for family in PACKAGES:
        for model in models(family):
            for engine in ROBOT_ENGINES:
                measure = partial(compare, engine, model)
                facts = {"title": model.name}
                yield Block(SUITE, f"{family}/{model.name}", engine, measure, settings, facts=facts)
    yield from peers.blocks(SUITE)


def compare(engine: str, model: RobotFile) -> Measured:
    """Compare one file in random configurations; keep why the engine does not read it."""
    try:
        swept = sweep(engine, model)
    except UnreadableError as error:
        return _unread(f"{engine} does not read it: {error}", model)
    except ValueError as error:
        return _unread(f"{engine} reads it, the reference does not: {error}", model)
    articulation = swept.robot.articulation
    joints = len(moving_joints(swept.robot)) + len(articulation.mimics)
    sizes = (len(swept.links), joints, articulation.freedom_count)
    return Measured(
        FileValues(*sizes, **differences([swept])._asdict()),
        {"cause": CAUSES.get((engine, model.name), ""), "free mimics": swept.free_mimics},
    )


def _unread(why: str, model: RobotFile) -> Measured:
    return Measured(None, {"unread": why.replace(str(model.path), model.path.name)})
