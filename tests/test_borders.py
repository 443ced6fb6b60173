"""No public function lets a wrong argument in, changes a right one, or hands on a NaN."""

import copy
import dataclasses
import functools
import inspect
import math
import re

import numpy as np
import pytest
import scipy
from public_calls import INTERNAL, call_of, names, public_names

from plumbob import (
    Articulation,
    Certificate,
    IKCertificate,
    IKSolutions,
    Outcome,
    StepJudgement,
    StepResult,
)  # fmt: skip
from plumbob.reference import arguments
from plumbob.reference.model import Robot

# Arguments that may have more leading axes, that may have any length, that may be infinite.
BATCHED = {
    "q", "v", "a", "b", "q0", "q1", "matrix", "quaternions", "local_rotations", "rotations",
    "curve", "target", "position", "rotation", "wind",
}  # fmt: skip
ANY_LENGTH = {"pinned", "joints", "coefficients"}
INFINITE = {"lower", "upper", "cones"}
# Words for errors, what stands for a file, and a choice that is not checked.
UNCHECKED = {"argument", "name", "path", "root"}
# Other names by which an error may call an argument.
ALIASES = {
    "local_rotations": "q", "pose": "q local_rotations", "position": "target residual",
    "shift": "mimics", "text": "BVH MJCF URDF x", "leader": "joint",
    "coefficients": "residual", "vertices": "masses", "masses": "springs", "result": "positions",
    "relative_to": "frame", "target_frame": "frame", "target": "rotation",
}  # fmt: skip
BEYOND = {float: [math.nan, math.inf, -math.inf, 2e75], int: [2**63, -(2**63)]}
BESIDE = {
    float: ["text", True, [1.0, 2.0], 1j], int: ["text", True, 1.5, [1, 2]], bool: ["text", 1],
    str: [2.5, [], "no such name"],
}  # fmt: skip
OTHER_TYPES = {"f": ["c16", "O", "U8", "?"], "i": ["f8", "O", "U8", "?"], "b": ["f8", "i8", "U8"]}


def wrong_values(call, name):
    """Yield what an argument may not be."""
    x, parameter = call.keywords[name], inspect.signature(call.func).parameters[name]
    takes_none = parameter.default is None or "None" in str(parameter.annotation)
    if not takes_none and name != "frame":  # None is the frame of the world
        yield None
    if not isinstance(x, np.ndarray):
        yield from BESIDE.get(type(x), ["text", 2.5]) + BEYOND.get(type(x), [])
        return
    yield "text"
    yield from [x[..., :-1]] * (name not in ANY_LENGTH) + [x[None]] * (name not in BATCHED)
    yield from (x.astype(kind) for kind in OTHER_TYPES[x.dtype.kind])
    numbers = {"f": BEYOND[float], "i": [99], "b": []}[x.dtype.kind]
    for number in numbers:
        if not (name in INFINITE and math.isinf(number)):
            yield from (replaced(x, place, number) for place in (0, -1))


def replaced(x, place, number):
    """Return a number, or an array with one number replaced."""
    values = np.array(x)
    values.flat[place] = number
    return values if isinstance(x, np.ndarray) else number


def answer(call, changed=()):
    """Return the result of a call, some arguments changed, and its error or the law it broke."""
    kinds = np.ndarray | np.random.Generator
    given = {k: copy.deepcopy(v) if isinstance(v, kinds) else v for k, v in call.keywords.items()}
    given |= dict(changed)
    arrays = {k: v for k, v in given.items() if isinstance(v, np.ndarray)}
    before, result, said = {k: v.tobytes() for k, v in arrays.items()}, None, ""
    try:
        result = call.func(**given)
    except ValueError as error:
        said = str(error)
    except FloatingPointError:  # documented where a motion may overflow
        return None, ""
    except Exception as error:
        said = f"raised {type(error).__name__}, {error}"
    if any(arrays[k].tobytes() != values for k, values in before.items()):
        said = "changed its arguments"
    elif any(np.shares_memory(a, b) for a in numbers_of(result) for b in arrays.values()):
        said = "kept the memory of its arguments"
    elif not is_finite(result):
        said = "passed on NaN or infinity"
    return result, said


def numbers_of(result):
    """Return all arrays of a result, and its numbers as arrays."""
    if scipy.sparse.issparse(result):
        return [result.data]
    if isinstance(result, np.ndarray | float | int):
        return [np.asarray(result)]
    if dataclasses.is_dataclass(result):
        fields = [field.name for field in dataclasses.fields(result) if field.name[0] != "_"]
        result = [getattr(result, name) for name in fields]
    parts = result if isinstance(result, list | tuple) else []
    return [x for part in parts for x in numbers_of(part)]


