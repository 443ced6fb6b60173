"""The sample report: one page, and its headlines in the README."""

import pytest
import write_sample as sample

from plumbob.bench.measure.record import RecordFile


@pytest.fixture(scope="module")
def written(records, tmp_path_factory):
    """Write a sample of the tests' records; return the README before and after, and the folder."""
    folder = tmp_path_factory.mktemp("sample")
    RecordFile(folder / "records").append(records)
    before = f"# Title\n{sample.BEGIN}\nout of date\n{sample.END}\nAfter.\n"
    (folder / "README.md").write_text(before)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sample, "SAMPLE", folder / "sample")
        patch.setattr(sample, "README", folder / "README.md")
        patch.setattr(sample, "CHART", folder / "best.svg")
        sample.write_sample(folder / "records")
    return before, (folder / "README.md").read_text(), folder / "sample"


def test_only_what_stands_between_the_marks_is_replaced(written):
    before, after, folder = written
    assert "out of date" not in after
    assert after.split(sample.BEGIN)[0] == before.split(sample.BEGIN)[0]
    assert after.split(sample.END)[1] == before.split(sample.END)[1]
    headlines = (folder / "headlines.md").read_text()
    assert "claims hold" in headlines
    short = sample.without_tuning(headlines)
    assert short in after
    assert sample.with_headlines(after, short) == after


def test_a_sample_holds_the_page_and_the_headlines(written):
    assert {path.name for path in written[2].iterdir()} == {"index.html", "headlines.md"}


def test_the_committed_sample_is_small():
    files = [path for path in sample.SAMPLE.rglob("*") if path.is_file()]
    # Less than a megabyte when packed; each of three kinds of runs has charts for each robot.
    assert sum(path.stat().st_size for path in files) <= 4.5e6


def test_a_readme_without_marks_is_refused():
    with pytest.raises(ValueError, match="README: expected the marks"):
        sample.with_headlines("# Title\n", "line")


def test_the_headlines_of_the_readme_are_those_of_the_committed_sample():
    readme = sample.README.read_text()
    headlines = (sample.SAMPLE / "headlines.md").read_text()
    short = sample.without_tuning(headlines)
    assert len(short) < len(headlines)
    assert f"{sample.BEGIN}\n\n{short}\n{sample.END}" in readme
