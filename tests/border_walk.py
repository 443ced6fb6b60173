"""The laws of the borders: what a public function may answer to arguments of every kind.

Run as a program it walks the public functions and prints what broke a law, a JSON list a line, and
on its error stream each call before it is made: where a call ends the process, it is the last.
"""

import copy
import dataclasses
import faulthandler
import itertools
import json
import math
import os
import re
import resource
import sys
import tempfile
import warnings

import numpy as np
import scipy
from public_calls import calls, robot, system, tree

from plumbob.reference import (
    Articulation,
    IKCertificate,
    MassSpring,
    Skeleton,
    State,
    StepJudgement,
)
from plumbob.reference.implicit_euler.certificate import Certificate
from plumbob.reference.implicit_euler.objective import Iterate, Objective

PATIENCE = 600  # seconds until a call counts as endless; compiling is part of it
MEMORY = 8 * 2**30  # bytes: what asks for more gets a MemoryError
LARGE = (1e70, 1e76, 1e155, 1e200, 1e308)
# What is right: an error that names the argument; that or any finite answer.
REFUSED, ANYTHING = object(), object()
SMALL = (1e-70, 1e-155, 1e-200, 1e-308)
# Magnitudes at, between and beyond the bounds of the rule, for single numbers of an argument.
EXTREMES = (0.0, 5e-324, 1e-310, 1e-155, 1e-76, 1e-75, 1e-37, 1e-10)
EXTREMES += (1e10, 1e37, 1e75, 1e76, 1e155, 1e308)


class Unconvertible:
    """An array-like whose conversion raises."""

    def __array__(self, dtype=None, copy=None):
        raise RuntimeError("no array")


class Unspeakable:
    """An object that cannot even be shown, compared or counted."""

    def __repr__(self):
        raise RuntimeError("no words")

    def __bool__(self):
        raise RuntimeError("neither true nor false")

    def __len__(self):
        raise RuntimeError("no length")

    def __eq__(self, other):
        raise RuntimeError("nothing like it")

    __hash__ = None


WRONG = [
    None, 2.5, -1, 10**29, -(10**29), 0, True, math.nan, math.inf, 1j, "text", "", b"x", object(),
    [], (), {}, {0: 1}, {"a": None}, {1, 2}, [[1.0], [1.0, [2.0, 3.0]]], [None, None], ["a", 1],
    [[[[[1.0]]]]], Unconvertible(), Unspeakable(), len, lambda *given: None, int, np, slice(1),
    np.int8(3), np.uint64(2**63), np.float16(1.0), np.longdouble(1.0), np.str_("x"), np.bool_(True),
    np.datetime64("2020-01-01"), np.void(b"x"), np.array(None), np.array("a"), np.array([]),
    np.zeros((0, 3)), np.zeros((1,) * 20), np.zeros((2,) * 20), range(3),
    np.array([{}, []], dtype=object),
    np.broadcast_to(1.0, (10**12,)), np.broadcast_to(1.0, (10**11, 3)),
    np.broadcast_to(np.int64(0), (10**11, 2)), np.broadcast_to(True, (10**12,)),
    np.broadcast_to([1.0, 0.0, 0.0, 0.0], (10**11, 4)), scipy.sparse.eye_array(4), np.ma.masked,
    scipy.sparse.csc_array((3, 4)), scipy.sparse.csc_array(np.full((4, 4), np.nan)),
    tree(), robot(), *system(), Skeleton([-1], [[0, 0, 0]]), State([[0, 0, 0]], [[0, 0, 0]]),
    MassSpring([1.0], [], [], []), np.random.default_rng(0), np.random.RandomState(0),
]  # fmt: skip


def fresh(arguments):
    """Return the arguments, arrays and generators copied, so that no call spoils another."""
    kinds = np.ndarray | np.random.Generator
    return {k: copy.deepcopy(v) if isinstance(v, kinds) else v for k, v in arguments.items()}


