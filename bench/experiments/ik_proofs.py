"""Proofs for the poses of robots: reached, an exact solution nearby, impossible, or open.

Levenberg-Marquardt answers; each answer tries to refute the proof that its target is impossible.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from plumbob.reference import Outcome, Target, certify_ik, rotation, solve_ik
from plumbob.reference.formats import urdf

from ..clock import compute_time_of
from ..measure.block import Block, Measured, Scale
from ..measure.record import Record
from ..measure.values import Booleans1, Fact, Floats1, Integers1, Values
from ..problems.evaluate import Targets, evaluator_of
from ..problems.robot_targets import STRATA, robot_targets, targets_at
from ..problems.robots import HELD_OUT, TUNING, group_of, is_installed, robot, seed_of, title

SUITE, SOLVER = "ik_proofs", "Plumbob LM"
# The targets: of the strata of the bench, which some pose reaches, and random poses.
WITHIN_REACH, ANYWHERE = "within reach", "anywhere"
# The numbers of `IKCoverage`: proofs, and why there is none.
COVERED, IMPOSSIBLE = 0, 1
CAUSES = {2: "too few joints can move", 3: "singular", 4: "no solution nearby", 5: "at a limit"}
# The tolerance of the robots' suite [m], [rad], and the default restarts of `solve_ik`.
TOLERANCE, RESTARTS = 1e-3, 20
# Targets in a stratum per target of a scale.
_TARGETS = 0.025


class PoseProofs(Values, frozen=True, kw_only=True):
    """What is proven about the answers to targets, (target,)."""

    group: Fact[str]  # of the robot
    targets: Fact[str]  # their kind
    tolerance: Fact[float]  # [m], [rad]
    restarts: Fact[int]
    converged: Booleans1  # whether the solver says that it has reached the target
    reached: Booleans1  # whether that is proven
    coverage: Integers1  # of the certificates
    distance: Floats1  # to an exact solution, at most [rad]; infinite without a proof
    least_distance: Floats1  # of every pose [m]; 0 without a proof
    refuted: Booleans1  # whether the answer is nearer than every pose is proven to be
    seconds: Floats1  # of the proof
    setup: float  # of the shells of the robot [s]


KINDS = {"": PoseProofs}


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield every installed arm with targets within reach and anywhere."""
    count = max(1, round(_TARGETS * scale.targets))
    for name in filter(is_installed, (*TUNING, *HELD_OUT)):
        for kind in (WITHIN_REACH, ANYWHERE):
            settings = {"tolerance": TOLERANCE, "restarts": RESTARTS, "seed": scale.seed}
            facts = {"title": title(name), "group": group_of(name), "targets": kind}
            measure = partial(prove, name, kind, count, scale.seed)
            size = count * len(STRATA)
            yield Block(SUITE, f"{kind}/{name}", SOLVER, measure, settings, size, facts)


def prove(name: str, kind: str, count: int, seed: int) -> Measured:
    """Solve and certify all targets of a robot.

    If a target is proven impossible, an answer tries to refute the proof. Its distance plus the
    lever times its angle must not be less than the bound for all poses.
    """
    targets = (robot_targets if kind == WITHIN_REACH else poses_anywhere)(name, count, seed)
    arm = robot(name)
    model, positions = urdf.parse(arm.text).articulation, targets.positions[:, 0]
    rotations, effector = rotation.from_matrix(targets.rotations[:, 0]), arm.effectors[0]
    tolerances: dict[str, Any] = {"tolerance": TOLERANCE, "tolerance_rotation": TOLERANCE}
    target = Target(positions, rotations, effector)
    solution = solve_ik(model, targets.starts, target, restarts=RESTARTS, **tolerances)
    proofs = []
    for q, x, Q in zip(solution.coordinates, positions, rotations, strict=True):
        proof = partial(certify_ik, model, q, Target(x, Q, effector), **tolerances)
        proofs.append(compute_time_of(proof))
    certificates, seconds = zip(*proofs, strict=True)
    anew = urdf.parse(arm.text).articulation
    far = Target(positions[0] + 100.0, rotations[0], effector)
    _, setup = compute_time_of(partial(certify_ik, anew, anew.neutral(), far))
    names = ("reached", "coverage", "distance", "least_distance")
    proven = {name: np.array([getattr(proof, name) for proof in certificates]) for name in names}
    levers = np.array([certificate.lever for certificate in certificates])
    distance = solution.residual + levers * solution.residual_rotation
    return {
        **proven,
        "converged": solution.outcome == Outcome.CONVERGED,
        "refuted": distance < proven["least_distance"],
        "seconds": np.array(seconds),
        "setup": setup,
    }


