"""Problems: what their names promise, the same in every run."""

import numpy as np
import pytest

from plumbob.bench.problems.chains import STRATA, chain_targets, unit
from plumbob.bench.problems.cloth_swing import cloth_swing
from plumbob.bench.problems.curves import MAX_SPACING, MIN_SPACING, arm_beyond, arm_curves


@pytest.mark.parametrize("stratum", STRATA)
def test_targets_lie_in_their_stratum_and_are_the_same_every_time(stratum):
    problem, again = chain_targets(stratum, 50), chain_targets(stratum, 50)
    shares = np.linalg.norm(problem.targets, axis=-1) / problem.skeleton.reach()
    low, high = STRATA[stratum]
    assert (shares >= low - 1e-12).all()
    assert (shares <= high + 1e-12).all()
    np.testing.assert_array_equal(problem.targets, again.targets)
    np.testing.assert_array_equal(problem.starts, again.starts)


def test_strata_have_targets_of_their_own_and_an_unknown_one_is_named():
    near, far = (unit(chain_targets(stratum, 5).targets) for stratum in ("near", "far"))
    assert np.abs(near - far).max() > 0.1
    with pytest.raises(ValueError, match="stratum: expected one of near"):
        chain_targets("middle", 1)


def test_targets_beyond_the_arm_are_beyond_it():
    problem = arm_beyond(50)
    distances = np.linalg.norm(problem.targets - problem.skeleton.offsets[0], axis=-1)
    assert (distances > problem.skeleton.reach()).all()


def test_the_arm_draws_every_curve_and_the_custom_one_evenly():
    problems = {problem.name: problem for problem in arm_curves()}
    names = ("circle", "square", "heart", "triangle", "star", "plumb_bob")
    assert list(problems) == [f"arm/{name}" for name in names]
    gaps = np.linalg.norm(np.diff(problems["arm/plumb_bob"].curve, axis=0), axis=-1)
    assert gaps.min() >= MIN_SPACING * (1 - 1e-12)
    assert gaps.max() <= MAX_SPACING * (1 + 1e-12)


def test_stiffer_cloths_differ_in_stiffness_alone():
    soft, hard = cloth_swing(1), cloth_swing(100)
    np.testing.assert_allclose(hard.system.stiffnesses, 100 * soft.system.stiffnesses)
    np.testing.assert_array_equal(hard.start.positions, soft.start.positions)
    np.testing.assert_array_equal(hard.system.springs, soft.system.springs)
