"""No public function lets a wrong argument in, hands on a NaN, or fails from within."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import border_walk
import numpy as np
import public_calls
import pytest

from reference import arguments, curves, scenes, solve_ik
from reference.arguments import array, integer, shown

PROGRAM = Path(border_walk.__file__)
# What the walks have to be about, so that none of them shrinks unnoticed.
FEWEST = {"arrays": 2_500, "magnitudes": 1_300, "objects": 15_000, "random": 300}


def walk(law, *options):
    """Return how many functions and calls a walk tried, and what broke the law, in words.

    It runs in a process of its own, so that a function that ends it fails the test and no more.
    """
    command = [sys.executable, PROGRAM, law, "", *map(str, options)]
    ours = {**os.environ, "PYTHONPATH": str(PROGRAM.parents[1])}  # before the tests' own folders
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=ours)
    assert done.returncode == 0, done.stderr[-2_000:]
    functions, tried, broken = json.loads(done.stdout)
    assert functions >= 100
    assert tried >= FEWEST[law]
    return broken


def test_every_public_function_has_a_call_that_is_right():
    public = dict(public_calls.public_names())
    called = {name.split(",")[0] for name in public_calls.calls()}
    assert public.keys() - called - public_calls.INTERNAL.keys() == set()
    assert (called | public_calls.INTERNAL.keys()) - public.keys() == set()
    assert called & public_calls.INTERNAL.keys() == set()


def test_what_is_unchecked_says_so():
    public = dict(public_calls.public_names())
    unchecked = [name for name, why in public_calls.INTERNAL.items() if "unchecked" in why]
    assert unchecked
    said = re.compile("unchecked|not checked|neither checked")
    assert all(said.search(public[name].__doc__) for name in unchecked)


def test_arrays_are_checked_and_read_whatever_their_layout():
    assert walk("arrays") == []


def test_a_magnitude_gives_a_finite_answer_or_is_refused():
    assert walk("magnitudes") == []


def test_a_wrong_kind_of_object_is_refused_by_name():
    assert walk("objects") == []


def test_wrong_arguments_at_random_are_refused_by_name():
    assert walk("random", 4) == []


@pytest.mark.slow
def test_twenty_four_thousand_wrong_calls_are_refused_by_name():
    assert walk("random", 200, 1) == []


def right(x, n=1):
    """Return what is right: a copy of numbers that are checked."""
    return integer("n", n, least=1) * array("x", x, "row", 3)


def unchecked(x, n=1):
    return np.asarray(x)[0] * n


def in_place(x, n=1):
    x *= 2.0
    return right(x, n)


def forgets_the_shape(x, n=1):
    return array("x", x, "...") * n


def forgets_the_strides(x, n=1):
    array("x", x, "row", 3)
    return np.lib.stride_tricks.as_strided(x, (4, 3), (24, 8)).copy()


def forgets_nan(x, n=1):
    return arguments.floats("x", x, "row", 3)


def names_nothing(x, n=1):
    try:
        return right(x, n)
    except ValueError:
        raise ValueError("wrong") from None


def names_another(x, n=1):
    try:
        return right(x, n)
    except ValueError:
        raise ValueError("y: expected an x") from None


def overflows(x, n=1):
    return right(x, n) ** 5


def wrong_type(x, n=1):
    return right(x, range(n)[-1] + 1)


def refuses_lists(x, n=1):
    if isinstance(x, list):
        raise ValueError("x: expected no list")
    return right(x, n)


FAULTS = [
    (unchecked, "arrays"),
    (in_place, "arrays"),
    (forgets_the_shape, "arrays"),
    (forgets_the_strides, "arrays"),
    (forgets_nan, "arrays"),
    (names_nothing, "arrays"),
    (names_another, "arrays"),
    (refuses_lists, "arrays"),
    (overflows, "magnitudes"),
    (unchecked, "objects"),
    (wrong_type, "objects"),
    (names_another, "objects"),
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
