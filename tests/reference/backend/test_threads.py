import gc
import signal
import threading

import numpy as np
import pytest

from plumbob.reference import set_num_threads
from plumbob.reference.backend import compiled
from plumbob.reference.backend import threads as parallel
from plumbob.reference.backend.threads import SLICES_PER_CORE, in_slices

CORES = [1, 2, 3]


def slices_of(count, minimum):
    return in_slices(lambda part: part, count, lambda part: (part,), minimum=minimum)


def total(values):
    s = 0.0
    for value in values:
        s += value
    return s


@pytest.mark.parametrize("many", CORES)
@pytest.mark.parametrize("count", [0, 1, 7, 100, 101])
def test_slices_follow_one_another_from_end_to_end(many, count):
    with set_num_threads(many):
        parts = slices_of(count, minimum=5)
    covered = [i for part in parts for i in range(part.start, part.stop)]
    assert covered == list(range(count))
    assert len(parts) <= max(1, SLICES_PER_CORE * many, count // 5)


def test_slices_are_as_many_as_the_cores_want_and_no_shorter_than_worth_while():
    with set_num_threads(2):
        assert len(slices_of(1000, minimum=10)) == 2 * SLICES_PER_CORE
        assert len(slices_of(35, minimum=10)) == 3
        assert len(slices_of(19, minimum=10)) == 1
    with set_num_threads(1):
        assert len(slices_of(1000, minimum=10)) == 1


def test_threads_are_kept_and_only_used_for_more_than_one_slice():
    def who():
        return threading.get_ident()

    with set_num_threads(2):
        several = set(in_slices(who, 100, lambda part: (), minimum=1))
        again = set(in_slices(who, 100, lambda part: (), minimum=1))
        (single,) = in_slices(who, 100, lambda part: (), minimum=100)
    assert single == who()
    assert len(several | again) <= 2
    assert single not in several | again


def test_threads_run_at_the_speed_in_force():
    kernel = compiled.Kernel(total)
    with set_num_threads(2), compiled.set_backend("python"):
        in_slices(kernel, 100, lambda part: (np.ones(3),), minimum=1)
    assert "compiled" not in vars(kernel)


def test_an_error_in_one_slice_is_the_caller_s():
    def fail(part):
        if part.start == 50:
            raise ZeroDivisionError("in the middle")

    with set_num_threads(2), pytest.raises(ZeroDivisionError, match="in the middle"):
        in_slices(fail, 100, lambda part: (part,), minimum=10)


def test_an_interrupt_reaches_the_caller_and_drops_what_has_not_begun(request):
    gc.disable()  # Hypothesis has a callback there, which would swallow the interrupt
    request.addfinalizer(gc.enable)
    begun, go_on = [], threading.Event()

    def wait(part):
        begun.append(part.start)
        if len(begun) == 2:
            signal.pthread_kill(threading.main_thread().ident, signal.SIGINT)
        assert go_on.wait(60)

    with set_num_threads(2), pytest.raises(KeyboardInterrupt):
        in_slices(wait, 100, lambda part: (part,), minimum=1)
    go_on.set()
    with set_num_threads(2):  # all that was begun is over when the same threads have done this
        in_slices(lambda: None, 100, lambda part: (), minimum=1)
    assert len(begun) == 2


def test_the_count_in_force_ends_with_its_block():
    with set_num_threads(2), set_num_threads(1):
        pass
    with set_num_threads(1):
        with set_num_threads(2):
            assert len(slices_of(100, minimum=1)) == 2 * SLICES_PER_CORE
        assert len(slices_of(100, minimum=1)) == 1
        with set_num_threads(None):
            assert len(slices_of(100, minimum=1)) == slices_wanted()


def slices_wanted():
    many = parallel._all_cores()
    return 1 if many == 1 else SLICES_PER_CORE * many
