"""A single source, two backends: every kernel runs compiled by numba, or in the Python interpreter.

A kernel is written as a plain Python function on floats, arrays and tuples of floats and arrays.
`Kernel(plain)` runs the compiled kernel; inside `with set_backend("python"):` the interpreter runs
the very same source.

The compiled version is *rebuilt* from the plain function with every callee replaced by its own
compiled version. The plain functions stay as they are and can serve as the oracle. Numba's disk
cache compares the file of a function only: it would miss changes of callees and constants in other
files. The rebuilt function therefore has a digest of all its sources in its name.
"""

import contextlib
import dis
import enum
import functools
import hashlib
import importlib
import threading
import types
from collections import Counter
from collections.abc import Callable, Iterator
from contextvars import ContextVar
from typing import Any

import numpy as np

from .. import arguments
from . import compilation

# A plain function at module level with __code__ and __globals__, which Callable cannot say.
PythonKernel = Any

BACKENDS = ("numba", "python")
# Optimisations allowed for relaxed kernels; infinities and NaN keep their meaning.
RELAXATIONS = {"reassoc", "contract", "nsz"}
# Names in kernels that make arrays, or views that a kernel returns.
ALLOCATING = {"np", "copy", "reshape", "view"}
# The largest size of callees always inlined, in the interpreter's instructions.
INLINED_SIZE = 5000
# The interpreter's instructions that read a global.
GLOBAL_LOADS = {"LOAD_GLOBAL", "LOAD_NAME"}

# Numba refuses a thread that waits to compile while another thread disables compilation.
_specialising = threading.Lock()
_backend: ContextVar[str] = ContextVar("backend", default="numba")


@contextlib.contextmanager
def set_backend(name: str) -> Iterator[None]:
    """Run every kernel, inside the block, by "numba" (the default) or "python", its interpreter.

        with set_backend("python"):

    Raises:
        ValueError: if the name is neither.
    """
    token = _backend.set(arguments.choice("backend", name, BACKENDS))
    try:
        yield
    finally:
        _backend.reset(token)


class Kernel:
    """A kernel that runs on the backend in force; compiled at its first call.

    `relaxed` lets the compiler reorder sums and fuse products with sums. The backends then agree
    only to rounding, and dense loops run up to four times faster. `label` is its name for users.
    Callees of more than `inlined_size` instructions of the interpreter are inlined only once.
    `constants` are the first arguments, such as other kernels; a call has the rest.
    Without `nogil` the kernel keeps the interpreter's lock: a call takes 0.03 µs less.
    """

    def __init__(
        self,
        plain: PythonKernel,
        *,
        constants: tuple[Any, ...] = (),
        relaxed: bool = False,
        label: str | None = None,
        inlined_size: int = INLINED_SIZE,
        nogil: bool = True,
    ):
        self.plain = plain = with_first(plain, constants) if constants else plain
        self.relaxed = relaxed
        self.label = label
        self.inlined_size = inlined_size
        self.nogil = nogil
        functools.update_wrapper(self, plain)

    @functools.cached_property
    def compiled(self) -> PythonKernel:
        """The version compiled by numba, on the same arguments."""
        settings = self.relaxed, self.label, self.inlined_size, self.nogil
        return compile_kernel(self.plain, *settings)

    @property
    def in_force(self) -> Callable[..., Any]:
        """The kernel on the backend in force now, for many calls: a call takes 0.2 µs less."""
        return self if _backend.get() == "python" else self.compiled

    def specialise(self, *example: np.ndarray) -> Callable[..., Any]:
        """Return the kernel in force for arrays with the types of an example, on which it runs.

        Compiled, it then raises a TypeError for other types, or an error of numba, which takes
        0.1 ms. A read-only example lets writable arrays pass as well.
        """
        kernel = self.in_force
        with _specialising:
            kernel(*example)
            if hasattr(kernel, "disable_compile"):
                kernel.disable_compile()
        return kernel

    def __call__(self, *arguments: Any) -> Any:
        """Run the kernel on the backend in force; neither warns where a number overflows."""
        if _backend.get() == "python":
            with np.errstate(all="ignore"):
                return self.plain(*arguments)
        try:
            return self.compiled(*arguments)
        except SystemError as error:  # a signal, such as Ctrl-C, came while numba made the result
            cause: BaseException = error
            while cause.__cause__ is not None:
                cause = cause.__cause__
            raise cause from None


