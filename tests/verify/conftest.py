"""What tests of `verify` leave out, where no cause is asserted."""

import sys

import pytest

import plumbob.verify.verify  # noqa: F401
from plumbob.verify.cause_search import NoSearch


@pytest.fixture
def without_changed_lines(monkeypatch):
    """Search no changed lines, seconds for each unknown mistake."""
    module = sys.modules["plumbob.verify.verify"]
    monkeypatch.setattr(module, "with_changed_line", lambda report, *arguments: report)


@pytest.fixture
def verdict_alone(monkeypatch):
    """Seek no cause of wrong answers: the verdict does not depend on it."""
    monkeypatch.setattr(sys.modules["plumbob.verify.verify"], "CauseSearch", NoSearch)
