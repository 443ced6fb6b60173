from functools import partial

import numpy as np
import pytest

from plumbob.reference import arguments, rotation


def test_lists_and_single_precision_become_contiguous_doubles():
    for given in ([[1, 2], [3, 4]], np.float32([[1, 2], [3, 4]]), np.ones((2, 4))[:, ::2]):
        result = arguments.array("a", given, 2, 2)
        assert result.dtype == np.float64
        assert result.flags.c_contiguous
        assert result.flags.writeable


def test_a_fitting_array_is_not_copied():
    given = np.ones((3, 2))
    assert arguments.array("a", given, "...", 2) is given


@pytest.mark.parametrize(
    ("given", "trailing", "message"),
    [
        ([1.0, 2.0], (3,), r"a: expected shape \(3,\), got \(2,\)"),
        (np.ones((2, 3)), ("joint", 4), r"a: expected shape \(joint, 4\), got \(2, 3\)"),
        (np.ones(4), ("joint", 4), r"a: expected shape \(joint, 4\), got \(4,\)"),
        (np.ones((2, 2, 4)), (2, 4), r"a: expected shape \(2, 4\), got \(2, 2, 4\)"),
        ([1.0, np.nan], (2,), r"a: expected finite numbers, got nan at index \(1,\)"),
        ([np.inf], (1,), r"a: expected finite numbers, got inf at index \(0,\)"),
        (["x"], (1,), "a: expected an array of numbers, got"),
        ([[1.0], [1.0, 2.0]], (2, 2), "a: expected an array of numbers, got"),
        ([True], (1,), "a: expected an array of numbers, got"),
        ([1j], (1,), "a: expected an array of numbers, got"),
    ],
)
def test_a_wrong_array_is_named(given, trailing, message):
    with pytest.raises(ValueError, match=message):
        arguments.array("a", given, *trailing)


@pytest.mark.parametrize(
    ("given", "limits", "message"),
    [
        (np.nan, {}, "h: expected a finite number, got nan"),
        ("fast", {}, "h: expected a number, got 'fast'"),
        (True, {}, "h: expected a number, got True"),
        ([1.0], {}, "h: expected one number"),
        (0.0, {"above": 0.0}, "h: expected a number greater than 0, got 0.0"),
        (-1, {"minimum": 0.0}, "h: expected a number of at least 0, got -1"),
    ],
)
def test_a_wrong_number_is_named(given, limits, message):
    with pytest.raises(ValueError, match=message):
        arguments.number("h", given, **limits)


def test_the_least_of_a_range_belongs_to_it():
    assert arguments.number("h", 0, minimum=0.0) == 0.0
    assert arguments.integer("n", 1, minimum=1, below=2) == 1
    assert arguments.indices("i", [0, 2], "pin", minimum=0, below=3).tolist() == [0, 2]


def test_coordinates_are_bounded_on_both_sides():
    assert arguments.coordinates("x", [-1e75, 1e75], 2).tolist() == [-1e75, 1e75]
    with pytest.raises(ValueError, match="x: expected coordinates of at most 1e\\+75, got 2e"):
        arguments.coordinates("x", [-2e75, 0.0], 2)


def test_indices_are_copied_and_what_is_spread_or_read_only_comes_back_writable():
    given = np.array([0, 1])
    arguments.indices("i", given, "pin", minimum=0, below=2)[0] = 1
    assert given.tolist() == [0, 1]
    shown = arguments.frozen(np.zeros((1, 3)))
    assert arguments.floats("a", shown, "...", 3).flags.writeable
    assert arguments.spread(np.zeros((1, 3)), (2, 3)).flags.writeable


@pytest.mark.parametrize("given", [True, 1.0, "1", 0, 4])
def test_only_an_integer_in_range_is_one(given):
    with pytest.raises(ValueError, match="n: expected an integer"):
        arguments.integer("n", given, minimum=1, below=4)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ([True, False], "pinned: expected integer indices, got bool values"),
        ([0.0], "pinned: expected integer indices, got float64 values"),
        ([0, 3], "pinned: expected indices from 0 to 2, got 3"),
        ([-1], "pinned: expected indices from 0 to 2, got -1"),
        ([[0]], r"pinned: expected shape \(pin,\), got \(1, 1\)"),
    ],
)
def test_wrong_indices_are_named(given, message):
    with pytest.raises(ValueError, match=message):
        arguments.indices("pinned", given, "pin", minimum=0, below=3)


@pytest.mark.parametrize("given", [1e-75, 1e75, 1, np.float32(2.0)])
def test_a_positive_number_is_within_75_orders_of_one(given):
    assert arguments.number("h", given, above=0.0) == given