@functools.cache
def compile_kernel(
    kernel: PythonKernel,
    relaxed: bool = False,
    label: str | None = None,
    inlined_size: int = INLINED_SIZE,
    nogil: bool = True,
) -> PythonKernel:
    """Compile a kernel and all kernels it calls, from their plain sources; cached on disk.

    Division by zero gives infinity or NaN, as in NumPy. Unless the kernel is relaxed, floating
    point is strict: no reordering and no fused operations, and both backends round alike.

    Callees are inlined: a call would pass every number of every array in its tuples, more than a
    hundred, and take longer than most kernels. Exceptions are callees above a size in several
    places: their copies would take seconds to compile.

    Where NUMBA_DISABLE_JIT turns numba's compiler off, the interpreter runs the kernel.
    """
    if compilation.numba_settings().DISABLE_JIT:
        return kernel
    from . import disk_cache, linking

    compilation.watch_numba()
    options: dict[str, Any] = {"nogil": nogil} | ({} if allocates(kernel) else {"_nrt": False})
    if linking.is_supported():
        options["pipeline_class"] = linking.KernelCompiler
    compiled = _jit(kernel, relaxed, inlined_size, **options)
    compiled.label = label or kernel.__name__.strip("_").replace("_", " ")
    disk_cache.use_cache(compiled)
    return compiled


def with_first(kernel: PythonKernel, constants: tuple[Any, ...]) -> PythonKernel:
    """Return a kernel of the other arguments than the first, as `functools.partial` does.

    The source is written out, since numba takes a call apart sooner if arguments have names.
    """
    code = kernel.__code__
    names = code.co_varnames[: code.co_argcount]
    rest = ", ".join(names[len(constants) :])
    source = f"def {kernel.__name__}({rest}): return kernel({', '.join(names)})"
    namespace = {"kernel": kernel, "__name__": kernel.__module__} | dict(
        zip(names, constants, strict=False)
    )
    exec(compile(source, code.co_filename, "exec"), namespace)
    return namespace[kernel.__name__]


def relaxed(plain: PythonKernel) -> PythonKernel:
    """Let a function be relaxed in whatever kernel calls it, as `Kernel` lets a whole kernel be."""
    plain.relaxed = True
    return plain


def uncounted(plain: PythonKernel) -> PythonKernel:
    """Say that a function with a name in `ALLOCATING` only views arrays, and returns none."""
    plain.uncounted = True
    return plain


def compiled_in(module: str) -> Callable[[PythonKernel], PythonKernel]:
    """Return a decorator of functions whose compiled versions are in another module.

    The decorator is for vector instructions. The module is imported when a caller is compiled.
    """

    def mark(plain: PythonKernel) -> PythonKernel:
        plain.compiled_in = module
        return plain

    return mark


@functools.cache
def _callee(
    kernel: PythonKernel, relaxed: bool, inline: bool, inlined_size: int = INLINED_SIZE
) -> PythonKernel:
    """Compile a callee of another kernel, without an entry point for Python."""
    module = getattr(kernel, "compiled_in", None)
    if module is not None:
        return getattr(importlib.import_module(module), kernel.__name__)
    from . import linking

    options: dict[str, Any] = {"no_cpython_wrapper": True, "forceinline": inline}
    if not allocates(kernel):
        options["_nrt"] = False
    if not linking.is_supported():
        return _jit(kernel, relaxed, inlined_size, **options)
    compiled = _jit(kernel, relaxed, inlined_size, pipeline_class=linking.LinkedCompiler, **options)
    return linking.compile_directly(compiled)


def _jit(kernel: PythonKernel, relaxed: bool, inlined_size: int, **options: Any) -> PythonKernel:
    import numba

    calls = _calls(kernel)
    compiled_globals = {
        name: _compiled_global(value, relaxed, calls[name] == 1, inlined_size)
        for name, value in _named_globals(kernel)
        if _kernels_in(value) and value is not kernel
    }
    result = rebuilt(kernel, **compiled_globals)
    flags = f"{'_relaxed' * relaxed}{'_uncounted' * ('_nrt' in options)}"  # the cache tells apart
    result.__qualname__ = f"{kernel.__qualname__}_{digest(kernel)}{flags}"
    options |= {"error_model": "numpy", "no_cfunc_wrapper": True}
    return numba.njit(fastmath=RELAXATIONS if relaxed else False, **options)(result)


def _compiled_global(value: Any, relaxed: bool, inline: bool, inlined_size: int) -> Any:
    """Return a callee compiled, or a NamedTuple of kernels with each compiled."""
    if not isinstance(value, types.FunctionType):
        return value._make(_compiled_global(k, relaxed, True, inlined_size) for k in value)
    inline |= _inlined_size(value) <= inlined_size
    return _callee(value, relaxed or hasattr(value, "relaxed"), inline, inlined_size)


