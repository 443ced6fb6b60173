"""Models own their numbers: nobody else's array changes them, and copies of them are read-only."""

import copy
import pickle

import numpy as np
import pytest

from plumbob.reference import (
    Articulation,
    ImplicitEuler,
    Target,
    scenes,
    solve_ik,
)

ARM, REST = scenes.lab_arm()
CLOTH, STATE = scenes.lab_cloth(size=3)
MODELS = [ARM, Articulation(ARM, "hinge", cones=1.0), CLOTH, STATE]
COPIES = [copy.copy, copy.deepcopy, lambda one: pickle.loads(pickle.dumps(one))]


def read_only(model):
    return {
        k for k, v in vars(model).items() if isinstance(v, np.ndarray) and not v.flags.writeable
    }


@pytest.mark.parametrize("copied", COPIES, ids=["copy", "deepcopy", "pickle"])
@pytest.mark.parametrize("model", MODELS, ids=lambda one: type(one).__name__)
def test_copies_and_pickles_show_read_only_arrays(copied, model):
    twin = copied(model)
    assert read_only(twin) == read_only(model)
    assert len(read_only(twin)) >= 2
    for name in read_only(model):
        assert np.array_equal(getattr(twin, name), getattr(model, name))
        with pytest.raises(ValueError, match="read-only"):
            getattr(twin, name)[...] = 0


@pytest.mark.parametrize("copied", COPIES, ids=["copy", "deepcopy", "pickle"])
def test_copies_and_pickles_give_the_same_answers(copied):
    solve_ik(ARM, REST, [0.3, 0.1, 0.4])  # so that there are arrays that kernels read
    arm, cloth, state = copied(ARM), copied(CLOTH), copied(STATE)
    ends = [solve_ik(one, REST, [0.3, 0.1, 0.4]).positions for one in (ARM, arm)]
    assert np.array_equal(*ends)
    expected = ImplicitEuler(CLOTH).step(STATE).state.positions
    assert np.array_equal(ImplicitEuler(cloth).step(state).state.positions, expected)
    assert np.abs(expected - STATE.positions).max() > 0.0


@pytest.mark.parametrize("kind", [np.array, list])
def test_a_target_keeps_its_own_numbers(kind):
    position, rotation = kind([0.3, 0.1, 0.4]), kind([1.0, 0.0, 0.0, 0.0])
    target = Target(position, rotation)
    position[0], rotation[0] = 5.0, 7.0
    assert list(target.position) == [0.3, 0.1, 0.4]
    assert list(target.rotation) == [1.0, 0.0, 0.0, 0.0]
    assert type(target.position) is type(position)
