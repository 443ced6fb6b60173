"""Programs of other languages, built once a session."""

import functools
import sys

import planted_programs
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


@pytest.fixture(scope="session")
def program(tmp_path_factory):
    """Return what runs a right program by language; skip where its compiler is missing."""
    build = functools.cache(planted_programs.command)
    folder = tmp_path_factory.mktemp("programs")

    def built(language):
        run = build(language, folder)
        if run is None:
            pytest.skip(f"no compiler or interpreter for {language} on this machine")
        return run

    return built
