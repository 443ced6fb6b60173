"""Proofs for poses: the suite, its table and its sentence."""

from types import SimpleNamespace

import numpy as np
import pytest

from plumbob.bench.experiments import ik_proofs
from plumbob.bench.tables.results import Results
from plumbob.reference import IKCoverage

# Published dimensions, which need no package.
ARM = "iiwa14"


@pytest.fixture(scope="module", params=[ik_proofs.WITHIN_REACH, ik_proofs.ANYWHERE])
def proofs(request):
    return request.param, SimpleNamespace(**ik_proofs.prove(ARM, request.param, 2, 1986))


def test_targets_within_reach_are_not_impossible(proofs):
    kind, values = proofs
    assert len(values.coverage) == 12
    if kind == ik_proofs.WITHIN_REACH:
        assert not (values.coverage == IKCoverage.IMPOSSIBLE).any()
        assert values.converged.all()
    else:
        assert (values.coverage == IKCoverage.IMPOSSIBLE).sum() >= 6


def test_what_the_solver_claims_is_proven_and_nothing_is_refuted(proofs):
    _, values = proofs
    assert (values.reached == values.converged).all()
    assert not values.refuted.any()
    is_covered = values.coverage == IKCoverage.COVERED
    assert (np.isfinite(values.distance) == is_covered).all()
    assert ((values.least_distance > 0) == (values.coverage == IKCoverage.IMPOSSIBLE)).all()


def test_every_coverage_is_a_proof_or_a_cause():
    proofs = {ik_proofs.COVERED: "COVERED", ik_proofs.IMPOSSIBLE: "IMPOSSIBLE"}
    assert {coverage.value for coverage in IKCoverage} == {*proofs, *ik_proofs.CAUSES}
    assert all(IKCoverage(value).name == name for value, name in proofs.items())


def test_table_and_sentence_follow_the_records(make):
    record = make.sample("proven")
    table = ik_proofs.pose_proofs(Results([record]))
    (row,) = table.rows
    assert row[:8] == ("Franka Panda", "anywhere", 50.0, 50.0, 50.0, 25.0, 25.0, 0)
    assert row[8:11] == (2.0, 5.0, 0.5)
    sentence = table.summary.sentence
    assert "2 of 4 targets are proven" in sentence
    assert "1 to have none, 1 are open; 0 proofs are refuted" in sentence
    refuted = record.with_measured(refuted=[True, False] * 2)
    assert "2 proofs are refuted" in ik_proofs.pose_proofs(Results([refuted])).summary.sentence