def _calls(kernel: PythonKernel) -> Counter[str]:
    """Return how many times a kernel mentions each of its globals."""
    codes = map(dis.get_instructions, _code_objects(kernel.__code__))
    return Counter(i.argval for code in codes for i in code if i.opname in GLOBAL_LOADS)


@functools.cache
def _inlined_size(kernel: PythonKernel) -> int:
    """Return the number of instructions of the interpreter, all callees inlined."""
    own = sum(len(list(dis.get_instructions(code))) for code in _code_objects(kernel.__code__))
    calls = _calls(kernel)
    return own + sum(calls[name] * _inlined_size(callee) for name, callee in _callees(kernel))


@functools.cache
def allocates(kernel: PythonKernel) -> bool:
    """Return whether a kernel or its callees may make arrays.

    If not, the kernel is compiled without counting references to its arguments, which takes half of
    the time where a tuple holds many arrays. For a wrong answer numba would report an error.
    """
    names = {name for code in _code_objects(kernel.__code__) for name in code.co_names}
    if hasattr(kernel, "uncounted"):
        return False
    return bool(ALLOCATING & names) or any(
        allocates(callee) for _, callee in _callees(kernel) if not hasattr(callee, "compiled_in")
    )


def rebuilt(kernel: PythonKernel, /, **other: Any) -> PythonKernel:
    """Return a kernel with some other globals, such as compiled callees.

    Raise a ValueError if the kernel has a closure.
    """
    if kernel.__closure__:
        raise ValueError(f"kernel: {kernel.__qualname__} has a closure; pass what it needs instead")
    result = types.FunctionType(
        kernel.__code__, kernel.__globals__ | other, kernel.__name__, kernel.__defaults__
    )
    result.__module__ = kernel.__module__
    result.__qualname__ = kernel.__qualname__
    result.__doc__ = kernel.__doc__
    return result


def digest(kernel: PythonKernel) -> str:
    """Return 16 hex digits of the code, constants and globals of a kernel and all its callees."""
    parts: list[bytes] = []
    _collect(kernel, parts, visited=set())
    return hashlib.sha256(b"\0".join(parts)).hexdigest()[:16]


def _named_globals(kernel: PythonKernel) -> list[tuple[str, Any]]:
    """Return the globals mentioned by a kernel, with their values, in the order of their names."""
    names = sorted({name for code in _code_objects(kernel.__code__) for name in code.co_names})
    return [(name, kernel.__globals__[name]) for name in names if name in kernel.__globals__]


def _kernels_in(value: Any) -> tuple[PythonKernel, ...]:
    """Return a kernel, or the kernels in a NamedTuple; none for any other value."""
    kernels = value if isinstance(value, tuple) else (value,)
    return tuple(kernel for kernel in kernels if isinstance(kernel, types.FunctionType))


def _callees(kernel: PythonKernel) -> list[tuple[str, PythonKernel]]:
    """Return the other kernels called by a kernel, by their names in the kernel."""
    return [
        (name, callee)
        for name, value in _named_globals(kernel)
        for callee in _kernels_in(value)
        if callee is not kernel
    ]


def _code_objects(code: types.CodeType) -> Iterator[types.CodeType]:
    """Yield a code object and the code objects nested in it, like comprehensions."""
    yield code
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            yield from _code_objects(constant)


def _collect(kernel: PythonKernel, parts: list[bytes], visited: set[Any]) -> None:
    if kernel in visited:
        return
    visited.add(kernel)
    _collect_code(kernel.__code__, parts)
    parts.append(repr((kernel.__defaults__, hasattr(kernel, "relaxed"))).encode())
    if hasattr(kernel, "compiled_in"):
        parts.append(_module_fingerprint(kernel.compiled_in))
    for name, value in _named_globals(kernel):
        parts.append(name.encode())
        for callee in _kernels_in(value):
            _collect(callee, parts, visited)
        if not _kernels_in(value):
            parts.append(_fingerprint(value))


def _collect_code(whole: types.CodeType, parts: list[bytes]) -> None:
    for code in _code_objects(whole):
        constants = [c for c in code.co_consts if not isinstance(c, types.CodeType)]
        parts += [code.co_code, repr((constants, code.co_names, code.co_varnames)).encode()]


@functools.cache
def _module_fingerprint(name: str) -> bytes:
    """Return the whole code of a module, as no function refers to its registrations with numba."""
    module = importlib.import_module(name)
    loader: Any = module.__loader__
    parts: list[bytes] = []
    _collect_code(loader.get_code(name), parts)
    numbers = {
        name: number for name, number in vars(module).items() if isinstance(number, int | float)
    }
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
