"""Solvers as the bench calls them, one file each; the engine is imported in that file alone.

A solver that makes one attempt from the start it is given and one that starts again from random
poses until it is done answer different questions. Each entry says which of the two it is.
"""

import importlib.metadata
from collections.abc import Mapping
from typing import Any, NamedTuple

ONE_START, RESTARTS = "one start", "restarts"


class Entry(NamedTuple):
    """A solver with settings, as it enters the tables.

    Attributes:
        kind: one start, or restarts.
        settings: what its adapter is prepared with.
        restarts: further attempts from random poses, for solvers that make only one.
        note: what distinguishes it from another entry of the same solver and kind.
    """

    kind: str
    settings: Mapping[str, Any] = {}
    restarts: int = 0
    note: str = ""


class Peer(NamedTuple):
    """A solver for robots.

    Attributes:
        title: how it is written.
        module: its adapter.
        package: what must be installed.
        license: of the package.
        can: what it takes.
        entries: with which settings it takes part.
    """

    title: str
    module: str
    package: str
    license: str
    can: str
    entries: tuple[Entry, ...]

    @property
    def version(self) -> str:
        """The version that is installed, "" if none is."""
        try:
            return importlib.metadata.version(self.package)
        except importlib.metadata.PackageNotFoundError:
            return ""

    def called(self, entry: Entry) -> str:
        """Return how an entry is written."""
        return f"{self.title}, {entry.note}" if entry.note else self.title


# Attempts beside the first where the bench starts a solver again.
AGAIN = 20


def _either(iterations: int | None = None) -> tuple[Entry, Entry]:
    """Return an entry with one start and one with restarts, of fewer iterations each if given."""
    fewer = {} if iterations is None else {"iterations": iterations}
    return Entry(ONE_START), Entry(RESTARTS, fewer, AGAIN, f"{AGAIN} restarts")


_CHAINS = "poses and limits of one chain of hinges"

OURS = Peer(
    "Plumbob LM", "bench.peers.ik.plumbob", "plumbob", "MIT",
    "poses, positions and limits of several tips, balls",
    (
        Entry(ONE_START, {"restarts": 0}),
        Entry(RESTARTS, {"restarts": 100}, note="100 restarts"),
    ),
)  # fmt: skip
PEERS = (
    OURS,
    Peer(
        "Pinocchio’s closed loop", "bench.peers.ik.closed_loop", "pin", "BSD-3-Clause",
        "poses and positions of several tips, balls; looks at no limits", _either(200),
    ),
    Peer(
        "pink", "bench.peers.ik.pink", "pin-pink", "Apache-2.0",
        "poses, positions and limits of several tips, balls", _either(50),
    ),
    Peer(
        "mink", "bench.peers.ik.mink", "mink", "Apache-2.0",
        "poses, positions and limits of several tips, balls", _either(50),
    ),
    Peer("mujoco.minimize", "bench.peers.ik.minimize", "mujoco", "Apache-2.0", _CHAINS, _either()),
    Peer(
        "Robotics Toolbox ik_LM", "bench.peers.ik.toolbox", "roboticstoolbox-python", "MIT",
        _CHAINS,
        (
            Entry(ONE_START, {"searches": 1, "iterations": 100}),
            Entry(RESTARTS, {"searches": 100, "iterations": 30}, note="100 searches"),
        ),
    ),
    Peer(
        "TRAC-IK", "bench.peers.ik.trac_ik", "pytracik", "MIT", _CHAINS,
        (
            Entry(RESTARTS, {"seconds": 0.005}, note="5 ms"),
            Entry(RESTARTS, {"seconds": 0.05}, note="50 ms"),
        ),
    ),
    Peer(
        "ikpy", "bench.peers.ik.ikpy", "ikpy", "Apache-2.0", f"{_CHAINS}; makes no claims",
        (Entry(ONE_START),),
    ),
    Peer(
        "EAIK", "bench.peers.ik.eaik", "eaik", "BSD-3-Clause",
        "poses of six hinges or fewer, analytically",
        (Entry(RESTARTS, note="all solutions, no start"),),
    ),
)  # fmt: skip
