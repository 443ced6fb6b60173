"""What is told of a compilation, and what is compiled."""

import gc

import numba
import pytest
from numba.core.errors import TypingError

from plumbob.reference.backend import compiled, linking
from plumbob.reference.backend.compilation import on_compile


def power(x, n):
    result = 1.0
    for _ in range(n):
        result *= x
    return result


def polynomial(x):
    return power(x, 2) + power(x, 3) + power(x, int(x))


def fresh(kernel):
    """A kernel of the same source that nobody has compiled in this process, and uncached."""
    return compiled.rebuilt(kernel, power=compiled.rebuilt(power, range=range))


@pytest.fixture(autouse=True)
def empty_cache(tmp_path, monkeypatch):
    from numba.core import config

    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path))


def test_a_listener_hears_of_the_first_call_only():
    heard, kernel = [], compiled.Kernel(fresh(polynomial), label="a polynomial")
    with on_compile(lambda *told: heard.append(told)):
        assert kernel(2.0) == 16.0
        assert kernel(2.0) == 16.0
    assert heard == [("a polynomial", True), ("a polynomial", False)]


def test_nobody_hears_after_the_block_or_of_the_interpreter():
    heard = []
    with on_compile(lambda *told: heard.append(told)), compiled.set_backend("python"):
        compiled.Kernel(fresh(polynomial))(2.0)
    compiled.Kernel(fresh(polynomial))(2.0)
    assert heard == []


def test_the_garbage_collector_rests_while_compiling():
    seen = []
    with on_compile(lambda _, begins: seen.append((begins, gc.isenabled()))):
        compiled.Kernel(fresh(polynomial))(2.0)
    assert seen == [(True, False), (False, True)]


def test_the_collector_works_again_after_a_kernel_that_cannot_be_compiled():
    with pytest.raises(TypingError):
        compiled.Kernel(fresh(polynomial))("two")
    assert gc.isenabled()


def callee_of(kernel, inlined_size=compiled.INLINED_SIZE):
    dispatcher = compiled.Kernel(kernel, inlined_size=inlined_size).compiled
    dispatcher(2.0)
    return dispatcher.py_func.__globals__["power"]


def test_this_numba_is_of_a_series_that_the_linker_is_tested_with():
    """After an update of numba: run all tests of the backend, and raise `linking.NEWEST`."""
    assert linking.OLDEST == (0, 61)  # the lowest that pyproject.toml allows
    assert linking.is_supported()


@pytest.mark.parametrize("version", ["0.60.3", "0.99.0", "1.2.0rc1"])
def test_another_numba_compiles_as_ever(version, monkeypatch):
    monkeypatch.setattr(numba, "__version__", version)
    kernel = fresh(polynomial)
    assert compiled.compile_kernel(kernel)(2.0) == polynomial(2.0)
    (result, *_) = callee_of(kernel).overloads.values()
    assert not isinstance(result.library, linking.LinkedLibrary)


@pytest.mark.parametrize(("size", "inlined"), [(10**6, True), (0, False)])
def test_a_large_callee_in_several_places_is_not_copied(size, inlined):
    assert callee_of(fresh(polynomial), size).targetoptions["forceinline"] == inlined
