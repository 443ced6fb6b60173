"""Position-based steps are judged by laws alone: right forms pass, each mistake breaks a law."""

from pathlib import Path

import pytest

from plumbob.verify.fault_programs import connection_to
from plumbob.verify.judgement import Verdict
from plumbob.verify.verify import verify

pytestmark = pytest.mark.usefixtures("verdict_alone")
SOURCE = Path(__file__).with_name("real") / "right_projections.py"


def judged(monkeypatch, form, mistake=""):
    monkeypatch.setenv("FORM", form)
    monkeypatch.setenv("MISTAKE", mistake)
    return verify(connection_to(SOURCE.read_text("utf-8"))).tasks[0]


def broken(report, verdict=Verdict.WRONG):
    findings = (finding for judgement in report.judgements for finding in judgement.findings)
    return {finding.law for finding in findings if finding.verdict is verdict}


@pytest.mark.parametrize(("form", "words"), [
    ("pbd", "rigid"), ("verlet overwritten", "rigid"), ("verlet slowed", "rigid"),
    ("soft", "acts as one of 87.69 N/m: a mass at rest hangs 0.684 times m g / k"),
    ("xpbd", "acts as one of 60 N/m: a mass at rest hangs 1 times m g / k"),
    ("xpbd substeps", ""),
])  # fmt: skip
def test_declared_projections_are_right_and_their_stiffness_is_stated(monkeypatch, form, words):
    report = judged(monkeypatch, form)
    assert report.verdict is Verdict.RIGHT, broken(report)
    assert words in str(report.diagnosis.behaviour)


def test_projections_without_regard_to_stiffness_show_without_a_declaration(monkeypatch):
    report = judged(monkeypatch, "soft undeclared")
    assert report.verdict is Verdict.RIGHT_EXCEPT
    assert broken(report, Verdict.RIGHT_EXCEPT) == {"minimiser"}
    assert '"method": "position_based"' in str(report.diagnosis.behaviour)
    assert judged(monkeypatch, "xpbd undeclared").verdict is Verdict.UNDECIDED


@pytest.mark.parametrize(("form", "mistake", "law"), [
    ("pbd", "sign", "projection"), ("xpbd substeps", "sign", "projection"),
    ("xpbd", "twice", "projection"), ("pbd", "mass", "momentum"),
    ("xpbd substeps", "gravity", "momentum"), ("xpbd substeps", "dt", "momentum"),
    ("pbd", "pins", "pins"), ("xpbd substeps", "pins", "pins"), ("pbd", "velocity", "velocities"),
    ("pbd", "index", "projections"), ("xpbd", "index", "symmetry"),
    ("soft undeclared", "sign", "consistency"), ("soft undeclared", "pins", "pins"),
])  # fmt: skip
def test_a_mistake_in_projections_breaks_a_law(monkeypatch, form, mistake, law):
    report = judged(monkeypatch, form, mistake)
    assert report.verdict is Verdict.WRONG
    assert law in broken(report)


def test_a_power_of_h_of_neither_constraints_nor_compliances_is_a_reservation(monkeypatch):
    report = judged(monkeypatch, "xpbd", "h")
    assert report.verdict is Verdict.RIGHT_EXCEPT
    assert broken(report, Verdict.RIGHT_EXCEPT) == {"order in h"}
