"""The judge tried on what is known; the heavy sweep tries all of it."""

import pytest

from plumbob.crosscheck.verify.judgement import Verdict
from plumbob.crosscheck.verify.output.listings import self_test as lines
from plumbob.crosscheck.verify.self_test import HONEST, Trial, attempt, subjects

SUBJECTS = list(subjects())
FAULTY = [one for one in SUBJECTS if one.fault]
RIGHT = [one for one in SUBJECTS if not one.fault]


def name(subject):
    return f"{subject.family}, {subject.name}"


def slow_but(some, every):
    """Return parameters of which every so manieth runs by default."""
    return [
        pytest.param(one, id=name(one), marks=() if i % every == 0 else pytest.mark.slow)
        for i, one in enumerate(some)
    ]


@pytest.mark.parametrize("subject", slow_but(FAULTY, 25))
def test_a_known_fault_is_caught_and_named(subject):
    trial = attempt(subject)
    assert trial.caught
    assert trial.named
    assert trial.passed


@pytest.mark.parametrize("subject", slow_but(RIGHT, 6))
def test_who_is_right_is_not_accused(subject):
    trial = attempt(subject)
    assert trial.verdict <= Verdict.RIGHT_BUT
    assert trial.passed


def test_every_family_has_subjects_with_names_of_their_own():
    assert len({(one.family, one.name, one.task) for one in SUBJECTS}) == len(SUBJECTS)
    assert {one.family for one in RIGHT} == {HONEST}
    assert len(FAULTY) > 200
    assert {one.family for one in FAULTY} >= {"robots", "steps", "forces", "CCD", "FABRIK"}


def test_a_judge_that_sees_nothing_or_accuses_all_does_not_pass():
    fault, honest = FAULTY[0], RIGHT[0]
    assert not Trial(fault, Verdict.RIGHT, frozenset(), True).passed
    assert not Trial(fault, Verdict.WRONG, frozenset({"positions"}), False).passed
    assert not Trial(honest, Verdict.WRONG, frozenset({"positions"}), True).passed
    assert not Trial(honest, Verdict.RIGHT, frozenset(), False).passed


def test_what_did_not_pass_is_listed_by_name():
    blind = Trial(FAULTY[0], Verdict.RIGHT, frozenset(), False)
    told = list(lines([blind, Trial(RIGHT[0], Verdict.RIGHT, frozenset(), True)], str))
    assert any(FAULTY[0].name in line for line in told)
    assert told[-1].startswith("1 of all")
    assert "nobody" in list(lines([Trial(RIGHT[0], Verdict.RIGHT, frozenset(), True)], str))[-1]
