"""Fixtures that several rooms share."""

import numpy as np
import pytest
from hypothesis import settings

from reference.backend import compiled

# The first example of a law may compile a kernel: no deadline.
settings.register_profile("plumbob", max_examples=20, deadline=None, derandomize=True)
settings.load_profile("plumbob")


@pytest.fixture(params=compiled.BACKENDS)
def backend(request):
    """Run the test once by numba and once in the interpreter; yields the backend's name."""
    with compiled.set_backend(request.param):
        yield request.param


@pytest.fixture
def rng():
    """A generator of the same random numbers in every run."""
    return np.random.default_rng(20130)
