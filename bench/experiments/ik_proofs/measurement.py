"""Answers of Levenberg-Marquardt on robots, certified; each tries to refute what is impossible."""

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

from plumbob.reference import Outcome, Target, certify_ik, rotation, solve_ik
from plumbob.reference.formats import urdf

from ...clock import compute_time_of
from ...harness.block import Block, Measured, Scale
from ...problems.chains import unit
from ...problems.evaluate import Targets, evaluator_of
from ...problems.robot_targets import STRATA, farthest, robot_targets
from ...problems.robots import HELD_OUT, TUNING, group_of, is_installed, robot, seed_of, title
from . import ANYWHERE, WITHIN_REACH

SUITE, SOLVER = "ik_proofs", "Plumbob LM"
TOLERANCE, RESTARTS = 1e-3, 20
# Targets in a stratum per target of a scale.
_TARGETS = 0.025


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
    bounds = np.array([certificate.least_distance for certificate in certificates])
    levers = np.array([certificate.lever for certificate in certificates])
    return {
        "converged": solution.outcome == Outcome.CONVERGED,
        "reached": np.array([certificate.reached for certificate in certificates]),
        "coverage": np.array([int(certificate.coverage) for certificate in certificates]),
        "distance": np.array([certificate.distance for certificate in certificates]),
        "least_distance": bounds,
        "refuted": solution.residual + levers * solution.residual_rotation < bounds,
        "seconds": np.array(seconds),
        "setup": setup,
    }


def poses_anywhere(name: str, count: int, seed: int) -> Targets:
    """Return random poses, uniform in the ball with the sum of the links as radius."""
    evaluator, rng = evaluator_of(name), np.random.default_rng([seed, seed_of(name), 2])
    size = count * len(STRATA)
    distance = farthest(evaluator) * rng.random((size, 1, 1)) ** (1.0 / 3.0)
    positions = evaluator.first_joint + distance * unit(rng.standard_normal((size, 1, 3)))
    rotations = rotation.to_matrix(rotation.random(rng, size, 1))
    return Targets(positions, rotations, evaluator.robot.draw(rng, size), np.zeros(size, dtype=int))
