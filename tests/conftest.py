"""Fixtures that several rooms share."""

import gc
import os
import signal

import numpy as np
import pytest
from hypothesis import settings

from plumbob.reference.backend import compiled

# What is printed must not depend on the terminal of whoever runs the tests.
os.environ.pop("COLUMNS", None)

# The first example of a law may compile a kernel: no deadline.
settings.register_profile("plumbob", max_examples=20, deadline=None, derandomize=True)
settings.load_profile("plumbob")


def pytest_collection_finish():
    """Leave out what lives until the end: the garbage collector took a tenth of the time."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(20_000, 20, 20)


@pytest.fixture(scope="session", autouse=True)
def interruptible():
    """Let Ctrl-C reach what the tests start, though a job in the background ignores it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture
def backend(request):
    """Run the test by numba, and in the interpreter too; yields the backend's name."""
    with compiled.set_backend(request.param):
        yield request.param


@pytest.fixture
def rng():
    """A generator of the same random numbers in every run."""
    return np.random.default_rng(20130)


def quick_names(names, every, without=()):
    """Return each name of so many, of the names without some texts."""
    return [name for name in names if not any(text in name for text in without)][::every]


def backends_of(metafunc, is_quick):
    """Return the backends of a test: the interpreter is left to the slow tests but for a mark."""
    fast, plain = compiled.BACKENDS
    if metafunc.definition.get_closest_marker("both_backends"):
        return [fast, plain]
    return [fast] if is_quick else [fast, pytest.param(plain, marks=pytest.mark.slow)]


def has_parameter(metafunc, name):
    """Return whether a test names the values of an argument itself."""
    return any(name in mark.args[0] for mark in metafunc.definition.iter_markers("parametrize"))


def pytest_generate_tests(metafunc):
    """Make the cases of backends and sweeps: the default run makes only the quick ones."""
    is_quick = metafunc.config.option.markexpr == "not slow"
    if "backend" in metafunc.fixturenames and not has_parameter(metafunc, "backend"):
        metafunc.parametrize("backend", backends_of(metafunc, is_quick), indirect=True)
    for mark in metafunc.definition.iter_markers("sweep"):
        argument, names = mark.args[0], list(mark.args[1]())
        quick = quick_names(names, **mark.kwargs)
        if is_quick:
            names = quick
        slow = dict.fromkeys(set(names) - set(quick), pytest.mark.slow)
        metafunc.parametrize(argument, [pytest.param(n, marks=slow.get(n, ())) for n in names])


def cases_of(items):
    """Return the cases of each test that are not slow, with the test's mark `sample`."""
    cases = {}
    for item in items:
        mark = item.get_closest_marker("sample")
        if mark and not item.get_closest_marker("slow"):
            cases.setdefault(item.nodeid.partition("[")[0], (mark, []))[1].append(item)
    return cases.values()


def has(item, texts):
    """Whether a text stands in the name of a case."""
    return any(text in item.callspec.id for text in texts)


def sampled(cases, *texts, without=(), every=1):
    """Return the cases that the mark `sample` leaves to the default run; some there have to be."""
    absent = [text for text in (*texts, *without) if not any(has(item, [text]) for item in cases)]
    if absent and len(cases) > 1:
        raise pytest.UsageError(f"{cases[0].nodeid}: sample: no case has the name {absent[0]!r}")
    chosen = [item for item in cases if has(item, texts or [""]) and not has(item, without)]
    if not chosen and len(cases) > 1:
        raise pytest.UsageError(f"{cases[0].nodeid}: sample: no case is left")
    return chosen[::every]


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config, items):
    """Mark as slow what the marks of tests leave to the heavy sweep."""
    for mark, cases in cases_of(items):
        for item in set(cases) - set(sampled(cases, *mark.args, **mark.kwargs)):
            item.add_marker(pytest.mark.slow)
