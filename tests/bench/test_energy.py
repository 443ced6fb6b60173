"""The energy of a swinging cloth: the suite, its table, its sentences and its figure."""

import numpy as np
import pytest

from plumbob.bench.experiments import energy as suite
from plumbob.bench.tables.results import Results

STEPS = 100


@pytest.fixture(scope="module")
def swings():
    """The energy left by every integrator over the first steps of the undamped cloth."""
    return {name: suite.swing("undamped", name, STEPS)["left"] for name in suite.INTEGRATORS}


def test_every_swing_begins_with_all_its_energy_and_moves(swings):
    for left in swings.values():
        assert left[0] == 1.0
        assert len(left) == STEPS // suite.EVERY + 1
        assert np.ptp(left) > 1e-9


def test_without_dampers_mujocos_implicit_ones_are_symplectic_euler(swings):
    for name in ("implicit", "implicitfast"):
        assert swings[name] == pytest.approx(swings["symplectic Euler"], abs=1e-12)


def test_implicit_euler_loses_most_and_runge_kutta_least(swings):
    lost = {name: 1.0 - left[-1] for name, left in swings.items()}
    assert max(lost, key=lost.get) == "implicit Euler"
    assert min(lost, key=lambda name: abs(lost[name])) == "RK4"


def test_dampers_take_energy(swings):
    damped = suite.swing("damped", "RK4", STEPS)["left"]
    assert damped[-1] < swings["RK4"][-1] - 1e-4


def test_table_and_sentence_follow_the_records(make):
    left = np.linspace(1.0, 0.5, 11)
    damped = make.swung("discrete", "damped", left)
    table = suite.energy(Results([make.swung("RK4", left=left), damped]))
    assert [row[:2] for row in table.rows] == [("undamped", "RK4"), ("damped", "discrete")]
    assert table.rows[0][2:] == (50.0, None, None, 100.0, 50.0)
    (point,) = table.summary.points
    assert all(part in point for part in ("RK4", "50.0 %", "100 %"))
    assert "nearest" not in table.summary.sentence, "one integrator is not compared"
    both = Results([make.swung("RK4", left=left), make.swung("discrete", left=(1.0, 0.9))])
    assert "discrete is nearest to that, and RK4 farthest" in suite.energy(both).summary.sentence
    assert suite.energy(Results([damped])).summary.sentence == ""
