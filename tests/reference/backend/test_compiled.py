import math
import signal
import subprocess
import sys
import textwrap
import threading
from typing import Any, NamedTuple

import numpy as np
import pytest

from plumbob.reference import arguments
from plumbob.reference.backend import compiled

pytestmark = pytest.mark.both_backends

FACTOR = 3.0


def square(x):
    return x * x * FACTOR


def cube(x):
    return x * x * x


def total(values):
    s = 0.0
    for value in values:
        s += square(value)
    return s


def test_the_plain_speed_never_reaches_compiled_code():
    with compiled.set_backend("python"):
        kernel = compiled.Kernel(total)
        kernel(np.arange(4.0))
    assert "compiled" not in vars(kernel)
    assert total.__globals__["square"] is square


def test_the_speed_in_force_ends_with_its_block():
    with compiled.set_backend("python"), compiled.set_backend("numba"):
        pass
    kernel = compiled.Kernel(total)
    kernel(np.arange(2.0))
    assert "compiled" in vars(kernel)


def test_an_unknown_backend_is_refused():
    with pytest.raises(ValueError, match="backend: expected one of numba, python, got 'fast'"):
        compiled.set_backend("fast").__enter__()


def test_a_rebuilt_kernel_calls_another_callee(backend):
    cubes = compiled.Kernel(compiled.rebuilt(total, square=cube))
    assert cubes(np.arange(3.0)) == 1 + 8


def powered(power, factor, x):
    return factor * power(x)


def test_a_kernel_is_given_its_first_arguments(backend):
    cubes = compiled.Kernel(powered, constants=(cube, 10.0))
    assert cubes(2.0) == 10.0 * cube(2.0)
    squares = compiled.Kernel(powered, constants=(square, 10.0))
    assert squares(2.0) == 10.0 * square(2.0)
    assert compiled.digest(cubes.plain) != compiled.digest(squares.plain)


class Operations(NamedTuple):
    """Kernels that another one calls."""

    first: Any
    second: Any


operations = Operations(square, cube)


def applied(calls, x):
    return calls.first(x) + 10.0 * calls.second(x)


def applied_to_all(x):
    result = 0.0
    for i in range(len(x)):
        result += applied(operations, x[i])
    return result


def test_kernels_in_a_tuple_are_called_by_their_names(backend):
    both = compiled.Kernel(applied_to_all)
    swapped = compiled.Kernel(compiled.rebuilt(applied_to_all, operations=Operations(cube, square)))
    assert (both(np.arange(3.0)), swapped(np.arange(3.0))) == (105.0, 159.0)


def test_a_closure_is_refused():
    inner = math.tau

    def kernel(x):
        return x * inner

    with pytest.raises(ValueError, match="closure"):
        compiled.compile_kernel(kernel)


def plus_one(x):
    return x + 1.0


def plus_two(x):
    return x + 2.0


def minus_one(x):
    return x - 1.0


def plus_default(x, y=1.0):
    return x + y


def plus_other_default(x, y=2.0):
    return x + y


def at_sine(x):
    return np.sin(x)


def at_cosine(x):
    return np.cos(x)


WEIGHTS, OTHER_WEIGHTS = np.zeros(2000), np.zeros(2000)
OTHER_WEIGHTS[1000] = 1.0


def weighed(x):
    return x * WEIGHTS[1000]


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (plus_one, plus_two),
        (plus_one, minus_one),
        (plus_default, plus_other_default),
        (at_sine, at_cosine),
        (weighed, compiled.rebuilt(weighed, WEIGHTS=OTHER_WEIGHTS)),
        (applied_to_all, compiled.rebuilt(applied_to_all, operations=Operations(square, square))),
    ],
    ids=["constant", "operation", "default", "attribute", "array", "tuple"],
)
def test_kernels_that_differ_in_one_ingredient_have_other_digests(one, other):
    assert compiled.digest(one) != compiled.digest(other)
    assert compiled.digest(one) == compiled.digest(one)


APART = """
from numba import njit
FACTOR = 2.0

def register():
    return 1

@njit
def doubled(x):
    return FACTOR * x
"""


def doubled(x):
    return 2.0 * x


def doubled_elsewhere(module):
    """A kernel one of whose callees has its compiled version in a module."""
    marked = compiled.compiled_in(module)(compiled.rebuilt(doubled))
    return compiled.rebuilt(total, square=marked)


@pytest.fixture
def module_of(tmp_path, monkeypatch):
    """Return a function that writes a module whose name no other test uses, and returns that."""
    monkeypatch.syspath_prepend(tmp_path)

    def write(name, source):
        (tmp_path / f"{name}_of_{tmp_path.name}.py").write_text(source)
        return f"{name}_of_{tmp_path.name}"

    return write


def test_a_callee_may_be_compiled_elsewhere(module_of, backend):
    """The two would have to say the same; here they do not, to see which one runs."""
    name = module_of("apart", APART.replace("FACTOR * x", "FACTOR * x + 100.0"))
    expected = {"numba": 206.0, "python": 6.0}
    assert compiled.Kernel(doubled_elsewhere(name))(np.array([1.0, 2.0])) == expected[backend]


