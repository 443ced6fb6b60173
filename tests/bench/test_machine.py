"""The stamp: it changes with whatever can change a number, and names no one."""

import socket

from bench import machine


def test_the_digest_changes_with_a_source_and_with_nothing_else(tmp_path, monkeypatch):
    monkeypatch.setattr(machine, "_ROOT", tmp_path)
    monkeypatch.setattr(machine, "_SOURCES", ("reference", "bench/run.py"))
    (tmp_path / "reference" / "deep").mkdir(parents=True)
    (tmp_path / "bench").mkdir()
    source = tmp_path / "reference" / "deep" / "a.py"
    source.write_text("x = 1")
    (tmp_path / "bench" / "run.py").write_text("")
    before = machine.source_digest()
    (tmp_path / "reference" / "notes.txt").write_text("new")
    assert machine.source_digest() == before
    source.write_text("x = 2")
    changed = machine.source_digest()
    assert changed != before
    source.rename(source.with_name("b.py"))
    assert machine.source_digest() not in (before, changed)


def test_every_source_that_is_named_exists():
    assert all((machine._ROOT / name).exists() for name in machine._SOURCES)


def test_the_stamp_names_machine_and_versions_but_no_host():
    stamp = machine.stamp()
    assert stamp["machine"]["cores"] >= 1
    assert all(stamp["versions"][name] for name in ("python", "numpy", "mujoco", "pin"))
    assert socket.gethostname() not in str(stamp)


def test_a_package_that_is_missing_has_an_empty_version(monkeypatch):
    monkeypatch.setattr(machine, "PACKAGES", ("no-such-package-anywhere",))
    assert machine.versions()["no-such-package-anywhere"] == ""
