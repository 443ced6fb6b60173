"""One source, two speeds.

A kernel is a plain Python function on floats, arrays and tuples of them. `TwoSpeeds(kernel)` runs
it compiled; inside `with speed("plain"):` the very same source runs in the interpreter.

The compiled version is *rebuilt* from the plain one with every kernel it calls replaced by that
kernel's own compiled version, so the plain functions never reach compiled code and can serve as
the oracle. The on-disk cache of numba looks at one function at a time: edited callees and
constants in other files would go unnoticed. The rebuilt function therefore carries in its name a
digest of everything it is made from.
"""

import contextlib
import enum
import functools
import hashlib
import importlib
import types
from collections.abc import Callable, Iterator
from contextvars import ContextVar
from typing import Any

import numpy as np

from .. import arguments

SPEEDS = ("compiled", "plain")
# What a relaxed kernel's compiler may do; infinities and NaN keep their meaning.
RELAXATIONS = {"reassoc", "contract", "nsz"}
# What a kernel mentions if it makes arrays.
ALLOCATING = {"np", "copy"}

# A plain function at module level: it has __code__ and __globals__, which Callable cannot say.
Kernel = Any

_speed: ContextVar[str] = ContextVar("speed", default="compiled")


@contextlib.contextmanager
def speed(name: str) -> Iterator[None]:
    """Run every kernel at the named speed, "compiled" (the default) or "plain".

    Raises:
        ValueError: if the name is neither.
    """
    token = _speed.set(arguments.choice("speed", name, SPEEDS))
    try:
        yield
    finally:
        _speed.reset(token)


class TwoSpeeds:
    """A kernel that runs compiled or plain, as `speed` says; compiled at its first call.

    `relaxed` lets the compiler reorder sums and fuse products with them: both speeds then agree
    only to rounding, and dense loops run up to four times faster.
    """

    def __init__(self, plain: Kernel, *, relaxed: bool = False):
        self.plain = plain
        self.relaxed = relaxed
        functools.update_wrapper(self, plain)

    @functools.cached_property
    def compiled(self) -> Kernel:
        """The version compiled by numba, on the same arguments."""
        return compile_kernel(self.plain, self.relaxed)

    def __call__(self, *arguments: Any) -> Any:
        """Run the kernel at the speed in force."""
        if _speed.get() == "plain":
            return self.plain(*arguments)
        return self.compiled(*arguments)


def compile_kernel(kernel: Kernel, relaxed: bool = False) -> Kernel:
    """Compile a kernel and all kernels it calls, from their plain sources; cached on disk.

    Division by zero gives infinity or NaN, as in NumPy. Unless it is relaxed, floating point is
    strict: no reordering and no fused operations, so that both speeds round alike.
    """
    return _jit(kernel, True, relaxed)


class Slot:
    """A name that a kernel calls and that `bind` gives a kernel: `update = Slot("update")`."""

    def __init__(self, name: str):
        self.name = name

    def __call__(self, *arguments: Any) -> Any:
        """Raise a ValueError, for nothing has been bound."""
        raise ValueError(f"{self.name}: expected a kernel bound to this slot, got none")

    def __repr__(self) -> str:
        return f"Slot({self.name!r})"


def bind(kernel: Kernel, **callees: Kernel) -> Kernel:
    """Return a kernel that calls other kernels under the given names: one loop, many solvers.

    A slot of a given name is filled wherever the kernel, or one that it calls, has it.

    Raises:
        ValueError: if the kernel names one of them nowhere, or has a closure.
    """
    slots = _slots(kernel, set())
    for name in callees:
        if name not in slots and name not in kernel.__code__.co_names:
            raise ValueError(f"callees: expected names that {kernel.__name__} calls, got {name!r}")
    filled = _fill_slots(kernel, callees, {})
    return _rebuild(filled, filled.__globals__ | callees)


def _callees(kernel: Kernel) -> list[tuple[str, Kernel]]:
    """Return the plain functions that a kernel calls, itself left out."""
    return [
        (name, value)
        for name, value in _named_globals(kernel)
        if isinstance(value, types.FunctionType) and value is not kernel
    ]


def _slots(kernel: Kernel, seen: set[Kernel]) -> set[str]:
    """Return the names of the slots of a kernel and of all that it calls."""
    seen.add(kernel)
    found = {name for name, value in _named_globals(kernel) if isinstance(value, Slot)}
    for _, callee in _callees(kernel):
        if callee not in seen:
            found |= _slots(callee, seen)
    return found


def _fill_slots(kernel: Kernel, callees: dict[str, Kernel], made: dict[Kernel, Kernel]) -> Kernel:
    """Return a kernel rebuilt if it, or one that it calls, has slots of these names."""
    if kernel not in made:
        changed = {name: _fill_slots(value, callees, made) for name, value in _callees(kernel)}
        changed = {k: v for k, v in changed.items() if v is not kernel.__globals__[k]}
        for name, value in _named_globals(kernel):
            if isinstance(value, Slot) and name in callees:
                changed[name] = callees[name]
        made[kernel] = _rebuild(kernel, kernel.__globals__ | changed) if changed else kernel
    return made[kernel]


