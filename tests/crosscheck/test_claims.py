"""Every claim holds in all its cases; none would hide ten times its tolerance; its verdict."""

import ast
import dataclasses
import functools
import re
import subprocess
import sys

import numpy as np
import pytest

from plumbob.crosscheck.claims import (
    CLAIMS,
    MASS_SPRING_CLAIMS,
    ROBOT_CLAIMS,
    TASK_CLAIMS,
    run_claims,
    skeleton_claims,
)
from plumbob.crosscheck.engines import SKELETON_ENGINES
from plumbob.crosscheck.tolerances import TOLERANCES, ClaimTolerance
from plumbob.crosscheck.verdict import Claim, Comparison, check_claim
from plumbob.reference.backend.compiled import set_backend

# A chain and a tree, one pin and two.
FEW = 2


# What is not only rounding: the next term of an error, and of a difference.
LARGEST = {TOLERANCES["order"]: 0.1, TOLERANCES["stiffness"]: 5e-11}

# What follows many steps; in the interpreter that takes minutes.
LONG = [name for name, claim in CLAIMS.items() if claim.cases < 10]

# Of what is claimed of many files, a few are read here; test_robots.py reads others, and all.
ON_FILES = [claim.name for claim in ROBOT_CLAIMS]


@pytest.fixture(params=CLAIMS)
def claim(request):
    return CLAIMS[request.param]


@functools.cache
def compared(name):
    """All cases of a claim, compared once for all tests that only bend the outcome."""
    return list(CLAIMS[name].compare(FEW if name in ON_FILES else CLAIMS[name].cases))


@pytest.fixture
def known(claim):
    """The claim, with its cases already compared."""
    cases = compared(claim.name)
    return dataclasses.replace(claim, compare=lambda n: cases[:n], cases=len(cases))


def disturbed(claim, size):
    """The same claim with the last case's largest entry of ours off by so many tolerances."""

    def compare(cases):
        *others, last = claim.compare(cases)
        actual = np.array(last.actual)
        actual[np.unravel_index(np.abs(actual).argmax(), actual.shape)] += (
            size * claim.tolerance.value * last.scale
        )
        return [*others, last._replace(actual=actual)]

    return dataclasses.replace(claim, compare=compare)


def test_claim_holds(known, claim):
    verdict = check_claim(known)
    assert verdict.holds, verdict
    assert verdict.cases == (FEW if claim.name in ON_FILES else claim.cases)


@pytest.mark.sample(every=8, without=LONG)
@pytest.mark.parametrize("name", CLAIMS)
def test_claim_holds_on_the_plain_sources(name):
    with set_backend("python"):
        assert check_claim(CLAIMS[name], FEW).holds


@pytest.mark.slow
@pytest.mark.parametrize("name", LONG)
def test_claim_about_long_motions_holds_in_more_cases(name):
    verdict = check_claim(CLAIMS[name], 2 * CLAIMS[name].cases)
    assert verdict.holds, verdict


def test_claim_goes_red_when_disturbed_by_ten_tolerances(known):
    assert check_claim(disturbed(known, 0.0), FEW).holds
    assert check_claim(disturbed(known, 10.0), FEW).failure == "they differ"


def test_tolerance_exceeds_rounding_errors_but_little_else(known):
    assert check_claim(known, FEW).difference < 0.5 * known.tolerance.value
    assert known.tolerance.value <= LARGEST.get(known.tolerance, 1e-11)


def test_claims_run_in_the_order_asked_for_and_say_so_first():
    names = ["kinetic energy", "damper forces"]
    seen = []
    verdicts = run_claims(names, progress=lambda claim: seen.append(claim.name))
    assert [verdict.claim.name for verdict in verdicts] == seen == names


def test_unknown_claim_is_named():
    """Names with commas in them stand in quotes, so that each can be told from the next."""
    with pytest.raises(ValueError, match=r"names: expected one of .*, got 'gravity'") as caught:
        run_claims(["gravity"])
    names = re.search(r"one of (.*), got", str(caught.value))[1]
    assert ast.literal_eval(f"[{names}]") == list(CLAIMS)
    with pytest.raises(ValueError, match="names: expected at least one claim"):
        run_claims([])


def test_no_claim_hides_another_of_its_name():
    about_skeletons = [claim for engine in SKELETON_ENGINES for claim in skeleton_claims(engine)]
    parts = about_skeletons, TASK_CLAIMS, MASS_SPRING_CLAIMS, ROBOT_CLAIMS
    assert len(CLAIMS) == sum(map(len, parts))