def poses_anywhere(name: str, count: int, seed: int) -> Targets:
    """Return random poses, uniform in the ball with the sum of the links as radius."""
    rng = np.random.default_rng([seed, seed_of(name), 2])
    return targets_at(evaluator_of(name), rng, rng.random((count * len(STRATA), 1)) ** (1.0 / 3.0))


# What is shown.

from ..tables.captions import Captions
from ..tables.columns import text
from ..tables.results import counted
from ..tables.table import Column, Summary, words


def _share(title: str, of: Callable[[PoseProofs], np.ndarray]) -> Column:
    return Column(title, "%", read=lambda record: float(of(record.values).mean()))


def _median(
    title: str, unit: str, numbers: Callable[[PoseProofs], Floats1], coverage: int, **looks: Any
) -> Column:
    """Return the column of the median over the targets with a coverage."""

    def read(record: Record) -> float | None:
        proofs: PoseProofs = record.values
        covered = numbers(proofs)[proofs.coverage == coverage]
        return float(np.median(covered)) if len(covered) else None

    return Column(f"{title}, median", unit, read=read, **looks)


def _causes(record: Record) -> str:
    """Return how many targets are open for each cause, the most frequent first."""
    causes = Counter(CAUSES[value] for value in record.values.coverage.tolist() if value in CAUSES)
    return ", ".join(f"{name} {count}" for name, count in causes.most_common())


COLUMNS = (
    text("robot", lambda record: record.title),
    text("targets", lambda record: record.values.targets),
    _share("converged", lambda proofs: proofs.converged),
    _share("reached", lambda proofs: proofs.reached),
    _share("exact solution", lambda proofs: proofs.coverage == COVERED),
    _share("impossible", lambda proofs: proofs.coverage == IMPOSSIBLE),
    _share("open", lambda proofs: np.isin(proofs.coverage, list(CAUSES))),
    Column("refuted", read=lambda record: record.values.refuted.sum()),
    _median("proof", "ms", lambda proofs: proofs.seconds, COVERED),
    _median("impossible", "ms", lambda proofs: proofs.seconds, IMPOSSIBLE),
    Column("shells", "s", read=lambda record: record.values.setup),
    text("robots", lambda record: record.values.group, folded=True),
    _median("distance", "rad", lambda proofs: proofs.distance, COVERED, folded=True),
    _median("least distance", "m", lambda proofs: proofs.least_distance, IMPOSSIBLE, folded=True),
    text("causes", _causes, folded=True),
)


def _summary(records: Sequence[Record]) -> Summary:
    proofs = [record.values for record in records]
    total, refuted = sum(len(p.coverage) for p in proofs), sum(int(p.refuted.sum()) for p in proofs)
    covered, impossible = (
        sum(int((p.coverage == value).sum()) for p in proofs) for value in (COVERED, IMPOSSIBLE)
    )
    return Summary(
        f"{words(covered)} of {counted(total, 'target')} are proven to have an exact solution near "
        f"the answer, {words(impossible)} to have none, {words(total - covered - impossible)} "
        f"are open; {words(refuted)} proofs are refuted."
    )


pose_proofs = Captions(__file__).layout(
    "pose_proofs", lambda results: results.all(SUITE), _summary, columns=COLUMNS
)

LAYOUTS = (pose_proofs,)
