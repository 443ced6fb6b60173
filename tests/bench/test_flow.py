"""Who may do what inside the bench: read a clock, open the result file, compute."""

import ast
from pathlib import Path

import pytest

BENCH = Path(__file__).parents[2] / "bench"
SOURCES = sorted(BENCH.rglob("*.py"))


def imports(path):
    """The modules that a file imports, without their dots."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.module or ""


def name(path):
    return str(path.relative_to(BENCH))


def test_only_the_clock_and_the_harness_read_a_clock():
    clocks = {"time", "datetime", "timeit"}
    readers = {name(path) for path in SOURCES if clocks & set(imports(path))}
    # PlaCo lives in an environment of its own, where nothing of ours is: it times itself.
    allowed = {"clock.py", "peers/placo_program.py"}
    # When and in how long a record was made; rounds of a call by Python's own timer.
    allowed |= {"measure/measure.py", "measure/run.py", "experiments/timing.py"}
    assert readers == allowed


def test_only_record_names_the_result_file():
    namers = {name(path) for path in SOURCES if ".jsonl" in path.read_text(encoding="utf-8")}
    # The results of the search over settings are no records.
    assert namers == {"measure/record.py"}


SHOWS = ["tables/table.py", "page/report.py", "experiments/chain.py"]


@pytest.mark.parametrize("file", SHOWS)
def test_what_shows_numbers_solves_nothing(file, tmp_path):
    text = (BENCH / file).read_text(encoding="utf-8")
    shown = tmp_path / "shown.py"
    shown.write_text(text.partition("# What is shown.")[2] or text, encoding="utf-8")
    parts = {part for module in imports(shown) for part in module.split(".")}
    assert not parts & {"reference", "crosscheck", "scipy"}


TAKES_APART = {"startswith", "endswith", "split", "partition", "rpartition", "removeprefix",
               "removesuffix", "rsplit", "find", "index", "match", "fullmatch"}  # fmt: skip
NAMES = {"problem", "solver", "suite", "measured", "remark"}


def names_taken_apart(text):
    """The lines that take a name or a note of a record apart, where a fact should be read."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            inner = {n.attr for n in ast.walk(node.func.value) if isinstance(n, ast.Attribute)}
            if node.func.attr in TAKES_APART and inner & NAMES:
                yield node.lineno


def test_no_name_of_a_record_is_taken_apart():
    found = {name(path): list(names_taken_apart(path.read_text("utf-8"))) for path in SOURCES}
    assert not {file: lines for file, lines in found.items() if lines}


@pytest.mark.parametrize(
    "line",
    [
        'float(record.problem.rpartition("/k")[2])',
        'record.measured["rungs"].split("; ")',
        'point.solver.partition(" ")[0]',
        'record.measured.get("remark", "").split("; ")',
    ],
)
def test_a_name_that_is_taken_apart_is_found(line):
    assert list(names_taken_apart(line)) == [1]
