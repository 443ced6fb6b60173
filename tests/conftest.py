"""Fixtures that several rooms share."""

import importlib.util
import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import settings

from plumbob.reference.backend import compiled

# What is printed must not depend on the terminal of whoever runs the tests.
os.environ.pop("COLUMNS", None)

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


@pytest.fixture(scope="session")
def extended_precision():
    """Return the module of that name; there is no package to import it from."""
    path = Path(__file__).with_name("reference") / "extended_precision.py"
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
