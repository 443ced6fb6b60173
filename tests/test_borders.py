"""No public function lets a wrong argument in, hands on a NaN, or fails from within."""

import inspect
import json
import math
import os
import subprocess
import sys
import typing
from pathlib import Path

import border_walk
import numpy as np
import public_calls
import pytest

from plumbob.reference import (
    Skeleton,
    Target,
    all_solutions,
    arguments,
    curves,
    scenes,
    solve_ik,
    solve_tasks,
)
from plumbob.reference.arguments import array, integer, shown

PROGRAM = Path(border_walk.__file__)
# What the walks have to be about, so that none of them shrinks unnoticed.
FEWEST = {"arrays": 9_000, "bounds": 1_200, "magnitudes": 4_500, "objects": 40_000, "random": 600}
# Arguments that are no number or array in any call, and why.
WITHOUT_NUMBERS = {
    "reference.implicit_euler.ImplicitEuler.certify: result": "of a StepResult in one call"
}


def walk(law, *options, fewest=0, stride=1, **environment):
    """Return what broke a law, in words, once enough functions and calls have been tried.

    It runs in a process of its own, so that a function that ends it fails the test and no more.
    """
    command = [sys.executable, PROGRAM, law, str(stride), *map(str, options)]
    folder = str(PROGRAM.parents[1])  # before the tests' own folders
    ours = {**os.environ, "PYTHONPATH": folder, **environment}
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=ours)
    assert done.returncode == 0, done.stderr[-2_000:]
    functions, tried, broken = json.loads(done.stdout)
    assert functions >= 100
    assert tried >= max(fewest, FEWEST[law] // stride)
    return broken


def test_every_public_function_has_a_call_that_is_right():
    public = dict(public_calls.public_names())
    called = {name.split(",")[0] for name in public_calls.calls()}
    assert public.keys() - called - public_calls.INTERNAL.keys() == set()
    assert (called | public_calls.INTERNAL.keys()) - public.keys() == set()
    assert called & public_calls.INTERNAL.keys() == set()


def takes_numbers(annotation):
    return annotation is float or bool({float, complex} & set(typing.get_args(annotation)))


def test_every_argument_of_numbers_has_some_in_a_call():
    """The laws about magnitudes then hold of it."""
    given = {
        f"{key.split(',')[0]}: {name}"
        for key, call in public_calls.calls().items()
        for name, value in call.arguments.items()
        if isinstance(value, float | np.ndarray | list)
    }
    arguments_of_numbers = {
        f"{path}: {one.name}"
        for path, function in public_calls.public_names()
        for one in inspect.signature(function).parameters.values()
        if path not in public_calls.INTERNAL and takes_numbers(one.annotation)
    }
    assert len(arguments_of_numbers) >= 150
    assert arguments_of_numbers - given == WITHOUT_NUMBERS.keys()


# By default every so-manieth trial, of each function others; all of them are slow.
STRIDES = {"arrays": 6, "bounds": 2, "magnitudes": 2, "objects": 10, "random": 1}


@pytest.mark.parametrize("law", STRIDES)
def test_every_public_function_keeps_the_law(law):
    assert walk(law, *[4] * (law == "random"), stride=STRIDES[law]) == []


@pytest.mark.slow
@pytest.mark.parametrize("law", [law for law, stride in STRIDES.items() if stride > 1])
def test_every_public_function_keeps_the_law_in_every_trial(law):
    assert walk(law) == []


@pytest.mark.slow
@pytest.mark.parametrize("checked", [False, True], ids=["as-compiled", "indices-checked"])
def test_fifty_thousand_calls_at_random_end_well(checked, pytestconfig):
    """Half of them with every index of a compiled kernel checked, in a cache of its own."""
    environment = {}
    if checked:
        cache = pytestconfig.cache.mkdir("numba_boundscheck")
        environment = {"NUMBA_BOUNDSCHECK": "1", "NUMBA_CACHE_DIR": str(cache)}
    count = math.ceil(
        50_000 / len([call for call in public_calls.calls().values() if call.arguments])
    )
    assert walk("random", count, 1 + checked, fewest=50_000, **environment) == []


def right(x, n=1):
    """Return what is right: a copy of numbers that are checked."""
    return integer("n", n, minimum=1) * array("x", x, "row", 3)


def unchecked(x, n=1):
    return np.asarray(x)[0] * n


def in_place(x, n=1):
    x *= 2.0
    return right(x, n)


def forgets_the_shape(x, n=1):
    return array("x", x, "...") * n


def names_nothing(x, n=1):
    try:
        return right(x, n)
    except ValueError:
        raise ValueError("wrong") from None


def overflows(x, n=1):
    return right(x, n) ** 5


def bounds_nothing(x, n=1):
    values = arguments.floats("x", x, "row", 3)
    if not np.isfinite(values).all():
        raise ValueError("x: expected finite numbers")
    return np.log1p(np.abs(values)) * n


def wrong_type(x, n=1):
    return right(x, range(n)[-1] + 1)


FAULTS = [
    (unchecked, "arrays"),
    (in_place, "arrays"),
    (forgets_the_shape, "arrays"),
    (names_nothing, "arrays"),
    (bounds_nothing, "bounds"),
    (overflows, "magnitudes"),
    (unchecked, "objects"),
    (wrong_type, "objects"),
    (unchecked, "random"),
    (wrong_type, "random"),
]


def broken_by(function, law):
    given = {"x": np.arange(12.0).reshape(4, 3), "n": 2}
    table = {"f": public_calls.Call(function, given, free="x")}
    options = [100] if law == "random" else []
    return border_walk.walk(law, table, *options)[2]


@pytest.mark.parametrize(("fault", "law"), FAULTS)
def test_walks_see_the_fault(fault, law):
    assert broken_by(fault, law)


@pytest.mark.parametrize("law", FEWEST)
def test_walks_let_the_right_one_pass(law):
    assert broken_by(right, law) == []


def test_what_cannot_be_shown_is_named_by_its_type():
    assert shown(border_walk.Unspeakable()) == "Unspeakable"
    assert shown(10**5000) == "int"


ARM, REST = scenes.lab_arm()
AXES_20 = np.zeros((2,) * 20)  # NumPy takes up to half a minute to write this array
LARGE_ARRAYS = {
    "tolerance": lambda: solve_ik(ARM, REST, [0.3, 0.0, 0.4], tolerance=AXES_20),
    "restarts": lambda: solve_ik(ARM, REST, [0.3, 0.0, 0.4], restarts=AXES_20),
    "effector": lambda: solve_ik(ARM, REST, [0.3, 0.0, 0.4], effector=AXES_20),
    "solver": lambda: solve_ik(ARM, REST, [0.3, 0.0, 0.4], AXES_20),
    "target": lambda: all_solutions(public_calls.robot(), Target(AXES_20)),
    "targets": lambda: solve_ik(ARM, REST, [Target([0.3, 0.0, 0.4]), AXES_20]),
    "names": lambda: Skeleton([-1, 0], np.ones((2, 3)), ["", AXES_20]),
    "tasks": lambda: solve_tasks(public_calls.robot(), public_calls.robot().neutral(), AXES_20),
}


@pytest.mark.parametrize("name", LARGE_ARRAYS)
def test_large_arrays_are_refused_without_their_numbers(name):
    with pytest.raises(ValueError, match=rf"^{name.removesuffix('s')}.*: expected") as refusal:
        LARGE_ARRAYS[name]()
    assert "array([" not in str(refusal.value)


TOO_MANY = {
    "size": lambda: scenes.lab_cloth(size=10**5),
    "rows, columns": lambda: scenes.grid_cloth(10**5, 10**5),
    "counts": lambda: scenes.lattice([10**4, 10**4, 10**4]),
    "count": lambda: curves["circle"](10**15),
    "links": lambda: scenes.ball_chain(links=10**12),
    "restarts": lambda: solve_ik(ARM, REST, [0.3, 0.0, 0.4], restarts=10**12),
    "max_iterations": lambda: solve_ik(
        ARM, REST, [0.3, 0.0, 0.4], max_iterations=10**12, record=True
    ),
}


@pytest.mark.parametrize("name", TOO_MANY)
def test_counts_beyond_any_memory_are_refused_before_arrays_are_made(name):
    with pytest.raises(ValueError, match=rf"^{name}: expected .*at most 1"):
        TOO_MANY[name]()