def is_finite(result):
    """Return whether all numbers are, but for bounds of proofs and what an outcome tells."""
    if isinstance(result, Certificate | IKCertificate):
        return True
    if isinstance(result, Robot):  # whose file may leave masses to meshes
        result = result.articulation
    if isinstance(result, Articulation):
        result = result.forward(result.neutral())
    if isinstance(result, StepResult) and result.outcome is Outcome.DIVERGED:
        result = result.state
    if isinstance(result, StepJudgement):
        result = result.minimiser
    if isinstance(result, IKSolutions):  # joints without limits turn without end
        result = result.coordinates
    return all(np.isfinite(x).all() for x in numbers_of(result) if x.dtype.kind in "fc")


def names_one(said, arguments):
    """Return whether an error names one of the arguments before its colon."""
    words = {word for name in arguments for word in [name, *ALIASES.get(name, "").split()]}
    return bool(words & set(re.findall(r"\w+", said.partition(":")[0])))


def accepted(call):
    """Yield each wrong argument that no error names, in words."""
    for name in call.keywords.keys() - UNCHECKED:
        for value in wrong_values(call, name):
            result, said = answer(call, {name: value})
            is_shape = isinstance(value, np.ndarray) and value.shape != call.keywords[name].shape
            if not names_one(said, call.keywords if is_shape else [name]):
                yield f"{name} = {value!r:.60}: {said or result!r:.200}"


def unlike(call):
    """Yield what is wrong about the call, and arrays that give another answer in another form."""
    yield from filter(None, [answer(call)[1]])
    for name, x in call.keywords.items():
        if not isinstance(x, np.ndarray):
            continue
        view = np.repeat(x, 2, axis=-1)[..., ::2]
        view.setflags(write=False)
        single = x.astype(np.float32) if x.dtype.kind == "f" else x
        double = single.astype(x.dtype)
        pairs = (x.tolist(), x), (view, x), (np.asfortranarray(x), x), (single, double)
        for form, plain in pairs:
            (result, said), (expected, _) = answer(call, {name: form}), answer(call, {name: plain})
            results, expected = numbers_of(result), numbers_of(expected)
            if said or [a.tobytes() for a in results] != [b.tobytes() for b in expected]:
                yield f"{name} as {type(form).__name__}: {said}"


def overflowing(call):
    """Yield the magnitudes that are neither refused by name nor answered, in words."""
    kinds = {k: getattr(v, "dtype", type(v)) for k, v in call.keywords.items()}
    numbers = {k: call.keywords[k] for k, kind in kinds.items() if kind in (float, np.float64)}
    for factor in (1e70, 1e-70, 1e76):
        for some in [*([name] for name in numbers), list(numbers)]:
            _, said = answer(call, {name: numbers[name] * factor for name in some})
            if said and not names_one(said, call.keywords):
                yield f"{' '.join(some)} times {factor:g}: {said}"
    for name, x in numbers.items():  # a size, which is no negative number, is no tiny one either
        negative, tiny = (answer(call, {name: replaced(x, -1, n)})[1] for n in (-1e-70, 1e-76))
        if negative and not tiny:
            yield f"{name} = 1e-76 was accepted"


LAWS = (accepted, unlike, overflowing)


def test_every_public_function_is_called_or_internal():
    """A new one is called by itself, if its arguments have values in the table."""
    assert len(names()) >= 120
    assert set(INTERNAL) <= public_names().keys()


@pytest.mark.sample(without=["anderson_ccd", "damped_least_squares", "jacobian_transpose"])
@pytest.mark.parametrize("name", names())
def test_every_public_function_keeps_the_laws(name):
    call = call_of(name)
    assert [said for law in LAWS for said in law(call)] == []


def checked(x):
    return 1.0 * arguments.array("x", x, "row", 3)


FAULTS = {
    "unchecked": (accepted, lambda x: np.array(x, dtype=float)[0]),
    "forgets the shape": (accepted, lambda x: 1.0 * arguments.array("x", x, "...")),
    "names another": (accepted, lambda x: 1.0 * arguments.array("y", x, "row", 3)),
    "checks no number": (accepted, lambda x: np.log1p(arguments.floats("x", x, "row", 3) ** 2)),
    "in place": (unlike, lambda x: checked(np.multiply(x, 2.0, out=np.asarray(x)))),
    "not copied": (unlike, lambda x: arguments.array("x", x, "row", 3)),
    "sees the strides": (unlike, lambda x: checked(x) + np.asarray(x).strides[0]),
    "overflows": (overflowing, lambda x: checked(x) ** 5),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_laws_see_the_fault(fault):
    law, function = FAULTS[fault]
    x = np.arange(12.0).reshape(4, 3)
    assert list(law(functools.partial(function, x=x)))
    assert list(law(functools.partial(checked, x=x))) == []
