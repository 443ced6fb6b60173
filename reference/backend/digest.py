"""A kernel's fingerprint: a hash of everything that its compiled version is made from."""

import enum
import functools
import hashlib
import importlib
import types
from collections.abc import Iterator
from typing import Any

import numpy as np

# A plain function at module level: it has __code__ and __globals__, which Callable cannot say.
PythonKernel = Any


def digest(kernel: PythonKernel) -> str:
    """Return 16 hex digits of the code, constants and globals of a kernel and all its callees."""
    parts: list[bytes] = []
    _collect(kernel, parts, visited=set())
    return hashlib.sha256(b"\0".join(parts)).hexdigest()[:16]


def named_globals(kernel: PythonKernel) -> list[tuple[str, Any]]:
    """Return the globals that a kernel mentions, with their values, in the order of their names."""
    names = sorted({name for code in code_objects(kernel.__code__) for name in code.co_names})
    return [(name, kernel.__globals__[name]) for name in names if name in kernel.__globals__]


def kernels_in(value: Any) -> tuple[PythonKernel, ...]:
    """Return a kernel, or the kernels in a NamedTuple; none for any other value."""
    kernels = value if isinstance(value, tuple) else (value,)
    return tuple(kernel for kernel in kernels if isinstance(kernel, types.FunctionType))


def callees(kernel: PythonKernel) -> list[tuple[str, PythonKernel]]:
    """Return the other kernels that a kernel calls, by the names under which it does."""
    return [
        (name, callee)
        for name, value in named_globals(kernel)
        for callee in kernels_in(value)
        if callee is not kernel
    ]


def code_objects(code: types.CodeType) -> Iterator[types.CodeType]:
    """Yield a code object and the code objects nested in it, like comprehensions."""
    yield code
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            yield from code_objects(constant)


def _collect(kernel: PythonKernel, parts: list[bytes], visited: set[Any]) -> None:
    if kernel in visited:
        return
    visited.add(kernel)
    _collect_code(kernel.__code__, parts)
    parts.append(repr(kernel.__defaults__).encode())
    if hasattr(kernel, "compiled_in"):
        parts.append(_module_fingerprint(kernel.compiled_in))
    for name, value in named_globals(kernel):
        parts.append(name.encode())
        for callee in kernels_in(value):
            _collect(callee, parts, visited)
        if not kernels_in(value):
            parts.append(_fingerprint(value))


def _collect_code(whole: types.CodeType, parts: list[bytes]) -> None:
    for code in code_objects(whole):
        constants = [c for c in code.co_consts if not isinstance(c, types.CodeType)]
        parts += [code.co_code, repr((constants, code.co_names, code.co_varnames)).encode()]


@functools.cache
def _module_fingerprint(name: str) -> bytes:
    """Return the whole code of a module, as no function refers to its registrations with numba."""
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