def complaint(call, given):
    """Return what law a call with these arguments breaks, or "", and its result."""
    before = {k: v.copy() for k, v in given.items() if _is_small_array(v)}
    result, said = None, ""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            result = call.function(**given)
            if not (call.passed_on or all_finite(result)):
                said = "passed on NaN or infinity"
    except ValueError as error:
        said = "" if names_one(call, given, str(error)) else f"named no argument: {error}"
    except call.raises:
        pass
    except Exception as error:
        said = f"raised {type(error).__name__}: {error}"
    changed = [k for k, v in before.items() if not np.array_equal(v, given[k], equal_nan=_real(v))]
    return (f"changed {', '.join(changed)}" if changed else said)[:200], result


def names_one(call, given, message):
    """Return whether what stands before the colon names an argument of the call, or a file."""
    if any(isinstance(v, str) and v and message.startswith(v) for v in given.values()):
        return True
    words = set(re.findall(r"\w+", message.partition(":")[0]))
    return bool(words & {*call.arguments, *call.names.split()})


def _is_small_array(value):
    return isinstance(value, np.ndarray) and value.size < 1000


def _real(values):
    return values.dtype.kind in "fiu"


def all_finite(result):
    """Return whether all numbers of a result are; an outcome may say that they are not."""
    if isinstance(result, Articulation):
        return all_finite(result.forward(result.neutral()))
    if isinstance(result, Certificate | IKCertificate | Objective | MassSpring):
        return True
    if isinstance(result, StepJudgement):
        return all_finite(result.minimiser)
    if isinstance(result, Iterate):
        return not result.finite or np.isfinite(result.gradient).all()
    if np.size(getattr(result, "residual", ())) == 1 and getattr(result, "outcome", 0) == 4:
        return all_finite(result.state)
    if scipy.sparse.issparse(result):
        return all_finite(result.data)
    if dataclasses.is_dataclass(result):
        return all(all_finite(getattr(result, f.name)) for f in dataclasses.fields(result))
    if isinstance(result, list | tuple):
        return all(all_finite(one) for one in result)
    if isinstance(result, np.ndarray | float) and np.asarray(result).dtype.kind in "fc":
        return bool(np.isfinite(result).all())
    return True


def same(a, b):
    """Return whether two results are the same to the last bit."""
    if isinstance(a, np.ndarray | float | int | np.generic):
        return np.array_equal(a, b, equal_nan=np.asarray(a).dtype.kind == "f")
    if scipy.sparse.issparse(a):
        return same(a.data, b.data) and same(a.indices, b.indices)
    if isinstance(a, list | tuple):
        return len(a) == len(b) and all(same(x, y) for x, y in zip(a, b, strict=True))
    if isinstance(a, Articulation):
        return same(a.joints, b.joints)
    if dataclasses.is_dataclass(a):
        names = [f.name for f in dataclasses.fields(a) if f.name[0] != "_"]
        return all(same(getattr(a, name), getattr(b, name)) for name in names)
    return type(a) is type(b)


def misshapen(name, x, call):
    """Yield arrays of other shapes, and whether they must be refused."""
    free, single = name in call.free.split(), name in call.single.split()
    ends = np.concatenate([x, x[-1:]])
    yield "one short", x[:-1], not free
    yield "one long", ends, not free
    yield "empty", x[:0], not free
    yield "an axis less", x[0], not (free or single)
    yield "an axis more", x[None], not free
    yield "one number", x.reshape(-1)[0].copy(), not single
    if x.ndim > 1:
        yield "last axis short", x[..., :-1], True
        yield "last axis long", np.concatenate([x, x[..., -1:]], axis=-1), True
        if x.T.shape != x.shape:
            yield "transposed", x.T, True
            yield "reshaped", x.reshape(x.shape[::-1]), True


def mistyped(x):
    """Yield the same in types that are no numbers, or no indices, or no booleans."""
    wrong = {"f": "c16 c8 O U8 ?", "i": "f8 c16 O U8 ?", "b": "f8 O U8 i8"}[x.dtype.kind]
    for kind in wrong.split():
        yield f"as {np.dtype(kind)}", x.astype(kind), True
    yield "as datetimes", np.zeros(x.shape, "M8[s]"), True
    yield "as records", np.zeros(x.shape, [("a", float)]), True


