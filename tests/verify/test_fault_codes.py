"""Every fault has a code of its own, and the code stands in each form of a report."""

import json
import re
import tomllib
from itertools import groupby
from pathlib import Path

import pytest
import write_faults
from kinematics_solvers import faulty
from rich.cells import cell_len

from plumbob.cli import main as cli
from plumbob.text.sentence import sentence
from plumbob.verify.fault_programs import (
    FAMILIES,
    coded_faults,
)
from plumbob.verify.functions import FunctionConnection
from plumbob.verify.greeting import PROTOCOL, Greeting
from plumbob.verify.screen import json_file, junit, page, terminal
from plumbob.verify.screen.fault_text import cause_and_remedy, explained, failure_of, fault_help
from plumbob.verify.screen.words import Presentation, speaker
from plumbob.verify.verify import verify

REMEDY = sentence("Remedy")
CODE = re.compile(rf"PB-({'|'.join(FAMILIES)})-(\d{{3}})")


def entries():
    """Yield the file, the table and the content of each fault."""
    for path in sorted((Path(__file__).parents[2] / "verify").rglob("faults.toml")):
        for table, faults in tomllib.loads(path.read_text(encoding="utf-8")).items():
            for entry in faults.values() if isinstance(faults, dict) else faults:
                yield path, table, entry


def test_every_fault_has_a_code_of_its_own_and_lines():
    codes = [entry.get("code", "") for _, _, entry in entries()]
    assert [code for code in codes if not CODE.fullmatch(code)] == []
    assert len(set(codes)) == len(codes) > 170
    for fault in coded_faults().values():
        assert fault.lines, fault.code
        assert int(fault.code[-3:]) <= FAMILIES[fault.family]["last"], fault.code


def report_of(*codes):
    task = "forward_kinematics"
    functions = {task: faulty(task, *codes)}
    return verify(FunctionConnection(functions, Greeting(PROTOCOL, (task,))))


@pytest.mark.parametrize("codes", [("PB-FK-001",), ("PB-FK-006", "PB-FK-013")])
@pytest.mark.parametrize("language", ["en", "zh"])
def test_the_code_stands_on_screen_on_the_page_in_json_and_in_junit(codes, language):
    report = report_of(*codes)
    context = Presentation(speaker(language), language, ["solver.py"])
    explanation = json.loads(json_file.text(report, context.say))["tasks"][0]["explanations"][0]
    assert tuple(explanation["codes"]) == codes
    texts = [
        explanation["text"],
        "\n".join(terminal.lines(report, context)),
        junit.text(report, context.say),
        page.render(report, context),
    ]
    assert all(f"[{code}]" in text for code in codes for text in texts)


@pytest.mark.parametrize(("codes", "is_open"), [((), True), (("PB-FK-001",), False)])
def test_cases_are_folded_where_a_mistake_is_shown(codes, is_open):
    text = page.render(report_of(*codes), Presentation(speaker("en"), "en", ["solver.py"]))
    assert ("<details open>" in text) is is_open


# ---- the short programs of each code, which test_self_test.py judges


def test_no_cause_has_figures_of_the_answers_of_a_run():
    """A code stands for one cause, whatever solver and in however many cases it is found."""
    counted = [
        code
        for code, fault in coded_faults().items()
        if re.search(r"\d+ of \d+ ", str(fault.sentence))
        or {"count", "total"} & fault.sentence.values.keys()
    ]
    assert counted == []


def test_a_line_that_the_program_lacks_is_refused():
    fault = next(iter(coded_faults().values()))._replace(lines=(("no such line", ""),))
    with pytest.raises(ValueError, match="expected 'no such line' once"):
        _ = fault.wrong_program


# ---- plumbob explain


@pytest.fixture
def printed(capsys):
    """Return what gives the exit code and the output of `plumbob explain` with some words."""

    def run(*words):
        code = cli.run_command(["explain", *words])
        return code, "".join(capsys.readouterr())

    return run


@pytest.mark.sample("en")
@pytest.mark.parametrize("language", ["en", "zh"])
def test_a_code_in_small_letters_is_explained_with_lines_and_a_failing_case(language, printed):
    fault, say = coded_faults()["PB-FK-003"], speaker(language)
    code, text = printed("pb-fk-003", "--lang", language)
    assert code == 0
    flat = re.sub(r"\s+", "", text)
    assert re.sub(r"\s+", "", say(fault.sentence)) in re.sub(f"{say(REMEDY)}", "", flat, count=1)
    ((right, wrong),) = fault.lines
    assert re.search(rf"^  -.*{re.escape(wrong)}", text, re.MULTILINE)
    assert re.search(rf"^  \+.*{re.escape(right)}", text, re.MULTILINE)
    assert "positions[" in text or "rotations[" in text


def test_a_program_whose_answers_are_no_numbers_is_explained():
    fault = coded_faults()["PB-FK-003"]
    fault = fault._replace(lines=(("multiply(R[p], q[j])", "np.nan * q[j]"),))
    assert "NaN" in "\n".join(explained(fault, speaker("en")))


def test_an_unknown_code_is_refused_with_the_nearest(printed):
    code, text = printed("PB-FORCE-999")
    assert code == 2
    assert text.count("\n") == 1
    assert re.search(r"nearest: PB-FORCE-\d{3}$", text.strip())


def test_a_retired_code_is_told_apart_from_one_that_was_never_given(printed):
    code, text = printed("PB-FK-033")
    assert code == 2
    assert text.count("\n") == 1
    assert "PB-FK-033 is retired, its mistake may show as a changed line" in text
    assert "`plumbob explain PB-FK` lists" in text


def listed(*words, language="en"):
    """The lines of a list of faults, and what each begins with."""
    lines = list(fault_help(words, speaker(language)))
    assert max(map(cell_len, lines)) <= 80
    return lines, [line.split()[0] for line in lines if line.startswith("  PB-")]


@pytest.mark.parametrize("language", ["en", "zh"])
def test_without_a_code_each_family_has_a_line_and_is_listed_by_its_name(language):
    lines, families = listed(language=language)
    assert sorted(families) == sorted(f"PB-{family}" for family in FAMILIES)
    assert sum(int(line.split()[1]) for line in lines[: len(families)]) == len(coded_faults())
    codes = [code for family in families for code in listed(family.lower(), language=language)[1]]
    assert codes == list(coded_faults())


def test_words_list_the_faults_that_have_all_of_them():
    codes = listed("Parent", "rotation")[1]
    causes = {code: cause_and_remedy(f, str)[0].lower() for code, f in coded_faults().items()}
    assert codes == [c for c, text in causes.items() if "parent" in text and "rotation" in text]
    with pytest.raises(ValueError, match="got 'parent qqq'; `plumbob explain` lists the families"):
        fault_help(("parent", "qqq"), str)


def test_a_remedy_is_told_apart_from_its_cause_in_both_languages():
    for fault in coded_faults().values():
        english, chinese = (cause_and_remedy(fault, speaker(name)) for name in ("en", "zh"))
        assert bool(english[1]) == bool(chinese[1]), (fault.code, english, chinese)


@pytest.mark.slow
@pytest.mark.usefixtures("verdict_alone")
def test_a_fault_that_may_be_on_purpose_breaks_no_law():
    assert failure_of(coded_faults()["PB-TRACK-001"]) is None


def test_each_code_has_a_section_of_its_page():
    pages = {
        family: write_faults.page(family, list(faults))
        for family, faults in groupby(coded_faults().values(), key=lambda fault: fault.family)
    }
    for code, fault in coded_faults().items():
        assert pages[fault.family].count(f"## {code}\n") == 1