# ---- laws of `check_claim`: which comparisons pass and which do not


TOLERANCE = ClaimTolerance(1e-12, "made up")


def comparison(actual=(1.0, 2.0), expected=(1.0, 2.0), baseline=(0.0, 0.0), scale=2.0):
    return Comparison(np.array(actual), np.array(expected), np.array(baseline), scale)


def verdict_of(*comparisons):
    claim = Claim("a", "b", "c", lambda cases: comparisons[:cases], TOLERANCE, cases=10)
    return check_claim(claim)


def test_equal_values_away_from_the_baseline_hold():
    verdict = verdict_of(comparison(), comparison(expected=(1.0, 2.0 + 1e-12)))
    assert verdict.holds
    assert verdict.cases == 2
    assert verdict.difference == pytest.approx(5e-13, rel=1e-3)
    assert verdict.displacement == 1.0


FAILURES = {
    "no cases": ([], "no cases", 0.0),
    "one bad case among many": (
        [comparison(), comparison(expected=(1.0, 2.1)), comparison()], "they differ", 0.05
    ),
    "one case at its baseline among many": (
        [comparison(), comparison(baseline=(1.0, 2.0 + 1e-5))], "nothing moved", 0.0
    ),
    "the same infinity": (
        [comparison(actual=(1.0, np.inf), expected=(1.0, np.inf))], "not a number", np.nan
    ),
    **{
        f"{bad} in {field}": ([comparison(**{field: (1.0, bad)})], "not a number", np.nan)
        for field in ("actual", "expected", "baseline")
        for bad in (np.nan, np.inf)
    },
    **{
        f"a scale of {scale}": ([comparison(scale=scale)], "not a number", np.nan)
        for scale in (0.0, -1.0, np.nan, np.inf)
    },
}  # fmt: skip


@pytest.mark.parametrize("name", FAILURES)
def test_a_claim_is_missed(name):
    comparisons, failure, difference = FAILURES[name]
    verdict = verdict_of(*comparisons)
    assert verdict.failure == failure
    if "baseline" not in name:
        assert verdict.difference == pytest.approx(difference, nan_ok=True)
    elif failure == "nothing moved":
        assert verdict.displacement == pytest.approx(5e-6)


@pytest.mark.parametrize(("actual", "expected"), [((1.0, 2.0), (1.0,)), ((), ())])
def test_shapes_must_be_equal_and_not_empty(actual, expected):
    with pytest.raises(ValueError, match="comparison: expected"):
        verdict_of(comparison(actual=actual, expected=expected))


# Prints which claims are checked where neither engine makes a model; nothing is cached there.
WITHOUT_ENGINES = """
import mujoco, pinocchio
from plumbob.crosscheck.claims import CLAIMS
from plumbob.crosscheck.verdict import check_claim

class Missing:
    def __getattr__(self, name):
        raise ImportError(name)

    def __call__(self, *arguments, **settings):
        raise ImportError

for engine in (mujoco, pinocchio):
    for name in ("MjModel", "MjSpec", "Model", *(n for n in dir(engine) if n.startswith("build"))):
        setattr(engine, name, Missing())
for name, claim in CLAIMS.items():
    try:
        if check_claim(claim, cases=1).holds:
            print(name)
    except ImportError:
        pass
"""


@pytest.mark.slow
def test_what_is_counted_as_resting_on_an_engine_cannot_be_checked_without_it():
    """Six claims were once said to hold against an engine, and rest on closed forms."""
    from plumbob.bench.experiments.check import verdicts
    from plumbob.bench.measure.record import Record
    from plumbob.bench.tables.results import Results

    command = [sys.executable, "-c", WITHOUT_ENGINES]
    printed = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True).stdout
    claims = list(CLAIMS.values())
    count = len(claims) - len(printed.splitlines())
    assert 0 < count < len(claims)
    measured = {"cases": 1, "difference": 0.0, "tolerance": 1.0, "moved": 1.0, "holds": True}
    records = [
        Record("check", c.name, c.counterpart, measured={**measured, "quantity": c.quantity})
        for c in claims
    ]
    assert verdicts(Results(records)).summary.sentence.startswith(
        f"{len(claims)} of {len(claims)} claims held ({count} against Pinocchio or MuJoCo, "
        f"{len(claims) - count} against closed forms and invariants)"
    )