def not_numbers(name, x, call):
    """Yield the array with one number that is none."""
    if x.dtype.kind != "f" or name in call.passed_on.split():
        return
    for value in (math.nan, math.inf, -math.inf):
        for place in (0, -1):
            values = x.copy()
            values.flat[place] = value
            yield f"{value} at {place}", values, name not in call.infinite.split() or value != value


def alike(x):
    """Yield the very same numbers in other layouts."""
    wide = np.zeros((*x.shape[:-1], 2 * x.shape[-1]), x.dtype)
    wide[..., ::2] = x
    yield "every other", wide[..., ::2]
    yield "reversed strides", x[::-1].copy()[::-1]
    yield "columns first", np.asfortranarray(x)
    yield "swapped bytes", x.astype(x.dtype.newbyteorder())
    yield (
        "unaligned",
        np.frombuffer(b"\0" + x.tobytes(), np.uint8)[1:].view(x.dtype).reshape(x.shape),
    )
    yield "a list", x.tolist()
    yield "a subclass", x.view(np.recarray) if x.dtype.kind != "f" else x.view(_Sub)
    shown = x.copy()
    shown.setflags(write=False)
    yield "read-only", shown
    if x.dtype.kind == "i":
        yield "32 bits", x.astype(np.int32)
        yield "16 bits", x.astype(np.int16)
    if x.dtype.kind == "f":
        yield "long", x.astype(np.longdouble)


class _Sub(np.ndarray):
    pass


def arrays_of(call):
    """Return the arrays among the arguments."""
    return [(k, v) for k, v in call.arguments.items() if isinstance(v, np.ndarray)]


def trial_arrays(call):
    """Yield trials of every array: its label, what is changed, and what is right then."""
    plain = call.function(**fresh(call.arguments))
    for name, x in arrays_of(call):
        for label, value, refused in (
            *misshapen(name, x, call), *mistyped(x), *not_numbers(name, x, call),
        ):  # fmt: skip
            yield f"{name} {label}", {name: value}, REFUSED if refused else ANYTHING
        for label, value in alike(x):
            yield f"{name} {label}", {name: value}, plain
        if x.dtype.kind == "f":
            single = x.astype(np.float32)
            rounded = call.function(**fresh(call.arguments) | {name: single.astype(float)})
            yield f"{name} in single precision", {name: single}, rounded


def trial_bounds(call):
    """Yield the same for single numbers that the rule for magnitudes refuses.

    None may be beyond 1e75. One that may not be negative, by however little, is a size, and no size
    but 0 may be below 1e-75.
    """
    for name, x in call.arguments.items():
        if not _scales(x) or name in call.passed_on.split():
            continue
        for i in (0, -1):
            yield f"{name} too large at {i}", {name: _replaced(x, i, 2e75)}, REFUSED
            if complaint(call, fresh(call.arguments) | {name: _replaced(x, i, -1e-70)})[1] is None:
                yield f"{name} too small at {i}", {name: _replaced(x, i, 1e-76)}, REFUSED


def _replaced(value, i, number):
    """Return the number, or the array with one of its numbers replaced."""
    if type(value) is float:
        return number
    values = value.copy()
    values.flat[i] = number
    return values


def trial_magnitudes(call):
    """Yield the same for each number and array scaled, and for all of them together."""
    numbers = {k: v for k, v in call.arguments.items() if _scales(v)}
    several = [numbers] * (len(numbers) > 1)
    for factor in LARGE + SMALL:
        for some in [*({k: v} for k, v in numbers.items()), *several]:
            given = {k: _scaled(v, factor) for k, v in some.items()}
            yield f"{' '.join(some)} times {factor:g}", given, ANYTHING


def _scales(value):
    return type(value) is float or (isinstance(value, np.ndarray) and value.dtype.kind == "f")


def _scaled(value, factor):
    """Return the product, as far as there are numbers for it."""
    with np.errstate(over="ignore", under="ignore"):
        product = np.clip(value * np.float64(factor), -1.7e308, 1.7e308)
    return product if isinstance(value, np.ndarray) else float(product)


