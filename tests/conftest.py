"""Fixtures that several rooms share."""

import importlib.util
import os
import signal
from pathlib import Path

import numpy as np
import pytest
from hypothesis import settings

from plumbob.reference.backend import compiled

# What is printed must not depend on the terminal of whoever runs the tests.
os.environ.pop("COLUMNS", None)

# The first example of a law may compile a kernel: no deadline.
settings.register_profile("plumbob", max_examples=20, deadline=None, derandomize=True)
settings.load_profile("plumbob")


@pytest.fixture(scope="session", autouse=True)
def interruptible():
    """Let Ctrl-C reach what the tests start, though a job in the background ignores it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture(params=compiled.BACKENDS)
def backend(request):
    """Run the test once by numba and once in the interpreter; yields the backend's name."""
    with compiled.set_backend(request.param):
        yield request.param


@pytest.fixture
def rng():
    """A generator of the same random numbers in every run."""
    return np.random.default_rng(20130)


@pytest.fixture(scope="session")
def extended_precision():
    """Return the module of that name; there is no package to import it from."""
    path = Path(__file__).with_name("reference") / "extended_precision.py"
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


# Long tests of the bench, by their names, until they carry their own marks.
LONG = (
    "test_branches.py::test_missing_and_false_solutions_are_counted",
    "test_cloth_peers.py::test_a_motion_has_diverged_if_one_particle_is_ever_too_far",
    "test_cloth_peers.py::test_the_converged_step_is_that_of_another_solver",
    "test_cloth_peers.py::test_the_error_of_a_step_is_zero_at_the_answer",
    "test_cloth_peers.py::test_the_truth_is_of_order_four",
    "test_cloth_peers.py::test_the_truth_is_that_of_another_engines_runge_kutta",
    "test_dask.py::test_a_worker_killed_in_the_middle_costs_no_row_and_doubles_none",
    "test_dask.py::test_two_workers_give_the_same_tables",
    "test_user_solvers.py::test_a_changed_file_is_measured_again_and_a_part_forgets_nothing",
    "test_user_solvers.py::test_a_cloth_solver_of_fifteen_lines_stands_in_tables_and_figures",
    "test_user_solvers.py::test_a_dry_run_measures_nothing",
    "test_user_solvers.py::test_a_robot_solver_is_run_with_one_start_and_with_restarts",
    "test_user_solvers.py::test_problems_of_a_python_file_stand",
    "test_figures.py::test_no_legend_covers_the_data[20]",
    "test_hostile_solvers.py::test_times_far_below_what_was_computed_are_not_ranked",
    "test_isolation.py::test_exceptions_are_counted_apart_from_missing_answers[hangs",
    "test_labels.py::test_no_labels_overlap",
    "test_rerun.py::test_a_full_disk_leaves_nothing[files",
    "test_rerun.py::test_a_rerun_beside_another_one_leaves_its_files",
    "test_rerun.py::test_a_signal_leaves_no_worktree_no_file_and_no_process[2",
    "test_rerun.py::test_a_solver_of_another_project_is_measured",
    "test_run.py::test_kills_at_random_moments_lose_nothing_finished_and_repeat_nothing",
    "test_show.py::test_a_still_shows_the_whole_curve_by_each_solver_and_what_its_colours_mean",
    "test_show.py::test_the_cloth_by_your_steps_is_as_far_off_as_it_is",
    "test_tuning.py::test_an_interrupted_search_goes_on_and_wrong_settings_solve_nothing",
    "test_verify_command.py::test_full_disk_behind_the_screen_costs_no_file[right.py",
    "test_verify_command.py::test_full_disk_behind_the_screen_costs_no_file[wrong",
    "test_verify_command.py::test_letters_that_a_terminal_lacks_cost_no_output",
)
SAMPLED = {
    "test_worker_death.py::test_a_death_at_any_moment_is_a_sentence_and_costs_no_other_job": 5,
    "test_worker_death.py::test_a_death_before_the_job_is_read_is_a_sentence": 4,
    "test_show.py::test_what_is_wrong_with_a_solver_is_said_in_a_sentence": 2,
    "test_show.py::test_both_are_drawn_in_every_form": 2,
    "test_user_solvers.py::test_a_broken_solver_loses_its_own_rows_only_and_says_why": 2,
    "test_worker_death.py::test_a_death_after_the_last_message_costs_nothing": 2,
}


def quick_names(names, every, without=()):
    """Return each name of so many, of the names without some texts."""
    return [name for name in names if not any(text in name for text in without)][::every]


def pytest_generate_tests(metafunc):
    """Make the cases of a sweep: all of them for the slow tests, else only the quick ones."""
    for mark in metafunc.definition.iter_markers("sweep"):
        argument, names = mark.args[0], list(mark.args[1]())
        quick = quick_names(names, **mark.kwargs)
        if metafunc.config.option.markexpr == "not slow":
            names = quick
        slow = dict.fromkeys(set(names) - set(quick), pytest.mark.slow)
        metafunc.parametrize(argument, [pytest.param(n, marks=slow.get(n, ())) for n in names])


def cases_of(items):
    """Return the cases of each test that are not slow, with the test's mark `sample`."""
    cases = {}
    for item in items:
        mark = item.get_closest_marker("sample")
        if mark and not item.get_closest_marker("slow"):
            cases.setdefault(item.nodeid.partition("[")[0], (mark, []))[1].append(item)
    return cases.values()


def has(item, texts):
    """Whether a text stands in the name of a case."""
    return any(text in item.callspec.id for text in texts)


def sampled(cases, *texts, without=(), every=1):
    """Return the cases that the mark `sample` leaves to the default run; some there have to be."""
    absent = [text for text in (*texts, *without) if not any(has(item, [text]) for item in cases)]
    if absent and len(cases) > 1:
        raise pytest.UsageError(f"{cases[0].nodeid}: sample: no case has the name {absent[0]!r}")
    chosen = [item for item in cases if has(item, texts or [""]) and not has(item, without)]
    if not chosen and len(cases) > 1:
        raise pytest.UsageError(f"{cases[0].nodeid}: sample: no case is left")
    return chosen[::every]


def is_plain(item):
    """Whether a test runs in the interpreter what another file of its kernels runs there too."""
    case = getattr(item, "callspec", None)
    is_python = case is not None and case.params.get("backend") == "python"
    return is_python and not item.get_closest_marker("both_backends")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config, items):
    """Mark as slow what the marks of tests leave to the heavy sweep."""
    for item in filter(is_plain, items):
        item.add_marker(pytest.mark.slow)
    for mark, cases in cases_of(items):
        for item in set(cases) - set(sampled(cases, *mark.args, **mark.kwargs)):
            item.add_marker(pytest.mark.slow)
    for name, stride in SAMPLED.items():
        quick = [i for i in items if name in i.nodeid and not i.get_closest_marker("slow")]
        for item in set(quick) - set(quick[::stride]):
            item.add_marker(pytest.mark.slow)
    absent = set(LONG)
    for item in items:
        if names := {name for name in LONG if name in item.nodeid}:
            item.add_marker(pytest.mark.slow)
            absent -= names
    if absent and config.args == config.getini("testpaths"):
        raise pytest.UsageError(f"LONG: no test has the name {min(absent)}")
