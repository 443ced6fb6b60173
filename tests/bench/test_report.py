"""The report: one page that needs nothing else, from nothing but the records."""

import csv
import re
import unicodedata
import xml.etree.ElementTree as ET
from dataclasses import replace

import msgspec
import numpy as np
import pytest
from html_page import Page

from plumbob.bench.experiments import SUITES
from plumbob.bench.measure.record import RecordFile
from plumbob.bench.measure.values import facts_of
from plumbob.bench.page import report
from plumbob.bench.page.sections import SECTIONS
from plumbob.bench.tables.results import Results, results_of


def written(folder, records):
    """Write a report of records; return what came of it and its page."""
    RecordFile(folder).append(records)
    result = report.write(folder)
    return result, Page(result.page.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def whole(tmp_path_factory, records):
    """The report of all records, and its page."""
    return written(tmp_path_factory.mktemp("report"), records)


def test_the_page_needs_nothing_from_outside(whole):
    result, page = whole
    text = result.page.read_text(encoding="utf-8")
    files = [link for link in page.links if not link.startswith("#")]
    assert files
    assert all(re.fullmatch(r"(tables|figures)/\w+\.\w+", link) for link in files)
    assert all((result.page.parent / link).is_file() for link in files)
    assert not re.search(r"https?://|//[a-z]+\.|@import|url\((?!#)", text)
    assert "xlink" not in text
    assert page.tags.count("script") <= 4  # ours, that of motions, and two of data
    assert not {*page.tags} & {"link", "img", "iframe", "object"}


def test_the_page_is_well_formed_and_every_id_is_its_own(whole):
    _, page = whole
    assert page.wrong == []
    assert page.open == []
    assert len(page.ids) == len(set(page.ids))
    inner = {link[1:].partition("?")[0] for link in page.links if link.startswith("#")}
    assert inner <= set(page.ids)


def test_machine_versions_and_date_stand_in_its_head(whole):
    _, page = whole
    text = "".join(page.texts)
    for fact in ("a <b>slide</b> rule", "2000-01-02 03:04:05 UTC", "0123456789ab", "numpy 2"):
        assert fact in text


def test_tables_in_three_formats_and_figures_lie_beside_it(whole):
    result, page = whole
    folder = result.page.parent
    text = "".join(page.texts)
    assert "Questions without records" not in text
    assert result.page.read_text().count("<svg role=") == len(report.all_figures())
    for table in result.tables:
        assert table.rows
        assert table.title in text
        for suffix in ("md", "tex", "csv"):
            assert (folder / "tables" / f"{table.name}.{suffix}").stat().st_size > 0
    drawn = {path.stem for path in (folder / "figures").iterdir()}
    results = Results(RecordFile(folder).read().records)
    assert drawn == {draw(results).name for draw in report.all_figures()}
    assert "<svg" in (folder / "figures" / "jitter.svg").read_text()
    for name in drawn:
        assert (folder / "figures" / f"{name}.pdf").read_bytes().startswith(b"%PDF")


def test_a_page_of_one_suite_has_its_chapter_and_says_what_was_not_measured(tmp_path, records):
    result, page = written(tmp_path, [record for record in records if record.suite == "check"])
    text = "".join(page.texts)
    titles = {section.title: section.name for section in SECTIONS}
    assert [titles[title] for title in titles if title in text] == ["right"]
    (sentence,) = (sentence for sentence in result.missing if sentence.startswith("Not run: "))
    assert sentence.replace("`", "") in text
    assert all(suite in sentence for suite in SUITES if suite != "check")


def test_what_is_missing_is_said(tmp_path, records):
    why = {"task": records[0].task, "failed": "OSError: no engine"}
    failed = replace(records[0], problem="gone", measured=why)
    others = [r for r in records if not (r.suite == "finished" and r.problem == "cloth")]
    older = replace(others[1], stamp={"source": "other"}, when="1999-01-01T00:00:00+00:00")
    result, page = written(tmp_path, [failed, others[0], older, *others[2:]])
    for words in (
        "“cloth” is not complete",
        "gone, MuJoCo could not be measured: OSError: no engine",
        "matplotlib is not installed",
        "1 of ",
    ):
        assert any(words in sentence for sentence in result.missing)
    assert all(sentence.replace("`", "") in "".join(page.texts) for sentence in result.missing)


def test_a_complete_report_misses_only_the_package_and_the_peers_that_are_not_there(whole):
    result, page = whole
    package, absent, others = result.missing
    assert package == "matplotlib is not installed."
    assert absent.startswith("Absent peers: pink and PyBullet (cloth). `make peers` ")
    assert others.startswith("Not selected: DART, Drake, ")
    assert "Newton engine (cloth)" in others
    assert "Nothing: every suite" not in "".join(page.texts)


def test_the_same_records_give_the_same_files(whole):
    result, _ = whole
    files = sorted(p for p in result.page.parent.rglob("*") if p.is_file())
    before = [p.read_bytes() for p in files]
    report.write(result.page.parent)
    assert [p.read_bytes() for p in files] == before


HOSTILE = (
    r"$\frac{$", "$x$ and $y$", "<script>alert(1)</script>", "[red]x", "a|b`c`*d*", "\x1b[2J",
    "100 %", "_hidden_", "a & b", "two\nlines", "right\u202eleft", "x" * 10_000, "", "\x00\x07",
    "id=\"x\" xlink:href='#22272e'", "-->]]>&lt;", "../../x/", "\ufffe\U000f0000", "[/]", "{0}",
    r"\input{/etc/passwd}", "*", "手腕", "${day}", ":smile:", " ",
)  # fmt: skip
KEPT = (r"$\frac{$", "[red]x", "<script>alert(1)</script>", r"\x1b[2J", r"right\u202eleft", "手腕")


def spoilt(record, field, name):
    """A record with a name of an enemy's choice in all strings of a field."""
    if field in ("problem", "solver"):
        was = getattr(record, field)
        return replace(record, **{field: f"{was}/{name}" if field == "problem" else name})
    values = dict(getattr(record, field))
    if field == "stamp":
        machine = values["machine"] | {"processor": name, "system": name}
        return replace(record, stamp={"machine": machine, "versions": {name: name}, "source": name})
    changed = {key: name if isinstance(value, str) else value for key, value in values.items()}
    return replace(record, **{field: changed})


def look_into_everything(folder):
    """Check that no name is an instruction in any file of a report."""
    binary = {"records.jsonl", *(path.name for path in folder.rglob("*.pdf"))}
    for path in sorted(p for p in folder.rglob("*.*") if p.name not in binary):
        text = path.read_text(encoding="utf-8")
        bad = {unicodedata.category(c) for c in text if c != "\n"} & {"Cc", "Cf", "Cs", "Cn", "Co"}
        assert not bad, (path, bad)
        if path.suffix == ".svg":
            ET.fromstring(text)
        if path.suffix == ".html":
            page = Page(text)
            assert (page.wrong, page.open) == ([], [])
            assert len(page.ids) == len(set(page.ids))
            assert (
                page.tags.count("script") <= 4
            )  # ours, that of motions, and what two of them show
            assert not {*page.tags} & {"link", "img", "iframe", "object"}
        if path.suffix == ".md":
            rows = [line for line in text.splitlines() if line.startswith("|")]
            assert len({len(re.findall(r"(?<!\\)\|", row)) for row in rows}) <= 1
            body = re.sub(r"\| \*\*(.*?)\*\* (?=\|)", r"| \1 ", "\n".join(rows[2:]))  # the best
            assert not re.search(r"(?<!\\)(\\\\)*[`*_\[\]<>$]", body)
        if path.suffix == ".tex":
            assert not re.search(r"\\(frac|input)|\\\\\s*[\[*]", text)
            bare = re.sub(r"%.*", "", re.sub(r"\\[{}$&#%_\\]", "", text))
            assert bare.count("{") == bare.count("}")
        if path.suffix == ".csv":
            assert len({len(row) for row in csv.reader(text.splitlines())}) <= 1


@pytest.mark.sample("solver-problem")
@pytest.mark.parametrize(
    "fields", [("solver", "problem"), ("settings", "stamp", "measured")], ids="-".join
)
def test_hostile_names_are_data_in_every_file(tmp_path, records, fields):
    """In a report of good records, and of spoilt ones beside them."""
    bad = [
        spoilt(record, fields[i % len(fields)], HOSTILE[i // len(fields) % len(HOSTILE)])
        for i, record in enumerate(records)
    ]
    written(tmp_path, [*records, *bad])
    look_into_everything(tmp_path)


def test_a_name_stands_letter_by_letter_in_figures_and_tables(tmp_path, make):
    cases = [make.timed(name, 1e-6) for name in (*HOSTILE, "Pinocchio")]
    result, page = written(tmp_path, cases)
    drawn = ET.parse(tmp_path / "figures" / "timing_kinematics.svg").getroot()
    inline = "".join(page.texts)
    for name in KEPT:
        shown = name.encode("unicode_escape").decode() if not name.isprintable() else name
        assert any(shown == "".join(element.itertext()) for element in drawn.iter()), name
        assert inline.count(shown) >= 2


SPOILT = {
    "one number only": lambda r: with_numbers(r, dict([*r.numbers().items()][:1])),
    "no settings and words": lambda r: replace(
        r, settings={}, measured={**r.numbers(), "task": r.task}
    ),
    "arrays of other shapes": lambda r: with_numbers(
        r, {name: values[..., None, None, None] for name, values in r.numbers().items()}
    ),
    "truth values": lambda r: with_numbers(r, dict.fromkeys(r.numbers(), np.array(True))),
}


def with_numbers(record, numbers):
    """The record with other numbers than its own."""
    words = {n: v for n, v in record.measured.items() if n not in record.numbers()}
    return replace(record, measured={**words, **numbers})


def _needs_more(record):
    """Whether a record has a word that it needs, further numbers, and none of truth values."""
    above = facts_of(type(record.values))
    is_needed = any(field.required for field in msgspec.structs.fields(above))
    numbers = record.numbers().values()
    return is_needed and len(numbers) > 1 and any(array.dtype != bool for array in numbers)


@pytest.mark.parametrize("how", SPOILT)
def test_a_record_that_is_not_of_its_type_costs_that_record_and_a_sentence(tmp_path, records, how):
    """Every record of an experiment that declares its types is spoilt, and left out by its line."""
    typed = [r for r in records if r.values is not None and _needs_more(r)]
    bad = [SPOILT[how](replace(r, solver="the spoilt one")) for r in typed]
    RecordFile(tmp_path).append([*records, *bad])
    results, warning = results_of(tmp_path)
    assert "the spoilt one" not in {record.solver for record in results.every}
    assert f"line {len(records) + 1} (" in warning


def test_a_fault_of_a_table_is_an_error_and_no_fault_of_a_record(tmp_path, records, monkeypatch):
    def fails(_):
        raise KeyError("a fault of ours")

    monkeypatch.setattr(report, "overview", fails)
    with pytest.raises(KeyError, match="a fault of ours"):
        written(tmp_path, records)
    assert len(RecordFile(tmp_path).read().records) == len(records)
