"""Every claim holds with all its cases, and none would hide ten times its tolerance."""

import dataclasses

import numpy as np
import pytest

from crosscheck.engines import SKELETON_ENGINES
from crosscheck.identities import CLAIMS, MASS_SPRING_CLAIMS, run_claims, skeleton_claims
from crosscheck.verdict import judge
from reference.compiled import speed

# A chain and a tree, one pin and two.
FEW = 2


@pytest.fixture(params=CLAIMS)
def claim(request):
    return CLAIMS[request.param]


def disturbed(claim, size):
    """The same claim with the last case's largest entry of ours off by so many tolerances."""

    def compare(cases):
        *others, last = claim.compare(cases)
        ours = np.array(last.ours)
        ours[np.unravel_index(np.abs(ours).argmax(), ours.shape)] += (
            size * claim.tolerance.value * last.scale
        )
        return [*others, last._replace(ours=ours)]

    return dataclasses.replace(claim, compare=compare)


def test_claim_holds(claim):
    verdict = judge(claim)
    assert verdict.held, verdict
    assert verdict.cases == claim.cases


def test_claim_holds_on_the_plain_sources(claim):
    with speed("plain"):
        assert judge(claim, FEW).held


def test_claim_goes_red_when_disturbed_by_ten_tolerances(claim):
    assert judge(disturbed(claim, 0.0), FEW).held
    assert judge(disturbed(claim, 10.0), FEW).missed == "they differ"


def test_claim_goes_red_where_ours_is_not_a_number(claim):
    assert judge(disturbed(claim, np.nan), FEW).missed == "not a number"


def test_claim_goes_red_without_cases(claim):
    assert judge(claim, 0).missed == "no cases"


def test_claim_goes_red_where_nothing_moved(claim):
    def compare(cases):
        return [case._replace(still=case.ours) for case in claim.compare(cases)]

    assert judge(dataclasses.replace(claim, compare=compare), 1).missed == "nothing moved"


def test_tolerance_leaves_room_for_rounding_but_for_little_else(claim):
    verdict = judge(claim, FEW)
    assert verdict.difference < 0.5 * claim.tolerance.value <= 5e-12


def test_claims_run_in_the_order_asked_for_and_say_so_first():
    names = ["kinetic energy", "damper forces"]
    seen = []
    verdicts = run_claims(names, progress=lambda claim: seen.append(claim.name))
    assert [verdict.claim.name for verdict in verdicts] == seen == names


def test_unknown_claim_is_named():
    with pytest.raises(ValueError, match=r"names: expected one of joint positions.*got 'gravity'"):
        run_claims(["gravity"])


def test_asking_for_no_claims_is_an_error():
    with pytest.raises(ValueError, match="names: expected at least one claim"):
        run_claims([])


def test_no_claim_hides_another_of_its_name():
    about_skeletons = [claim for engine in SKELETON_ENGINES for claim in skeleton_claims(engine)]
    assert len(CLAIMS) == len(about_skeletons) + len(MASS_SPRING_CLAIMS)
