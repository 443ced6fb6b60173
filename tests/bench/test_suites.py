"""Suites: what they measure adds up."""

import itertools
from functools import partial

import extended_precision
import numpy as np
import pytest

from plumbob.bench.experiments import SUITES, Scale, blocks, cloth
from plumbob.bench.experiments.cloth import ONE_STEP, convergence
from plumbob.bench.measure.block import Block
from plumbob.bench.measure.machine import stamp
from plumbob.bench.measure.measure import measure
from plumbob.bench.measure.record import Record, decode, encode, key
from plumbob.bench.measure.run import now
from plumbob.bench.problems.cloth_swing import cloth_swing
from plumbob.bench.tables.results import Results
from plumbob.bench.tables.writers import markdown
from plumbob.reference import ImplicitEuler

TINY = Scale(targets=3, seconds=0.001)


def found(suite, problem, solver, **settings):
    """The one block of a suite with this problem, solver and settings."""
    (block,) = [
        b
        for b in blocks(suite, TINY)
        if (b.problem, b.solver) == (problem, solver)
        and settings.items() <= dict(b.settings).items()
    ]
    return block


@pytest.mark.parametrize("suite", SUITES)
def test_no_two_blocks_have_the_same_key_and_every_one_can_be_read_again(suite):
    keys = [key(b.suite, b.problem, b.solver, b.settings) for b in blocks(suite, TINY)]
    assert len(keys) == len(set(keys)) > 0
    assert {name for name, *_ in keys} == {suite}
    for b, known in zip(blocks(suite, TINY), keys, strict=True):
        about = {"stamp": stamp(), "when": now()}
        made = Record(b.suite, b.problem, b.solver, b.settings, b.facts, b.size, **about)
        back = decode(encode(made))
        assert back.key == made.key == known
        assert back.stamp == made.stamp


@pytest.mark.parametrize("solver", ["ccd", "fabrik"])
def test_the_arm_draws_within_tolerance_cold_and_warm(solver):
    for warm in (False, True):
        block = found("arm", "arm/triangle", solver, warm=warm)
        arrays = block.measure()
        assert arrays["residual"].max() <= block.settings["tolerance"]
        assert arrays["iterations"].max() <= block.settings["max_iterations"]
        assert len(arrays["largest_angle"]) == len(arrays["residual"]) - 1
        assert (arrays["mean_angle"] <= arrays["largest_angle"]).all()


def test_warm_and_nearest_frames_rotate_less_than_cold_ones_and_drift():
    cold, warm, nearest = (
        found("tracking", "arm/heart", "ccd", mode=mode).measure()
        for mode in ("cold", "warm", "nearest")
    )
    for motion in (warm, nearest):
        assert motion["residual"].max() <= 1e-4
        assert motion["largest_angle"][:-1].max() < cold["largest_angle"][:-1].max()
    assert (nearest["iterations"] > warm["iterations"]).all()  # of all starts
    for mode in ("warm", "nearest"):
        drift = found("tracking", "drift/heart", "ccd", mode=mode).measure()["drift"]
        assert (drift >= 0.1).all()
        assert (drift <= 2.0).all()


@pytest.mark.parametrize("solver", ["ccd", "fabrik", "lm/Pinocchio"])
def test_no_residual_is_below_distance_less_reach(solver):
    arrays = found("ik", "chain/beyond", solver).measure()
    assert arrays["excess"].min() > -1e-14
    assert len(arrays["bend"]) == TINY.targets


def test_the_history_begins_at_the_start_and_ends_at_the_residual():
    arrays = found("ik", "chain/near", "fabrik").measure()
    assert arrays["history_low"][-1] <= arrays["residual"].max()
    assert arrays["history_median"][0] > arrays["history_median"][-1]


def test_a_claim_is_judged_as_by_the_cross_check():
    (block,) = [b for b in blocks("check", TINY) if b.problem == "damper forces"]
    values = block.measure()
    assert values["holds"]
    assert 0 < values["difference"] <= values["tolerance"]
    assert values["failure"] == ""


def test_newtons_error_is_printed_as_it_is_in_fifty_digits():
    """Measured against Newton's own answer it was 1e-17, which no float64 can be."""
    swing, k = cloth_swing(1, size=4), 10
    step, settings = partial(cloth.one_step, swing, "newton", k), {"step": 1, "h": swing.h}
    block = Block("cloth", "cloth", "newton", step, settings, facts={"task": ONE_STEP})
    record = measure(block)
    table = convergence(Results([record]))
    lines = [line for line in markdown(table).splitlines() if line.startswith("|")]
    heading, _, *rows = ([cell.strip() for cell in line.split("|")] for line in lines)
    printed = float(rows[0][heading.index("error after 10")])
    state = cloth.converged_motion(swing)[cloth.MIDDLE]
    iterates = ImplicitEuler(swing.system, h=swing.h, solver="newton").iterates(state)
    x = next(itertools.islice(iterates, k, None)).positions
    step, norm = extended_precision.Step(swing.system, state, swing.h), extended_precision.norm
    exact = step.minimiser(x)
    expected = float(norm(extended_precision.wide(x) - exact) / norm(step.y - exact))
    assert printed == pytest.approx(expected, rel=0.05, abs=0)  # of two digits


def test_the_two_laws_of_dampers_come_together_with_h_to_first_order():
    swing = cloth_swing(1, size=5, damping=0.2)
    found = cloth.two_dampers(swing, first=30)
    apart = np.array(found["difference"])
    assert np.log2(found["h"][0] / found["h"][-1]) == len(apart) - 1
    orders = np.log2(apart[:-1] / apart[1:])
    assert orders[-1] == pytest.approx(1.0, abs=0.05)
    assert 1e-4 < apart[-1] < apart[0] < 1
