"""Fixtures that several rooms share."""

import importlib.util
import os
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


# Tests of ten seconds and more on two cores, left to the slow sweep; others show the same in less.
LONG = (
    "test_dask.py::test_two_workers_give_the_same_tables",
    "test_rerun.py::test_a_solver_of_another_project_is_measured",
    "test_entrants.py::test_problems_of_a_python_file_stand",
    "test_entrants.py::test_a_dry_run_measures_nothing",
    "test_labels.py::test_no_labels_overlap_on_the_page[1440]",
    "test_branches.py::test_missing_and_false_solutions_are_counted",
    "test_figures.py::test_no_legend_covers_the_data[20]",
    "test_cloth_peers.py::test_the_truth_is_of_order_four",
    "test_inference.py::test_an_undeclared_restriction_is_inferred_and_its_field_is_named[one",
    "test_inference.py::test_an_undeclared_restriction_is_inferred_and_its_field_is_named[no p",
    "test_inference.py::test_inference_hides_no_fault[mass_spring_step",
    "test_precision.py::test_answers_of_inputs_in_single_precision_are_judged_so",
    "test_naming.py::test_right_program_is_not_accused[javascript]",
    "test_kinematics.py::test_pair_is_named[ccd",
    "test_kinematics.py::test_fault_is_named_without_a_declared_method",
    "test_robot_track.py::test_a_fault_is_named_by_its_code[error",
    "test_robot_track.py::test_a_fault_is_named_by_its_code[linear",
    "test_robot_track.py::test_a_fault_is_named_by_its_code[rotation",
    "test_robot_track.py::test_a_fault_is_named_by_its_code[another",
    "test_robot_track.py::test_a_fault_is_named_by_its_code[trans",
)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Mark long tests as slow."""
    for item in items:
        if any(name in item.nodeid for name in LONG):
            item.add_marker(pytest.mark.slow)