def trial_objects(call):
    """Yield the same for each argument, one after the other, replaced by each wrong object."""
    for name in call.arguments:
        for wrong in [*WRONG, (x for x in (1.0, 2.0))]:
            yield f"{name} = {_shown(wrong)}", {name: wrong}, ANYTHING


def trial_at_random(call, count, seed=0):
    """Yield the same for one to three arguments replaced at random by anything at all."""
    names = list(call.arguments)
    rng = np.random.default_rng([seed, *" ".join(names).encode()])
    for _ in range(count if names else 0):
        chosen = rng.choice(names, min(len(names), int(rng.integers(1, 4))), replace=False)
        changed = {str(name): _anything(rng, call, str(name)) for name in chosen}
        yield ", ".join(f"{k} = {_shown(v)}" for k, v in changed.items()), changed, ANYTHING


def _anything(rng, call, name):
    value, wrong, extreme = call.arguments[name], rng.integers(4) == 0, rng.integers(3) > 0
    if _scales(value) and extreme and not wrong:
        return _extreme(rng, value)
    if isinstance(value, np.ndarray) and not wrong:
        other = [v for _, v, _ in (*misshapen(name, value, call), *mistyped(value))]
        other += [v for _, v, _ in not_numbers(name, value, call)]
        other += [v for _, v in alike(value)]
        return other[rng.integers(len(other))]
    return WRONG[rng.integers(len(WRONG))]


def _extreme(rng, value):
    """Return the number or array with one, some or all of its numbers extreme, or all scaled."""
    if rng.integers(4) == 0:
        return _scaled(value, float(rng.choice(LARGE + SMALL)))
    extreme = rng.choice([-1.0, 1.0], p=[0.2, 0.8]) * rng.choice(EXTREMES)
    if type(value) is float:
        return float(extreme)
    share = rng.choice([0.0, 0.3, 1.0])
    chosen = rng.uniform(size=value.size) < share
    chosen[rng.integers(value.size)] = True
    signs = np.where(value < 0.0, -1.0, 1.0) if share else np.ones(value.shape)
    return np.where(chosen.reshape(value.shape), signs * extreme, value)


def _shown(value):
    if isinstance(value, Unspeakable):
        return "Unspeakable"
    if isinstance(value, np.ndarray):
        few = f" {value.tolist()!r:.200}" if value.size < 50 else ""
        return f"{value.dtype}{value.shape}{few}"
    return f"{type(value).__name__} {value!r:.40}"


TRIALS = {
    "arrays": trial_arrays,
    "bounds": trial_bounds,
    "magnitudes": trial_magnitudes,
    "objects": trial_objects,
    "random": trial_at_random,
}


def fault(call, changed, right):
    """Return what is wrong about a call with some arguments changed, or ""."""
    said, result = complaint(call, fresh(call.arguments) | changed)
    if said or right is ANYTHING:
        return said
    if right is REFUSED:
        return "" if result is None else "was accepted"
    if result is None and right is not None:
        return "was refused"
    return "" if same(result, right) else "gave another answer"


def walk(law, table, *options, stride=1, before=lambda label: None):
    """Return how many functions and calls were tried, and each that broke the law, in words.

    A stride above 1 tries every so-manieth trial, of each function others.
    """
    tried, broken = 0, []
    for i, (name, call) in enumerate(table.items()):
        trials = itertools.islice(TRIALS[law](call, *options), i % stride, None, stride)
        for label, changed, right in trials:
            before(f"{name}: {label}")
            tried += 1
            said = fault(call, changed, right)
            broken += [f"{name}: {label}: {said}"] if said else []
    return len({name.split(",")[0] for name in table}), tried, broken


def main(law, stride="1", *options):
    """Walk all public functions."""

    def before(label):
        faulthandler.dump_traceback_later(PATIENCE, exit=True)
        print(label, file=sys.stderr, flush=True)

    faulthandler.enable()
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    with tempfile.TemporaryDirectory() as folder:  # a wrong path may be written to
        os.chdir(folder)
        result = walk(law, calls(), *map(int, options), stride=int(stride), before=before)
        print(json.dumps(result))
        os.chdir("/")


if __name__ == "__main__":
    main(*sys.argv[1:])
