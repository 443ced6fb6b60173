"""The public names of before: aliases for one release."""

import pytest

from plumbob import reference
from plumbob.reference.backend import compiled, threads


@pytest.mark.parametrize(("old", "new"), [("plain", "python"), ("compiled", "numba")])
def test_a_speed_is_a_backend(old, new):
    with reference.set_backend("python"), reference.speed(old):
        assert compiled._backend.get() == new
    assert compiled._backend.get() == "numba"


def test_cores_are_threads():
    with reference.cores(3):
        assert threads._num_threads.get() == 3
    assert threads._num_threads.get() is None


def test_an_unknown_speed_is_refused_by_the_names_of_before():
    with pytest.raises(ValueError, match="speed: expected one of compiled, plain, got 'numba'"):
        reference.speed("numba")


@pytest.mark.parametrize("count", [0, -1, 1.5])
def test_a_count_of_cores_that_is_none_is_refused(count):
    with pytest.raises(ValueError, match="count: expected an integer"):
        reference.cores(count).__enter__()