@pytest.mark.parametrize(
    "edit",
    [
        ("FACTOR = 2.0", "FACTOR = 3.0"),
        ("return 1", "return 2"),
        ("return FACTOR * x", "return x * FACTOR"),
    ],
    ids=["number", "function that no kernel names", "code"],
)
def test_an_edit_anywhere_in_the_module_elsewhere_changes_the_digest(edit, module_of):
    first = compiled.digest(doubled_elsewhere(module_of("apart", APART)))
    assert compiled.digest(doubled_elsewhere(module_of("again", APART))) == first
    assert compiled.digest(doubled_elsewhere(module_of("edited", APART.replace(*edit)))) != first


def rounded_twice(x, y):
    return x * x - y


def test_products_are_rounded_before_they_are_added(backend):
    """A fused or reordered operation would leave the product's rounding error."""
    x = 1.0 + 2.0**-30
    assert compiled.Kernel(rounded_twice)(x, x * x) == 0.0


EDITS = {
    "constant of a callee": ("SCALE = 2.0", "SCALE = 5.0"),
    "code of a callee": ("return x * SCALE", "return x * SCALE + 1.0"),
    "callee of a callee": ("return 1.0", "return 2.0"),
    "enumeration": ("ONE = 1", "ONE = 4"),
}
CALLEE = textwrap.dedent("""
    from enum import IntEnum

    SCALE = 2.0

    class Code(IntEnum):
        ONE = 1

    def offset():
        return 1.0

    def callee(x):
        return x * SCALE + offset() * (2.0 if Code.ONE == 1 else 3.0)
""")
CALLER = textwrap.dedent("""
    import numpy as np
    from callee{number} import callee
    from plumbob.reference.backend.compiled import Kernel

    def caller(values):
        return callee(values[0])

    run = Kernel(caller)
    x = np.full(3, 10.0)
    print(run(x), run.plain(x), len(run.compiled.stats.cache_hits))
""")


def run_in_fresh_process(folder):
    """Run every caller; return their values and cache hits."""
    imports = "; ".join(f"import caller{i}" for i in range(len(EDITS)))
    command = [sys.executable, "-B", "-c", imports]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True)
    lines = [line.split() for line in done.stdout.splitlines()]
    assert all(compiled_value == plain_value for compiled_value, plain_value, _ in lines)
    return [float(value) for value, *_ in lines], [int(hits) for *_, hits in lines]


def test_the_cache_on_disk_is_used_but_never_stale(tmp_path):
    """Every edit changes a file that numba's own key for its caller does not see."""
    count = len(EDITS)
    for i in range(count):
        (tmp_path / f"caller{i}.py").write_text(CALLER.replace("{number}", str(i)))
        (tmp_path / f"callee{i}.py").write_text(CALLEE)
    first, _ = run_in_fresh_process(tmp_path)
    for i, edit in enumerate(EDITS.values()):
        (tmp_path / f"callee{i}.py").write_text(CALLEE.replace(*edit))
    values, hits = run_in_fresh_process(tmp_path)
    assert all(value != before for value, before in zip(values, first, strict=True))
    assert hits == [0] * count
    for i in range(count):
        (tmp_path / f"callee{i}.py").write_text(CALLEE)
    assert run_in_fresh_process(tmp_path) == (first, [1] * count)


def test_a_specialised_kernel_takes_arrays_that_convert_and_refuses_others(backend):
    kernel = compiled.Kernel(total).specialise(arguments.frozen(np.arange(2.0)))
    for values in (np.arange(3.0), arguments.frozen(np.arange(3.0))):
        assert kernel(values) == FACTOR * 5.0
    for values in (np.arange(3), np.arange(6.0)[::2]) if backend == "numba" else ():
        with pytest.raises(TypeError, match="No matching definition"):
            kernel(values)


def test_with_numbas_compiler_off_the_interpreter_runs_every_kernel(monkeypatch):
    """As numba's own functions do under NUMBA_DISABLE_JIT."""
    monkeypatch.setattr("numba.core.config.DISABLE_JIT", 1)
    compiled.compile_kernel.cache_clear()
    kernel = compiled.Kernel(total)
    assert kernel(np.arange(4.0)) == 3.0 * (1 + 4 + 9)
    assert kernel.compiled is total
    monkeypatch.undo()
    compiled.compile_kernel.cache_clear()
    assert compiled.Kernel(total).compiled is not total


def counted(n):
    values = np.zeros(n)
    for _ in range(n):
        for i in range(n):
            values[i] += values[i - 1]
    return values, values[:1].copy()


def test_a_signal_during_a_kernel_is_what_its_handler_raises():
    """Where numba makes a tuple of arrays of the result, it is the cause of a SystemError."""
    kernel = compiled.Kernel(counted)
    kernel(1)
    threading.Timer(0.05, signal.raise_signal, [signal.SIGINT]).start()
    with pytest.raises(KeyboardInterrupt):
        kernel(20_000)
