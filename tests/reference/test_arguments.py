"""What the borders of all public functions take, and what they refuse by name."""

import re
from functools import partial

import numpy as np
import public_calls
import pytest

from plumbob.reference import (
    Skeleton,
    Target,
    all_solutions,
    arguments,
    curves,
    rotation,
    scenes,
    solve_ik,
    solve_tasks,
)

POSITIVE = partial(arguments.number, above=0.0)
SIZE = partial(arguments.number, minimum=0.0)
COUNT = partial(arguments.integer, minimum=1, below=4)
TWO_FLAGS = partial(arguments.flags, count=2)
TWO_NAMES = partial(arguments.sequence, count=2, owner="a joint")


def array(name, given, *trailing):
    return arguments.array(name, given, *(trailing or ["..."]))


def row(name, given):
    return arguments.array(name, given, "joint", 4)


def pair(name, given):
    return arguments.array(name, given, 2, 4)


def pins(name, given):
    return arguments.indices(name, given, "pin", minimum=0, below=3)


def springs(name, given):
    return arguments.indices(name, given, "spring", 2, minimum=0, below=3)


REFUSED = [
    (row, np.ones((2, 3)), "expected shape (joint, 4), got (2, 3)"),
    (row, np.ones(4), "expected shape (joint, 4), got (4,)"),
    (pair, np.ones((2, 2, 4)), "expected shape (2, 4), got (2, 2, 4)"),
    (array, [1.0, np.nan], "expected finite numbers, got nan at index (1,)"),
    (array, [np.inf], "expected finite numbers, got inf at index (0,)"),
    (array, [[1.0], [1.0, 2.0]], "expected an array of numbers, got"),
    (array, -2e75, "numbers of at most 1e+75, got 2e+75"),
    (array, np.ma.array([1.0], mask=[True]), "numbers, got one with masked values"),
    (arguments.number, np.nan, "expected a finite number, got nan"),
    (arguments.number, "fast", "expected a number, got 'fast'"),
    (arguments.number, True, "expected a number, got True"),
    (arguments.number, [1.0], "expected one number"),
    (arguments.number, -2e75, "a number of at least -1e+75, got -2e+75"),
    (POSITIVE, 0.0, "expected a number greater than 0, got 0.0"),
    (POSITIVE, 1e-76, "a number of at least 1e-75, got 1e-76"),
    (POSITIVE, 2e75, "a number of at most 1e+75, got 2e+75"),
    (SIZE, -1, "expected a number of at least 0, got -1"),
    *((SIZE, tiny, f"at least 1e-75, got {tiny}") for tiny in (1e-76, 1e-310, 5e-324)),
    *((arguments.sizes, tiny, f"at least 1e-75, got {tiny}") for tiny in (1e-76, 5e-324)),
    *((COUNT, given, "expected an integer") for given in (True, 1.0, "1", 0, 4)),
    (partial(arguments.integer, minimum=0), 2**63, "an integer of at least 0 and at most 92233"),
    (pins, [True, False], "expected integer indices, got bool values"),
    (pins, [0.0], "expected integer indices, got float64 values"),
    (pins, [0, 3], "expected indices from 0 to 2, got 3"),
    (pins, [-1], "expected indices from 0 to 2, got -1"),
    (pins, [[0]], "expected shape (pin,), got (1, 1)"),
    *((springs, np.zeros((0, 2), kind), "expected integer indices, got ")
      for kind in (complex, bool, object, "<U1")),
    (TWO_FLAGS, [True], "shape (2,), got (1,)"),
    (TWO_FLAGS, [1, 0], "booleans, got int64 values"),
    (arguments.boolean, 1, "True or False, got 1"),
    (arguments.text, b"a", "text, got b'a'"),
    (TWO_NAMES, "ab", "2 x, one a joint, got 'ab'"),
    (TWO_NAMES, [1], "2 x, one a joint, got 1"),
    (partial(arguments.instance, kind=int), "a", "an int, got str"),
    (partial(arguments.choice, valid=["ccd", "fabrik"]), "cdc",
     "expected one of ccd, fabrik, got 'cdc'"),
    *((row, np.zeros((100, 3), dtype), f"expected an array of numbers, got {kind}")
      for dtype, kind in ((kind, f"{kind} values") for kind in
                          ("complex128", "object", "<U1", "bool", "datetime64[s]"))),
]  # fmt: skip


@pytest.mark.parametrize(("border", "given", "message"), REFUSED)
def test_a_wrong_argument_of_any_kind_is_named(border, given, message):
    with pytest.raises(ValueError, match=rf"^x: .*{re.escape(message)}"):
        border("x", given)


@pytest.mark.parametrize("given", [1e-75, 1e75, 1, np.float32(2.0), 0.0])
def test_a_size_is_zero_or_within_75_orders_of_one(given):
    assert SIZE("h", given) == arguments.sizes("h", given) == given
    assert given == 0.0 or POSITIVE("h", given) == given


def test_the_ends_of_a_range_belong_to_it():
    assert arguments.integer("n", 1, minimum=1, below=2) == 1
    assert pins("i", [0, 2]).tolist() == [0, 2]
    assert pins("i", ()).shape == (0,)
    assert arguments.coordinates("x", [-1e75, 1e75], 2).tolist() == [-1e75, 1e75]
    with pytest.raises(ValueError, match=r"x: expected coordinates of at most 1e\+75, got 2e"):
        arguments.coordinates("x", [-2e75, 0.0], 2)


def test_of_several_sizes_the_wrong_one_is_named():
    with pytest.raises(ValueError, match="masses: expected none below 0, got -1e-80 at index 1"):
        arguments.sizes("masses", [1.0, -1e-80], "particle")


ARM, REST = scenes.lab_arm()
TOO_MANY = {
    "shape": lambda: rotation.identity(10**12),
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