@pytest.mark.parametrize(
    ("border", "given", "message"),
    [
        (partial(arguments.number, above=0.0), 1e-76, "a number of at least 1e-75, got 1e-76"),
        (partial(arguments.number, above=0.0), 2e75, "a number of at most 1e.75, got 2e.75"),
        (arguments.number, -2e75, "a number of at least -1e.75, got -2e.75"),
        (partial(arguments.integer, minimum=0), 2**63, "an integer of at least 0 and at most 92"),
        (arguments.array, -2e75, "numbers of at most 1e.75, got 2e.75"),
        (arguments.array, np.ma.array([1.0], mask=[True]), "numbers, got one with masked values"),
        (partial(arguments.flags, count=2), [True], r"shape \(2,\), got \(1,\)"),
        (partial(arguments.flags, count=2), [1, 0], "booleans, got int64 values"),
        (arguments.boolean, 1, "True or False, got 1"),
        (arguments.text, b"a", "text, got b'a'"),
        (partial(arguments.sequence, count=2, owner="a joint"), "ab", "2 x, one a joint, got 'ab'"),
        (partial(arguments.sequence, count=2, owner="a joint"), [1], "2 x, one a joint, got 1"),
        (partial(arguments.instance, kind=int), "a", "an int, got str"),
    ],
)
def test_a_wrong_value_of_any_kind_is_named(border, given, message):
    with pytest.raises(ValueError, match=f"x: expected (an array of )?{message}"):
        border("x", given)


def test_no_indices_are_fine():
    assert arguments.indices("pinned", (), "pin", minimum=0, below=3).shape == (0,)


def test_an_unknown_choice_is_answered_with_the_valid_ones():
    with pytest.raises(ValueError, match="solver: expected one of ccd, fabrik, got 'cdc'"):
        arguments.choice("solver", "cdc", {"ccd": 1, "fabrik": 2})


def test_what_is_frozen_cannot_be_written_to_but_its_owner_can():
    owner = np.zeros(3)
    view = arguments.frozen(owner)
    with pytest.raises(ValueError, match="read-only"):
        view[0] = 1.0
    owner[0] = 1.0
    assert view[0] == 1.0


SIZE = partial(arguments.number, minimum=0.0)


@pytest.mark.parametrize("border", [SIZE, arguments.sizes])
@pytest.mark.parametrize("given", [0.0, 0, 1e-75, 1e75, np.float32(2.0)])
def test_a_size_is_zero_or_within_75_orders_of_one(border, given):
    assert border("mass", given) == given


@pytest.mark.parametrize("border", [SIZE, arguments.sizes])
@pytest.mark.parametrize("given", [1e-76, 1e-310, 5e-324])
def test_a_smaller_size_is_refused(border, given):
    with pytest.raises(
        ValueError, match=rf"^mass: expected 0 or (a num.*)?at least 1e-75, got {given}"
    ):
        border("mass", given)


def test_of_several_sizes_the_wrong_one_is_named():
    with pytest.raises(ValueError, match="masses: expected none below 0, got -1e-80 at index 1"):
        arguments.sizes("masses", [1.0, -1e-80], "particle")


def test_a_signed_number_may_be_tiny():
    assert arguments.number("shift", -1e-310) == -1e-310
    assert arguments.array("x", [1e-310], 1) == [1e-310]


@pytest.mark.parametrize(
    ("dtype", "kind"),
    [
        ("complex128", "complex numbers"),
        ("object", "objects"),
        ("<U1", "text"),
        ("bool", "booleans"),
        ("datetime64[s]", "dates"),
        ("V8", "array.*"),
    ],
)
def test_the_kind_of_an_array_that_holds_no_numbers_is_named(dtype, kind):
    with pytest.raises(ValueError, match=rf"(?s)^x: expected an array of numbers, got {kind}$"):
        arguments.array("x", np.zeros((100, 3), dtype), "joint", 3)


@pytest.mark.parametrize("kind", [complex, bool, object, "<U1"])
def test_no_indices_of_another_kind_are_refused(kind):
    with pytest.raises(ValueError, match=r"^springs: expected integer indices, got "):
        arguments.indices("springs", np.zeros((0, 2), kind), "spring", 2, minimum=0, below=3)


@pytest.mark.parametrize("axes", [(10**12,), (2**40, 2**40), (10**9, 0), (1,) * 70])
def test_the_axes_of_arrays_that_fit_no_memory_are_refused(axes):
    for make in (rotation.identity, partial(rotation.random, np.random.default_rng(0))):
        with pytest.raises(ValueError, match=r"^shape: expected at most 32 lengths, of an array"):
            make(*axes)
