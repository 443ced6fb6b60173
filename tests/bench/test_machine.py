"""The stamp: it changes with whatever can change a number, and names no one."""

import ast
import shutil
import socket
import symtable
import sys
from pathlib import Path

import pytest

from plumbob.bench.measure import machine

PACKAGES = ("reference", "crosscheck", "verify", "bench", "plumbob/process")
ROOT = Path(machine.__file__).resolve().parents[2]


@pytest.fixture
def copy(tmp_path, monkeypatch):
    """A copy of all sources, which is what is digested."""
    for name in PACKAGES:
        ignored = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / name, tmp_path / name, ignore=ignored)
    monkeypatch.setattr(machine, "ROOT", tmp_path)
    return tmp_path


def every_file(root):
    found = [path for name in PACKAGES for path in sorted((root / name).rglob("*"))]
    return [path for path in found if path.is_file() and "__pycache__" not in path.parts]


def only_shows(path):
    if path.is_relative_to("bench/experiments"):
        return path.suffix == ".toml"
    return any(path.is_relative_to(name) for name in machine.PRESENTATION)


def test_an_edit_of_any_file_changes_the_digest_unless_it_only_shows_numbers(copy):
    files = machine.source_files()
    assert files == sorted(p for p in every_file(copy) if not only_shows(p.relative_to(copy)))
    once_left_out = ("peers/cloth/plumbob.py", "experiments/cloth_peers.py")
    assert {copy / "bench" / name for name in once_left_out} <= set(files)
    assert all((copy / name).exists() for name in machine.PRESENTATION)
    digests = {machine.source_digest()}
    for path in files[::150]:
        path.write_bytes(path.read_bytes() + b"\n")
        digests.add(machine.source_digest())
    assert len(digests) == 1 + len(files[::150])


def test_a_new_file_and_a_new_name_change_the_digest_and_a_compiled_cache_does_not(copy):
    digests = {machine.source_digest()}
    new = copy / "bench" / "peers" / "new.py"
    new.write_text("")
    digests.add(machine.source_digest())
    new.rename(new.with_name("newer.py"))
    digests.add(machine.source_digest())
    assert len(digests) == 3
    cache = copy / "reference" / "__pycache__"
    cache.mkdir()
    (cache / "kernel.nbi").write_text("")
    assert machine.source_digest() in digests


def test_of_an_experiment_only_the_text_above_its_tables_is_digested(copy):
    path = copy / "bench" / "experiments" / "swing.py"
    digests = []
    for measuring, shown in (("h = 1", ""), ("h = 1", "unit = 's'"), ("h = 2", "unit = 's'")):
        path.write_text(f"{measuring}\n\n\n# What is shown.\n{shown}\n")
        digests.append(machine.source_digest())
    path.with_suffix(".toml").write_text("[swing]")
    digests.append(machine.source_digest())
    assert digests[0] == digests[1] != digests[2] == digests[3]


EXPERIMENT_FILES = [
    path
    for path in sorted((ROOT / "bench" / "experiments").glob("*.py"))
    if machine.DIVIDER in path.read_bytes()
]


def bound_names(text):
    """The names that a module binds at its head."""
    symbols = symtable.symtable(text, "", "exec").get_symbols()
    return {s.get_name() for s in symbols if s.is_assigned() or s.is_imported() or s.is_namespace()}


def read_names(table):
    """The names of a module that it reads, also in its functions."""
    is_module = table.get_type() == "module"
    for symbol in table.get_symbols():
        if symbol.is_referenced() and (is_module or symbol.is_global()):
            yield symbol.get_name()
    for child in table.get_children():
        yield from read_names(child)


def test_a_name_read_in_a_function_is_seen():
    text = "def mean(r):\n    x = r\n    return [label(y) for y in x]"
    assert {*read_names(symtable.symtable(text, "", "exec"))} == {"label"}


@pytest.mark.parametrize("path", EXPERIMENT_FILES, ids=lambda path: path.stem)
def test_a_measurement_reads_no_name_bound_below_the_digested_text(path):
    measuring = machine.measuring_part(path).decode()
    bound = bound_names(measuring)
    bound_below = bound_names(path.read_text(encoding="utf-8")[len(measuring) :])
    read = {*read_names(symtable.symtable(measuring, "", "exec"))}
    assert read & bound_below == set()
    assert bound & bound_below == set()


def imported(path, root):
    """The files that a source may import, in a function or at its head, by any form of import."""
    package = path.relative_to(root).parent.parts
    for node in ast.walk(ast.parse(machine.measuring_part(path))):
        if isinstance(node, ast.Import):
            names = [alias.name.split(".") for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = list(package[: len(package) + 1 - node.level]) if node.level else []
            base += node.module.split(".") if node.module else []
            names = [base, *([*base, alias.name] for alias in node.names)]
        elif isinstance(node, ast.Constant) and str(node.value).startswith("plumbob.bench."):
            names = [node.value.split(".")]  # a module by its name, as adapters are
        else:
            continue
        for name in names:
            path = Path(*name[name[:1] == ["plumbob"] :])
            yield Path(f"{path}.py")
            yield path / "__init__.py"


def imports_of_presentation(path):
    """Each file reaches only what its imports do, so to look at single imports suffices."""
    return [name for name in imported(path, ROOT) if only_shows(name) and (ROOT / name).is_file()]


def test_measurements_never_import_presentation():
    sources = [path for path in every_file(ROOT) if path.suffix == ".py"]
    measuring = [path for path in sources if not only_shows(path.relative_to(ROOT))]
    assert {path: names for path in measuring if (names := imports_of_presentation(path))} == {}


@pytest.mark.parametrize(
    "line",
    [
        "import plumbob.bench.page.report",
        "from ..page import sections",
        "from plumbob.bench.page import sections",
        "def f():\n    from ..tables.results import label",
        'importlib.import_module("plumbob.bench.tables.results")',
    ],
)
def test_an_import_of_presentation_is_found(tmp_path, monkeypatch, line):
    path = tmp_path / "bench" / "measure" / "metrics.py"
    path.parent.mkdir(parents=True)
    path.write_text(line)
    for name in ("page/report.py", "page/sections.py", "tables/results.py"):
        (tmp_path / "bench" / name).parent.mkdir(exist_ok=True)
        (tmp_path / "bench" / name).touch()
    monkeypatch.setattr(sys.modules[__name__], "ROOT", tmp_path)
    assert imports_of_presentation(path)


def test_the_stamp_names_machine_and_versions_but_no_host(monkeypatch):
    stamp = machine.stamp()
    assert stamp["machine"]["cores"] >= 1
    assert all(stamp["versions"][name] for name in ("python", "numpy", "mujoco", "pin"))
    assert socket.gethostname() not in str(stamp)
    monkeypatch.setattr(machine, "PACKAGES", ("no-such-package-anywhere",))
    assert machine.versions()["no-such-package-anywhere"] == ""