def compiled_in(module: str) -> Callable[[Kernel], Kernel]:
    """Return a decorator: the compiled version is the function of that name in another module.

    It is for what no plain source can say, such as vector instructions. The module is imported
    when a caller is compiled.
    """

    def mark(plain: Kernel) -> Kernel:
        plain.compiled_in = module
        return plain

    return mark


def digest(kernel: Kernel) -> str:
    """Sixteen hex digits of the code, constants and globals of a kernel and all its callees."""
    parts: list[bytes] = []
    _collect(kernel, parts, seen=set())
    return hashlib.sha256(b"\0".join(parts)).hexdigest()[:16]


@functools.cache
def _jit(kernel: Kernel, cache: bool, relaxed: bool) -> Kernel:
    """Compile; a callee is part of its caller's cached code and needs no cache of its own.

    Callees are inlined, whatever their size: a call hands over every number of every array in its
    tuples, a hundred and more, and costs more than most kernels do.
    """
    import numba

    for _, value in _named_globals(kernel):
        if isinstance(value, Slot):
            value()
    callees = {name: _callee(value, relaxed) for name, value in _callees(kernel)}
    rebuilt = _rebuild(kernel, kernel.__globals__ | callees)
    rebuilt.__qualname__ = f"{kernel.__qualname__}_{digest(kernel)}{'_relaxed' * relaxed}"
    options: dict[str, Any] = {
        "no_cpython_wrapper": not cache,  # what Python never calls needs no door to it
        "no_cfunc_wrapper": True,
        "forceinline": not cache,
        "fastmath": RELAXATIONS if relaxed else False,
    }
    if not (cache or allocates(kernel)):
        options["_nrt"] = False
    return numba.njit(cache=cache, error_model="numpy", nogil=True, **options)(rebuilt)


def _callee(kernel: Kernel, relaxed: bool) -> Kernel:
    module = getattr(kernel, "compiled_in", None)
    if module is None:
        return _jit(kernel, False, relaxed)
    return getattr(importlib.import_module(module), kernel.__name__)


def allocates(kernel: Kernel) -> bool:
    """Return whether a kernel, or one that it calls, may make arrays.

    One that makes none is compiled without counting references to those it is given, which is
    half of the work where arrays come many in a tuple. numba refuses to compile an error here.
    """
    names = {name for code in _codes(kernel.__code__) for name in code.co_names}
    return bool(ALLOCATING & names) or any(
        allocates(value) for _, value in _callees(kernel) if not hasattr(value, "compiled_in")
    )


def _rebuild(kernel: Kernel, new_globals: dict[str, Any]) -> Kernel:
    if kernel.__closure__:
        raise ValueError(f"kernel: {kernel.__qualname__} has a closure; pass what it needs instead")
    rebuilt = types.FunctionType(kernel.__code__, new_globals, kernel.__name__, kernel.__defaults__)
    rebuilt.__module__ = kernel.__module__
    rebuilt.__qualname__ = kernel.__qualname__
    rebuilt.__doc__ = kernel.__doc__
    return rebuilt


def _named_globals(kernel: Kernel) -> list[tuple[str, Any]]:
    names = sorted({name for code in _codes(kernel.__code__) for name in code.co_names})
    return [(name, kernel.__globals__[name]) for name in names if name in kernel.__globals__]


def _codes(code: types.CodeType) -> Iterator[types.CodeType]:
    """Yield the code object and those nested in it, such as comprehensions."""
    yield code
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            yield from _codes(constant)


def _collect(kernel: Kernel, parts: list[bytes], seen: set[Any]) -> None:
    if kernel in seen:
        return
    seen.add(kernel)
    _collect_code(kernel.__code__, parts)
    parts.append(repr(kernel.__defaults__).encode())
    if hasattr(kernel, "compiled_in"):
        parts.append(_module_fingerprint(kernel.compiled_in))
    for name, value in _named_globals(kernel):
        parts.append(name.encode())
        if isinstance(value, types.FunctionType):
            _collect(value, parts, seen)
        else:
            parts.append(_fingerprint(value))


def _collect_code(whole: types.CodeType, parts: list[bytes]) -> None:
    for code in _codes(whole):
        constants = [c for c in code.co_consts if not isinstance(c, types.CodeType)]
        parts += [code.co_code, repr((constants, code.co_names, code.co_varnames)).encode()]


@functools.cache
def _module_fingerprint(name: str) -> bytes:
    """Return all of a module: what it registers with numba is reached by no function's name."""
    module = importlib.import_module(name)
    loader: Any = module.__loader__
    parts: list[bytes] = []
    _collect_code(loader.get_code(name), parts)
    numbers = {k: v for k, v in vars(module).items() if isinstance(v, int | float)}
    return b"\0".join([*parts, repr(sorted(numbers.items())).encode()])


def _fingerprint(value: Any) -> bytes:
    if isinstance(value, np.ndarray):
        return repr((value.dtype.str, value.shape)).encode() + value.tobytes()
    if isinstance(value, types.ModuleType):
        return repr((value.__name__, getattr(value, "__version__", ""))).encode()
    if isinstance(value, enum.EnumMeta):
        return repr(list(value)).encode()
    if isinstance(value, type):
        return repr((value.__qualname__, getattr(value, "_fields", ()))).encode()
    return repr(value).encode()
