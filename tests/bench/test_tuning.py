"""The search of settings: it is complete, and the bench uses what it chose and nothing else."""

from collections import Counter
from pathlib import Path

import numpy as np
import pytest
import search_settings as tuning
import write_settings
from search_settings import (
    COUNT,
    MAXIMUM,
    SCREENED,
    SettingsSearch,
    SettingsTrial,
)

from plumbob.bench.problems import robots
from plumbob.bench.problems.robot_targets import robot_targets

ROOT = Path(__file__).parents[2]
TRIALS = tuning.read(tuning.RESULTS)


@pytest.fixture(params=tuning.searches(), ids=lambda search: f"{search.solver}, {search.start}")
def search(request):
    return request.param


def test_no_solver_has_more_settings_than_the_maximum():
    counts = Counter()
    for search in tuning.searches():
        counts[search.solver] += len(search.settings)
    assert max(counts.values()) <= MAXIMUM


def test_every_setting_was_tried_and_the_finalists_on_all_targets(search):
    screened = tuning.trials_of(search, TRIALS, SCREENED)
    assert len(screened) == len(search.settings)
    final = [trial.settings for trial in tuning.trials_of(search, TRIALS, COUNT)]
    assert all(settings in final for settings in tuning.finalists(search, screened))
    assert not tuning.best_trial(search, tuning.trials_of(search, TRIALS, COUNT)).trouble


def test_the_bench_uses_the_settings_that_the_search_chose(search):
    chosen = dict(tuning.best_trial(search, tuning.trials_of(search, TRIALS, COUNT)).settings)
    entry = search.peer.first(search.start)
    assert entry.restarts == chosen.pop("bench_restarts", 0)
    assert entry.settings == chosen


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
def test_share_decides_then_time_then_the_default(hits, time, winner):
    """Of 120 targets the default solves 50; ten more or fewer cannot be chance (p = 0.002)."""
    names = [{"name": name} for name in ("default", "other")]
    search = SettingsSearch("A", "one start", names[0], names[0], tuple(names))
    trials = [
        SettingsTrial(
            "A", "one start", name, "1", 20, us, np.packbits(np.arange(120) < hits).tobytes().hex()
        )
        for name, hits, us in zip(names, (50, hits), (1.0, time), strict=True)
    ]
    assert tuning.best_trial(search, trials).settings == {"name": winner}


def test_an_interrupted_search_goes_on_and_a_lost_process_solves_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr(tuning, "SCREENED", 2)
    settings = ({"restarts": 20}, {"wrong": 1})
    search = SettingsSearch("Plumbob LM", "restarts", settings[0], settings[0], settings)
    first = [next(tuning.perform(search, tmp_path / "a"))]
    rest = list(tuning.perform(search, tmp_path / "a"))
    assert [trial.share for trial in first + rest] == [1, 0, 1]
    assert "unexpected keyword" in rest[0].trouble
    assert tuning.read(tmp_path / "a") == first + rest
