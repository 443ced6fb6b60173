"""The solvers that were asked, and the robots that they solve targets of."""

from collections.abc import Sequence
from operator import attrgetter
from typing import NamedTuple

from ...harness.record import Record
from ...peers import registry
from ...peers.registry import Peer, PeerEntry
from ...tables.columns import text
from ...tables.layout import Layout
from ...tables.results import Results, counted, listed
from ...tables.table import Summary
from . import REACHABLE
from .readings import STARTS, title_of
from .values import RobotDetails


class Participant(NamedTuple):
    """A solver that was asked, its records on robots, and one record of each robot of all."""

    peer: Peer
    records: tuple[Record, ...]
    robots: dict[str, Record]

    @property
    def version(self) -> str:
        """Its version, "" if it is not installed."""
        return str(self.records[0].details.version)

    @property
    def entries(self) -> str:
        """With which starts and settings it takes part."""
        return listed([f"{e.kind} ({e.note})" if e.note else e.kind for e in self.peer.entries])

    @property
    def measured_robots(self) -> str:
        """Which of all robots it was measured on, "" for none."""
        names = {record.title for record in self.records if "solved" in record.arrays}
        others = [robot for robot in self.robots if robot not in names]
        return title_of([robot for robot in self.robots if robot in names], others)

    @property
    def remark(self) -> str:
        """Why it was not measured on a robot, "" where it is not installed."""
        remarks = {r.title: r.details.remark for r in self.records if r.details.remark}
        reasons = dict.fromkeys(remarks.values() if self.version else ())
        robots = {why: [robot for robot in remarks if remarks[robot] == why] for why in reasons}
        return "; ".join(f"{listed(names)}: {why}" for why, names in robots.items())


def _participants(results: Results) -> list[Participant]:
    """Return the peers that have records, and the solvers that users entered."""
    asked = [r for start in STARTS for r in results.all("ik", task=REACHABLE, kind=start)]
    robots = {record.title: record for record in asked if "solved" in record.arrays}
    entered = {r.solver: _as_peer(r) for r in asked if r.facts.get("entrant") is True}
    participants = [
        Participant(peer, tuple(r for r in asked if r.solver in names), robots)
        for peer in (*registry.PEERS, *entered.values())
        for names in [set(map(peer.label_of, peer.entries))]
    ]
    return [participant for participant in participants if participant.records]


def _as_peer(record: Record) -> Peer:
    """Return what a record of a solver that was entered says of it."""
    door = str(record.facts.get("door", ""))
    return Peer(record.solver, "", door, "", "", (PeerEntry(record.details.kind),))


def _summary(participants: Sequence[Participant]) -> Summary:
    """Say how many took part, and what the robots are."""
    asked = {participant.peer.title for participant in participants}
    others = [peer.title for peer in registry.PEERS if peer.title not in asked]
    not_asked = f"; not asked: {', '.join(others)}" if others else ""
    count = sum(bool(participant.version) for participant in participants)
    robots = participants[0].robots
    return Summary(
        f"{count} of {len(participants)} that were asked took part{not_asked}; "
        f"{counted(len(robots), 'robot')}:",
        tuple(map(_robot, robots.values())),
    )


def _robot(record: Record) -> str:
    """Return what a robot is, and what is asked of it."""
    robot: RobotDetails = record.details
    effectors = listed(robot.tips)
    freedoms = "" if robot.freedom == robot.joints else f", {robot.freedom} freedoms"
    return f"{record.title}: {robot.joints} joints{freedoms}, {robot.wanted} of {effectors}"


participants = Layout(
    "Who takes part, on which robots?",
    "participants",
    "Solvers and robots",
    subjects=_participants,
    columns=(
        text("solver", attrgetter("peer.title")),
        text("package", attrgetter("peer.package")),
        text("version", lambda participant: participant.version or "not installed"),
        text("license", attrgetter("peer.license")),
        text("robots", attrgetter("measured_robots")),
        text("takes", attrgetter("peer.can")),
        text("takes part as", attrgetter("entries")),
        text("remark", attrgetter("remark")),
    ),
    shows="A solver that makes one attempt is also started again by the bench, from seeded "
    "random poses until it claims an answer within the limits. Arms are the chains of links that "
    "end in the effector, hinges only; continuous joints have two revolutions in either "
    "direction. The character is our own, of balls without and hinges with limits.",
    measured="Settings are the packages’ own but for those in brackets and what their adapters "
    "in bench/peers say. The arms’ files are those of example-robot-data, without soft limits; "
    "every solver and the evaluation read the same text.",
    summary=_summary,
)
