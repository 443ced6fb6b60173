"""Answers do not depend on how busy the machine is: two runs of the same sources, to the bit."""

import subprocess
import sys

import numpy as np
import pytest

from plumbob.bench.compare.answers import is_time
from plumbob.bench.experiments import Scale
from plumbob.bench.measure import run
from plumbob.bench.measure.block import Choice
from plumbob.bench.measure.record import RecordFile
from plumbob.bench.ranking.scores import STARTS, overall
from plumbob.bench.tables.results import Results

PROBLEMS = ("robots/ur5", "robots/z1", "unreachable/ur5", "chain/near", "published/toolbox/ur5")
CHOICE = Choice("quick", Scale(targets=20, seconds=0.2), problems=PROBLEMS, is_partial=True)


def untimed(folder):
    """What a run has written but times, and the order and ties of its solvers."""
    records = RecordFile(folder).read().records
    fields = {}
    for record in records:
        for name, array in record.numbers().items():
            if not is_time(record.suite, name):
                fields[*record.key, name] = (array.shape, array.dtype.str, array.tobytes())
        words = {n: v for n, v in record.measured.items() if n not in record.numbers()}
        fields[record.key] = (record.size, words)
    scores = [score for score in overall(Results(records)) if score.start in STARTS]
    ranks = [(s.robots, s.start, s.solver, s.share, s.success) for s in scores]
    return fields, ranks


@pytest.mark.slow
def test_two_runs_agree_to_the_bit_though_one_is_beside_busy_processes(tmp_path):
    """Budgets of time once cut solvers at other targets in every run."""
    folders = [tmp_path / "quiet", tmp_path / "loaded"]
    list(run.run(["ik"], CHOICE, folders[0]))
    loop = ["nice", sys.executable, "-c", "while True: pass"]
    busy = [subprocess.Popen(loop) for _ in range(2)]
    try:
        list(run.run(["ik"], CHOICE, folders[1]))
    finally:
        for process in busy:
            process.kill()
            process.wait()
    quiet, loaded = map(untimed, folders)
    assert loaded == quiet
    assert len(quiet[1]) > 4


@pytest.mark.parametrize(("name", "is_noticed"), [("residual", True), ("seconds", False)])
def test_a_changed_bit_of_an_answer_is_noticed_and_one_of_a_time_is_not(tmp_path, name, is_noticed):
    choice = Choice("quick", CHOICE.scale, ("ccd",), ("chain/near",), is_partial=True)
    list(run.run(["ik"], choice, tmp_path))
    before = untimed(tmp_path)
    (record,) = RecordFile(tmp_path).read().records
    changed = record.measured[name].copy()
    changed.flat[3] = np.nextafter(changed.flat[3], 1.0)
    RecordFile(tmp_path).append([record.with_measured(**{name: changed})])
    assert (untimed(tmp_path) != before) == is_noticed
