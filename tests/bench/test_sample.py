"""The sample report: one page, and its headlines in the README."""

import importlib.util
from pathlib import Path

import pytest

from plumbob.bench.harness.record import RecordFile

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def sample():
    spec = importlib.util.spec_from_file_location("write_sample", ROOT / "docs" / "write_sample.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def written(sample, records, tmp_path_factory):
    """Write a sample of the tests' records; return the README before and after."""
    folder = tmp_path_factory.mktemp("sample")
    RecordFile(folder / "records").append(records)
    sample.SAMPLE, sample.README = folder / "sample", folder / "README.md"
    sample.CHART = folder / "best.svg"
    before = f"# Title\n{sample.BEGIN}\nout of date\n{sample.END}\nAfter.\n"
    sample.README.write_text(before)
    sample.write_sample(folder / "records")
    return before, sample.README.read_text()


def test_only_what_stands_between_the_marks_is_replaced(sample, written):
    before, after = written
    assert "out of date" not in after
    assert after.split(sample.BEGIN)[0] == before.split(sample.BEGIN)[0]
    assert after.split(sample.END)[1] == before.split(sample.END)[1]
    headlines = (sample.SAMPLE / "headlines.md").read_text()
    assert "claims hold" in headlines
    short = sample.without_tuning(headlines)
    assert short in after
    assert sample.with_headlines(after, short) == after


def test_a_sample_holds_the_page_and_the_headlines(sample, written):
    assert {path.name for path in sample.SAMPLE.iterdir()} == {"index.html", "headlines.md"}


def test_the_committed_sample_is_small():
    files = [path for path in (ROOT / "docs" / "sample").rglob("*") if path.is_file()]
    # Less than a megabyte when packed; each of three kinds of runs has charts for each robot.
    assert sum(path.stat().st_size for path in files) <= 4.5e6


def test_a_readme_without_marks_is_refused(sample):
    with pytest.raises(ValueError, match="README: expected the marks"):
        sample.with_headlines("# Title\n", "line")


def test_the_headlines_of_the_readme_are_those_of_the_committed_sample(sample):
    readme = (ROOT / "README.md").read_text()
    headlines = (ROOT / "docs" / "sample" / "headlines.md").read_text()
    short = sample.without_tuning(headlines)
    assert len(short) < len(headlines)
    assert f"{sample.BEGIN}\n\n{short}\n{sample.END}" in readme
