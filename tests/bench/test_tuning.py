"""The search of settings: it is complete, and the bench uses what it chose and nothing else."""

from collections import Counter
from pathlib import Path

import msgspec
import numpy as np
import pytest
import search_settings as tuning
import write_settings
from search_settings import COUNT, MAXIMUM, SCREENED, SettingsSearch, SettingsTrial

from plumbob.bench.peers.peer import PORTFOLIO
from plumbob.bench.problems import robots
from plumbob.bench.problems.robot_targets import robot_targets

ROOT = Path(__file__).parents[2]
TRIALS = tuning.read(tuning.RESULTS)
# The targets of each robot that a row solves again.
FEW = 4
# The targets of a row that may differ: the Robotics Toolbox solved up to one in a hundred otherwise
# in another run.
ROUNDED = 1
# The first phase alone.
PLAIN = {"iterations": 100, "restarts": 0, "phases": 1}
# A search of each solver, of portfolios where there are any.
ROWS = {
    search.solver: search
    for search in sorted(tuning.searches(), key=lambda search: search.kind == PORTFOLIO)
}


@pytest.fixture(params=tuning.searches(), ids=lambda search: f"{search.solver}, {search.kind}")
def search(request):
    return request.param


def test_no_solver_has_more_settings_than_the_maximum():
    counts = Counter()
    for search in tuning.searches():
        counts[search.solver] += len(search.candidates)
    assert max(counts.values()) <= MAXIMUM


def test_every_setting_was_tried_and_the_finalists_on_all_targets(search):
    screened = search.own(TRIALS, SCREENED)
    assert len(screened) == len(search.candidates)
    final = [trial.settings for trial in search.own(TRIALS, COUNT)]
    assert all(settings in final for settings in search.finalists(screened))
    assert not tuning.best_trial(search, TRIALS).trouble


def test_the_bench_uses_the_settings_that_the_search_chose(search):
    chosen = dict(tuning.best_trial(search, TRIALS).settings)
    restarts = chosen.pop("bench_restarts", 0)
    runs = [run for run in search.peer.runs if run.kind == search.kind]
    assert (chosen, restarts) in [(run.settings, run.restarts) for run in runs]


@pytest.mark.parametrize("search", ROWS.values(), ids=ROWS)
def test_a_row_of_each_solver_solves_the_same_targets_again(search):
    row = tuning.best_trial(search, TRIALS)
    if not search.peer.is_installed or "seconds" in row.settings:
        pytest.skip("not installed, or limited by time")
    assert differences(search, row) <= ROUNDED, (
        f"settings.jsonl is stale: {search.solver} {search.peer.version} with {row.settings} "
        f"solves other targets than {row.version}; run tools/search_settings.py --anew"
    )


def test_a_row_of_a_solver_that_has_changed_differs():
    search = ROWS["Plumbob LM"]
    row = tuning.best_trial(search, TRIALS)
    assert differences(search, msgspec.structs.replace(row, settings=PLAIN)) > ROUNDED


def differences(search, row):
    """Count the first targets of each robot that either a row or its settings solve now."""
    again = tuning.trial(search, row.settings, FEW)
    return np.sum(again.solved != row.solved[:, :FEW])


def test_tuning_shares_no_robot_with_those_held_out_and_no_target_with_the_tables():
    assert not {*robots.TUNING} & {*robots.HELD_OUT}
    ours = tuning.tuning_targets("iiwa14", COUNT).positions[:, 0]
    theirs = robot_targets("iiwa14", COUNT).positions[:, 0]
    assert np.linalg.norm(ours[:, None] - theirs, axis=-1).min() > 0


def test_the_tables_of_the_pages_are_those_of_the_results():
    parts = write_settings.contents()
    for page in (ROOT / "docs/peers").glob("*.md"):
        text = page.read_text(encoding="utf-8")
        assert write_settings.filled(text, parts) == text, f"{page}: run write_settings.py"


@pytest.mark.parametrize(
    ("hits", "time", "winner"),
    [(50, 1.0, "default"), (50, 0.5, "other"), (60, 9.0, "other"), (40, 0.1, "default")],
)
def test_share_decides_then_time_then_the_default(hits, time, winner, monkeypatch):
    """Of 120 targets the default solves 50; ten more or fewer cannot be chance (p = 0.002)."""
    monkeypatch.setattr(tuning, "COUNT", 20)
    names = [{"name": name} for name in ("default", "other")]
    search = SettingsSearch("A", "one start", tuple(names), names[1])
    trials = [
        SettingsTrial(
            "A", "one start", name, "1", us, np.packbits(np.arange(120) < hits).tobytes().hex(), 20
        )
        for name, hits, us in zip(names, (50, hits), (1.0, time), strict=True)
    ]
    assert tuning.best_trial(search, trials).settings == {"name": winner}


@pytest.mark.slow
def test_an_interrupted_search_goes_on_and_wrong_settings_solve_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr(tuning, "SCREENED", 2)
    monkeypatch.setattr(tuning, "COUNT", 3)
    settings = ({"restarts": 20}, {"wrong": 1})
    search = SettingsSearch("Plumbob LM", "restarts", settings, settings[0])
    first = [next(tuning.perform(search, tmp_path / "a"))]
    rest = list(tuning.perform(search, tmp_path / "a"))
    assert [(trial.share, trial.targets) for trial in first + rest] == [
        (1, 2),
        (0, 2),
        (1, 3),
        (0, 3),
    ]
    assert "unexpected keyword" in rest[0].trouble
    assert tuning.read(tmp_path / "a") == rest[1:]
    assert not list(tuning.perform(search, tmp_path / "a"))
