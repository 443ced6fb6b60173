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


# Tests of ten seconds and more on two cores, left to the slow sweep; others show the same in less.
LONG = (
    # The same laws run on the compiled backend.
    "test_restart_laws.py::test_the_chosen_attempt_is_that_of_least_merit[python-",
    "test_task_jacobian.py::test_arms_that_move_in_a_plane_reach_what_lies_in_it_exactly[python-",
    "test_restarts.py::test_one_restart_from_the_very_answer_arrives[jacobian_transpose-python",
    "test_restarts.py::test_one_restart_from_the_very_answer_arrives[fabrik-python",
    "test_restarts.py::test_one_restart_from_the_very_answer_arrives[damped_least_squares-python",
    "test_effectors.py::test_targets_in_another_order_give_the_same_answer[fabrik-python",
    "test_effectors.py::test_targets_in_another_order_give_the_same_answer[jacobian_transpose-python",
    "test_effectors.py::test_targets_in_another_order_give_the_same_answer[damped_least_squares-pyt",
    "test_mechanisms.py::test_another_unit_of_length_changes_nothing[jacobian_transpose-python",
    "test_mechanisms.py::test_another_unit_of_length_changes_nothing[fabrik-python",
    "test_mechanisms.py::test_another_unit_of_length_changes_nothing[damped_least_squares-python",
    "test_draw_gallery.py::test_a_famous_fault_shows_beside_the_right_solver[curves",
    "test_dask.py::test_two_workers_give_the_same_tables",
    "test_rerun.py::test_a_solver_of_another_project_is_measured",
    "test_entrants.py::test_problems_of_a_python_file_stand",
    "test_entrants.py::test_a_dry_run_measures_nothing",
    "test_branches.py::test_missing_and_false_solutions_are_counted",
    "test_figures.py::test_no_legend_covers_the_data[20]",
    "test_cloth_peers.py::test_the_truth_is_of_order_four",
    "test_case_kinds.py::test_a_right_arm_is_right[robot_inverse",
    "test_case_kinds.py::test_a_right_arm_is_right[robot_track",
    "test_case_kinds.py::test_coordinates_beyond_pi_are_asked[robot_inverse",
    "test_case_kinds.py::test_coordinates_beyond_pi_are_asked[robot_jacobian-s",
    "test_case_kinds.py::test_coordinates_beyond_pi_are_asked[robot_track",
    "test_case_kinds.py::test_rotations_the_long_way_round_are_asked[w",
    "test_case_kinds.py::test_coordinates_beyond_pi_are_asked[robot_jacobian-all",
    "test_case_kinds.py::test_slides_along_oblique_axes_are_asked[robot_jacobian",
    "test_declared_steps.py::test_a_wrong_velocity_is_named_whatever_the_iterations_leave[False-100",
    "test_fault_codes.py::test_a_known_mistake_of_a_step_stands_beside_the_right_numbers[PB-STEP-120",
    "test_case_kinds.py::test_slides_along_oblique_axes_are_asked[robot_inverse",
    "test_case_kinds.py::test_zeros_and_both_signs_of_a_stretch_are_asked[energy",
    "test_case_kinds.py::test_zeros_and_both_signs_of_a_stretch_are_asked[mass_spring_motion",
    "test_case_kinds.py::test_zeros_and_both_signs_of_a_stretch_are_asked[mass_spring_step-",
    "test_constants.py::test_a_constant_gravity_is_asked_about_and_right_if_declared[forces, ",
    "test_constants.py::test_a_constant_gravity_is_asked_about_and_right_if_declared[step, ",
    "test_constants.py::test_a_constant_gravity_is_asked_about_and_right_if_declared[total",
    "test_constants.py::test_a_wrong_solver_with_constants_is_wrong[declared0-wrong1",
    "test_constants.py::test_a_wrong_track_with_constants_is_wrong[",
    "test_constants.py::test_declared_constants_are_no_assumption[fabrik",
    "test_constants.py::test_tracks_with_a_constant_tolerance[fabrik",
    "test_declared_steps.py::test_a_declared_method_that_is_kept_is_right[converged",
    "test_declared_steps.py::test_a_declared_method_that_is_kept_is_right[linearised, ",
    "test_declared_steps.py::test_a_declared_method_that_is_kept_is_right[t",
    "test_declared_steps.py::test_a_wrong_velocity_is_named_whatever_the_iterations_leave[False-1]",
    "test_declared_steps.py::test_a_wrong_velocity_is_named_whatever_the_iterations_leave[True",
    "test_declared_steps.py::test_heavy_pins_of_any_mass_are_right_if_declared[1000",
    "test_declared_steps.py::test_pins_that_are_not_heavy_are_wrong[2.0",
    "test_inference.py::test_an_undeclared_restriction_is_inferred_and_its_field_is_named[one",
    "test_inference.py::test_an_undeclared_restriction_is_inferred_and_its_field_is_named[no p",
    "test_inference.py::test_inference_hides_no_fault[mass_spring_step",
    "test_precision.py::test_answers_of_inputs_in_single_precision_are_judged_so",
    "test_naming.py::test_right_program_is_not_accused[javascript]",
    "test_kinematics.py::test_pair_is_named[ccd",
    "test_kinematics.py::test_fault_is_named_without_a_declared_method",
    "test_readme.py::test_the_blocks_of_a_page_are_one_program_that_prints_what_it_says[show]",
    "test_inference.py::test_an_undeclared_restriction_is_inferred_and_its_field_is_named[points",
    "test_inference.py::test_inference_hides_no_fault[mass_spring_forces-<lambda>1",
    "test_inference.py::test_an_inferred_step_is_declared_as_the_report_says[linearised",
    "test_show.py::test_the_cloth_by_your_steps_is_as_far_off_as_it_is",
    "test_daemons.py::test_no_command_leaves_a_daemon[bench",
    "test_daemons.py::test_no_command_leaves_a_daemon[verify --",
    "test_disk_cache.py::test_a_cache_that_names_a_class_that_has_moved_is_renewed",
    "test_disk_cache.py::test_a_kernel_runs_where_nothing_can_be_saved",
    "test_verify_command.py::test_full_disk_behind_the_screen_costs_no_file[wrong",
    "test_verify_command.py::test_letters_that_a_terminal_lacks_cost_no_output",
    "test_kinematics.py::test_sixty_faults_and_their_likely_triples_are_known",
    "test_kinematics.py::test_undeclared_reference_is_not_accused[levenberg",
    "test_kinematics.py::test_forward_fault_is_named_by_positions",
    "test_rerun.py::test_a_signal_leaves_no_worktree_no_file_and_no_process[2",
    "test_rerun.py::test_a_rerun_beside_another_one_leaves_its_files",
    "test_rerun.py::test_a_full_disk_leaves_nothing[files",
    "test_labels.py::test_no_labels_overlap",
    "test_draw_gallery.py::test_a_famous_fault_shows_beside_the_right_solver[cloths",
    "test_draw_gallery.py::test_the_gallery_has_pictures_and_films",
    "is_right[robots, position error reversed]",
    "test_every_fault_passes_every_writer[robots, position error reversed]",
    "test_cloth_peers.py::test_the_converged_step_is_that_of_another_solver",
    "test_robots_judged.py::test_a_claim_that_is_not_so_is_seen_beyond_reach",
    "test_robot_jacobian.py::test_conventions_are_not_to_change_between_answers",
    "test_inference.py::test_inference_hides_no_fault[mass_spring_forces-<lambda>2",
    "test_mass_spring.py::test_faults_at_once_are_named[('gravity doubled', 'matrix",
    "test_degenerate.py::test_zero_quaternion_is_broken_and_named",
    "test_degenerate.py::test_guard_is_named_for_unknown_methods_too[]",
    "test_fault_codes.py::test_a_code_in_small_letters_is_explained_with_lines_and_a_failing_case[zh",
    "test_tuning.py::test_an_interrupted_search_goes_on_and_a_lost_process_solves_nothing",
    "test_naming.py::test_right_program_is_not_accused[python",
    "test_front_door.py::test_a_module_of_the_same_name_where_one_works_is_left_alone",
    "test_cloth_peers.py::test_the_truth_is_that_of_another_engines_runge_kutta",
    "test_files.py::test_a_call_that_crashes_or_hangs_is_lost_and_the_next_one_is_not",
    "test_dask.py::test_a_worker_killed_in_the_middle_costs_no_row_and_doubles_none",
    "test_readme.py::test_the_solver_of_the_readme_is_right_and_is_said_to_be",
    "[robots, damping too large]",
    "[CCD, world rotation on the left]",
    "test_every_fault_passes_every_writer[FABRIK, backward pass ends early]",
    "test_daemons.py::test_no_command_leaves_a_daemon[verify {file}",
    "test_mass_spring.py::test_what_is_left_of_a_failed_factorisation_is_named_by_its_pattern",
    "test_cloth_peers.py::test_the_error_of_a_step_is_zero_at_the_answer",
    "test_fault_codes.py::test_a_wrong_program_is_named_by_its_code[PB-CCD-055",
    "test_fault_codes.py::test_a_right_program_is_right[step",
    "test_hostile_programs.py::test_each_has_its_sentence_and_the_next_case_works[a format",
    "test_inference.py::test_a_program_in_floats_without_branches_and_nothing_else_written",
    "test_naming.py::test_right_program_is_not_accused[cpp",
    "test_mass_spring.py::test_an_honest_step_is_not_accused[global",
    "test_mass_spring.py::test_an_honest_step_is_not_accused[from s_n",
    "test_robot_jacobian.py::test_an_unknown_mistake_is_wrong_but_has_no_name",
    "test_kinematics.py::test_jump_breaks_continuity",
    "test_kinematics.py::test_pair_is_named[fabrik-pairs2",
    "test_isolation.py::test_exceptions_are_counted_apart_from_missing_answers[hangs",
    "[CCD, sign of a.z b.w in z of a product]",
    "[FABRIK, sign of a.w b.x in x of a product]",
    "test_robot_jacobian.py::test_numbers_are_finite_and_single_precision_is_enough",
    "test_robot_jacobian.py::test_a_transposed_jacobian_has_another_shape",
    "test_precision.py::test_one_answer_of_few_digits_excuses_nothing[inverse",
    "accused_of_no_combination[-<lambda>-are the identity",
    "test_files.py::test_a_call_that_waits_for_the_processor_is_not_lost",
    "[FABRIK, previous link's length]",
    "test_cloth_peers.py::test_a_motion_has_diverged_if_one_particle_is_ever_too_far",
    "test_known_forward_faults.py::test_solver_that_only_stands_on_wrong_forward_kinematics_is_said_to[base5",
    "test_degenerate.py::test_a_straight_chain_is_freed_from_a_target_on_its_own_line[ccd--3.0-ball-axis",
    "test_degenerate.py::test_a_straight_chain_is_freed_from_a_target_on_its_own_line[jacobian_t",
    "test_mass_spring.py::test_of_a_step_that_is_unknown_the_nearest_and_what_holds_are_told",
    "test_inference.py::test_an_undeclared_restriction_is_inferred_and_its_field_is_named[last",
    "test_limits.py::test_targets_that_another_mistake_misses_tell_nothing_about_limits",
    "test_mass_spring.py::test_faults_of_a_solver_that_declares_nothing_are_named[one iteration",
    "test_known_forward_faults.py::test_solver_that_only_stands_on_wrong_forward_kinematics_is_said_to[base15",
    "test_known_forward_faults.py::test_fault_on_top_of_wrong_forward_kinematics_is_named[base1",
    "test_kinematics.py::test_pair_is_named[forward-pairs0",
    "test_kinematics.py::test_solver_that_continues_to_the_target_has_a_reservation",
    "test_kinematics.py::test_a_part_of_the_way_to_each_target_is_told[False-0.5",
    "test_kinematics.py::test_helper_that_drops_small_rotations_stalls",
    "test_one_line.py::test_answers_that_repeat_the_request_tell_nothing[0.0",
    "test_robot_track.py::test_a_fault_is_named_by_its_code[limits ignored",
    "test_robot_jacobian.py::test_a_fault_is_named_in_another_convention",
    "test_anderson.py::test_no_sweep_raises_the_error[balls-numba",
    "test_run.py::test_kills_at_random_moments_lose_nothing_finished_and_repeat_nothing",
    "test_entrants.py::test_a_cloth_solver_of_fifteen_lines_stands_in_tables_and_figures",
    "test_fault_codes.py::test_a_program_whose_answers_are_no_numbers_is_explained",
    "test_mass_spring.py::test_one_iteration_is_not_taken_for_convergence",
    "test_user_files.py::test_a_file_without_end_is_refused_in_a_sentence[verify solver.py --rerun",
    "test_disk_cache.py::test_damaged_files_are_compiled_anew_and_whole_ones_used",
    "test_fault_codes.py::test_a_mistake_that_few_answers_show_is_named_by_its_code[PB-STEP-080",
    "test_entrants.py::test_a_changed_file_is_measured_again_and_a_part_forgets_nothing",
    "test_verify_command.py::test_full_disk_behind_the_screen_costs_no_file[right.py",
    "test_hostile_programs.py::test_each_has_its_sentence_and_the_next_case_works[closes all",
    "test_hostile_programs.py::test_each_has_its_sentence_and_the_next_case_works[forks and ends",
    "test_shared_quaternions.py::test_a_fault_of_fabrik_is_named_by_another_rule[other lengths",
    "test_command_line.py::test_variables_of_numba_cost_no_traceback[no compiler, check",
    "test_show.py::test_a_still_shows_the_whole_curve_by_each_solver_and_what_its_colours_mean",
    "test_files.py::test_a_file_that_crashes_an_engine_loses_only_that_reading",
    "test_hostile_entrants.py::test_times_far_below_what_was_computed_are_not_ranked",
    "test_entrants.py::test_a_robot_solver_is_run_with_one_start_and_with_restarts",
    "test_fault_codes.py::test_a_mistake_that_few_answers_show_is_named_by_its_code[PB-STEP-082",
    "test_shared_quaternions.py::test_a_fault_of_fabrik_is_named_by_another_rule[ratio upside down",
)
# Tests whose cases take seconds each: the default run takes one case of so many.
SAMPLED = {
    "test_worker_death.py::test_a_death_at_any_moment_is_a_sentence_and_costs_no_other_job": 5,
    "test_worker_death.py::test_a_death_before_the_job_is_read_is_a_sentence": 4,
    "test_show.py::test_what_is_wrong_with_a_solver_is_said_in_a_sentence": 2,
    "test_show.py::test_both_are_drawn_in_every_form": 2,
    "test_hostile_programs.py::test_each_has_its_sentence_and_the_next_case_works": 2,
    "test_entrants.py::test_a_broken_solver_loses_its_own_rows_only_and_says_why": 2,
    "test_doors_python.py::test_a_process_survives_or_is_started_anew": 2,
    "test_linear_time.py::test_a_reader_takes_time_in_proportion_to_the_size_of_a_text": 2,
    "test_worker_death.py::test_a_death_after_the_last_message_costs_nothing": 2,
    "test_entry_point.py::test_a_closed_stream_costs_what_is_printed_there": 2,
    "test_command_line.py::test_variables_of_numba_cost_no_traceback": 2,
    "test_kinematics.py::test_law_of_inverse_kinematics_catches_a_lie": 2,
    "test_kinematics.py::test_fault_of_tracking_is_caught_and_named": 2,
    "test_kinematics.py::test_honest_variant_is_not_accused": 2,
    "test_robot_velocity.py::test_a_fault_is_named_by_its_code": 2,
    "test_robot_track.py::test_a_fault_is_named_by_its_code": 5,
    "test_robot_jacobian.py::test_a_fault_is_named_by_its_code": 5,
    "test_fault_codes.py::test_a_wrong_program_is_named_by_its_code": 6,
    "test_fault_codes.py::test_a_right_program_is_right": 5,
    "test_shared_quaternions.py::test_a_fault_of_fabrik_is_named_by_another_rule": 3,
    "test_shared_quaternions.py::test_a_fault_of_quaternions_is_named_in_every_grouping": 3,
    "test_one_line.py::test_answers_that_repeat_the_request_tell_nothing": 2,
    "test_kinematics.py::test_fault_of_resampling_is_caught_and_named": 5,
    "test_kinematics.py::test_inferred_behaviour_does_not_contradict_findings": 2,
    "test_kinematics.py::test_honest_fault_is_named_and_right": 4,
    "test_degenerate.py::test_solver_without_guards_is_right_except_in_degenerate_cases": 4,
    "test_robots_judged.py::test_a_fault_breaks_a_law_and_is_named": 3,
    "test_inference.py::test_a_solver_that_writes_no_result_is_told_so": 3,
    "test_naming.py::test_a_planted_fault_is_named": 3,
    "test_known_forward_faults.py::test_solver_that_only_stands_on_wrong": 2,
    "test_precision.py::test_a_right_solver_is_right_to_the_digits_that_it_prints": 2,
    "test_precision.py::test_a_wrong_solver_stays_wrong_and_its_fault_is_named": 2,
    "test_self_test.py::test_fault_is_caught_and_named_and_honest_solver_is_right": 6,
}


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config, items):
    """Mark long tests as slow; a name that no test has is an error where all are collected."""
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
