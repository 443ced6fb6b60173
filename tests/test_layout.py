"""The house rules that can be read from the sources: who imports whom, and what stays outside."""

import ast
import functools
import sys
import tomllib
from pathlib import Path, PurePosixPath

import pytest

ROOT = Path(__file__).parents[1]
# Each room, and the rooms that it may import.
GROUND = {"text", "process"}  # the ground floors, folders of `plumbob/`
ROOMS = {
    "text": set(),
    "process": set(),
    "reference": set(),
    "crosscheck": {"reference", *GROUND},
    "verify": {"reference", *GROUND},
    "bench": {"reference", "crosscheck", "verify", *GROUND},
    "plumbob": {"reference", "crosscheck", "verify", "bench", *GROUND},
}
# What the bench may use of the judge: how a solver is asked.
ASKING = {"case", "connections", "exchange", "greeting", "message", "kinematics.robot_models"}
# Lines by room; a later change lowers them, and a reason stands beside a raised one.
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
LINES = PROJECT["tool"]["plumbob"]["lines"]
FOLDERS = set(ROOMS) - GROUND - {"plumbob"}  # linked into `plumbob`, imported as its packages
BENCH = [  # each may import those before it
    "problems", "peers", "measure", "tables", "ranking", "figures", "player", "experiments",
    "compare", "page", "show",
]  # fmt: skip
# llvmlite is numba's own; filelock serves the cache of compiled kernels.
LIBRARIES = {"numpy", "scipy", "numba", "llvmlite", "filelock"}
RUBBISH = {"utils", "util", "helpers", "helper", "common", "misc"}
FILES = {"pathlib", "os", "io", "shutil", "tempfile", "open", "fromfile", "tofile", "loadtxt"}
CLOCKS = {"time", "datetime", "timeit", "perf_counter"}
PRINTS = {"print", "logging", "stdout", "stderr"}


def imported(tree):
    """The dotted names that a module imports absolutely, those in functions included."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Call) and named(node.func) in {"import_module", "__import__"}:
            yield from (str(a.value) for a in node.args[:1] if isinstance(a, ast.Constant))


def imported_room(name):
    """The room that an absolute name lies in; what is not in one of the three is `plumbob`'s."""
    first, *rest = name.split(".")
    if first == "plumbob":
        return rest[0] if rest and rest[0] in ROOMS else "plumbob"
    return first


def relative_steps_out(path, tree):
    """Relative imports that leave the room: they would depend on where the folder is linked."""
    depth = len(path.parts) - 1 - (room(path) in GROUND)
    nodes = (node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom))
    return {node.module for node in nodes if node.level > depth}


def bare_imports(path, tree):
    """Imports of a room by its folder's name, which only work where a checkout is on the path."""
    return {name for name in imported(tree) if name.split(".")[0] in FOLDERS}


def named(node):
    """The last name of an expression such as `a` or `a.b`, or None."""
    return getattr(node, "attr", None) or getattr(node, "id", None)


def used(tree):
    """Every name a module imports or mentions."""
    parts = [part for name in imported(tree) for part in name.split(".")]
    return {*parts, *(named(node) for node in ast.walk(tree))}


def room(path):
    ground = path.parts[0] == "plumbob" and path.parts[1] in GROUND
    return path.parts[ground]


def is_door_for_files(path):
    return path.parts[:2] == ("reference", "formats")


def arrows_against_the_direction(path, tree):
    forbidden = {*ROOMS, "tests", "tools"} - ROOMS[room(path)] - {room(path)}
    return {name for name in imported(tree) if imported_room(name) in forbidden}


def imported_relatively(path, tree):
    """The places in the room that a module imports from, as parts of their paths."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.level:
            above = path.parts[: len(path.parts) - node.level]
            stem = (*above, *(node.module.split(".") if node.module else ()))
            yield from ((*stem, alias.name) for alias in node.names)


def arrows_against_the_direction_in_bench(path, tree):
    """Packages of the bench import those before them; no two import each other."""
    if room(path) != "bench" or len(path.parts) < 3:
        return set()
    later = BENCH[BENCH.index(path.parts[1]) + 1 :]
    return {parts for parts in imported_relatively(path, tree) if parts[1] in later}


def judgements_in_bench(path, tree):
    """Imports by the bench of more of the judge than asking takes."""
    if room(path) != "bench":
        return set()
    prefix = "plumbob.verify."
    names = {name.removeprefix(prefix) for name in imported(tree) if name.startswith(prefix)}
    return {name for name in names if not any(name.startswith(one) for one in ASKING)}


def names_that_say_nothing(path, tree):
    return RUBBISH & {*path.parts, path.stem}


def foreign_imports_in_reference(path, tree):
    if room(path) != "reference":
        return set()
    known = LIBRARIES | set(sys.stdlib_module_names) | {"plumbob"}
    return {name for name in imported(tree) if name.split(".")[0] not in known}


def files_in_reference(path, tree):
    return (
        FILES & used(tree) if room(path) == "reference" and not is_door_for_files(path) else set()
    )


def clocks_in_reference(path, tree):
    parts = {part for name in imported(tree) for part in name.split(".")}
    return CLOCKS & parts if room(path) == "reference" else set()


def prints_in_reference(path, tree):
    return PRINTS & used(tree) if room(path) == "reference" else set()


def definitions_among_the_public_names(path, tree):
    if path != PurePosixPath("plumbob/__init__.py"):
        return set()
    defined = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)
    names = {node.name for node in ast.walk(tree) if isinstance(node, defined)}
    return names - {"__getattr__", "__dir__"}


RULES = [
    arrows_against_the_direction,
    names_that_say_nothing,
    foreign_imports_in_reference,
    files_in_reference,
    clocks_in_reference,
    prints_in_reference,
    definitions_among_the_public_names,
    arrows_against_the_direction_in_bench,
    judgements_in_bench,
    bare_imports,
    relative_steps_out,
]

SLIPS = [
    (arrows_against_the_direction, "reference/a.py", "import plumbob.crosscheck"),
    (arrows_against_the_direction, "reference/formats/a.py", "from plumbob.bench import text"),
    (arrows_against_the_direction, "crosscheck/a.py", "from plumbob.verify.laws import a"),
    (arrows_against_the_direction, "plumbob/text/a.py", "from plumbob.reference import quaternion"),
    (relative_steps_out, "plumbob/process/a.py", "from ..text.printable import visible"),
    (arrows_against_the_direction, "crosscheck/a.py", "def f():\n    import plumbob.bench.run"),
    (arrows_against_the_direction, "crosscheck/a.py", "import_module('plumbob.bench.measure.run')"),
    (arrows_against_the_direction, "bench/a.py", "from tests import conftest"),
    (arrows_against_the_direction, "bench/a.py", "from plumbob import solve_ik"),
    (arrows_against_the_direction, "reference/a.py", "import plumbob"),
    (arrows_against_the_direction_in_bench, "bench/peers/ik/a.py", "from ...measure.run import a"),
    (arrows_against_the_direction_in_bench, "bench/measure/a.py", "from .. import experiments"),
    (arrows_against_the_direction_in_bench, "bench/experiments/b/a.py", "from ...page import a"),
    (judgements_in_bench, "bench/a.py", "from plumbob.verify.laws import LAWS"),
    (bare_imports, "plumbob/a.py", "from reference import solve_ik"),
    (relative_steps_out, "bench/peers/a.py", "from ...reference import solve_ik"),
    (definitions_among_the_public_names, "plumbob/__init__.py", "def f():\n    return 1"),
    (names_that_say_nothing, "reference/utils.py", ""),
    (foreign_imports_in_reference, "reference/a.py", "import pinocchio"),
    (foreign_imports_in_reference, "reference/b/a.py", "from mujoco import MjModel"),
    (files_in_reference, "reference/a.py", "def f(path):\n    return open(path)"),
    (files_in_reference, "reference/a.py", "np.loadtxt('a')"),
    (clocks_in_reference, "reference/a.py", "import time"),
    (clocks_in_reference, "reference/formats/a.py", "from time import perf_counter as now"),
    (prints_in_reference, "reference/a.py", "def f():\n    print(1)"),
    (prints_in_reference, "reference/a.py", "sys.stdout.write('1')"),
]

FINE = [
    ("reference/formats/a.py", "from pathlib import Path\nopen(Path('a'))"),
    ("crosscheck/a.py", "import mujoco\nfrom plumbob.reference import Skeleton\nfrom . import a"),
    ("bench/a.py", "from plumbob.verify.connections import open_connection"),
    ("plumbob/__init__.py", "from .reference import *\ndef __getattr__(name):\n    return 1"),
    ("plumbob/cli/main.py", "from plumbob.bench import text\ndef main():\n    return text"),
    ("bench/a.py", "import time\nfrom plumbob.crosscheck.verdict import a\nprint(time.time())"),
]


parse = functools.lru_cache(maxsize=2000)(ast.parse)


def broken(rule, path, source):
    return rule(PurePosixPath(path), parse(source))


def folder_of(name):
    return f"plumbob/{name}" if name in GROUND else name


@pytest.mark.parametrize("name", ROOMS)
@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.__name__)
def test_room_keeps_the_rules(rule, name):
    sources = sorted((ROOT / folder_of(name)).rglob("*.py"))
    assert sources
    for source in sources:
        path = source.relative_to(ROOT).as_posix()
        assert not broken(rule, path, source.read_text(encoding="utf-8")), path


def test_the_order_names_every_package_of_the_bench():
    packages = {path.parent.name for path in (ROOT / "bench").glob("*/__init__.py")}
    assert packages == set(BENCH)


@pytest.mark.parametrize(("rule", "path", "source"), SLIPS)
def test_rule_sees_the_slip(rule, path, source):
    assert broken(rule, path, source)


@pytest.mark.parametrize(("path", "source"), FINE)
def test_rules_let_good_sources_pass(path, source):
    assert not any(broken(rule, path, source) for rule in RULES)


def test_every_rule_has_a_slip():
    assert {rule for rule, _, _ in SLIPS} == set(RULES)


def lines_of(folder, *endings):
    """The lines of the files of a folder with these endings, links and caches left out."""
    files = [path for ending in endings for path in (ROOT / folder).rglob(f"*.{ending}")]
    return sum(path.read_bytes().count(b"\n") for path in files if "__pycache__" not in path.parts)


@pytest.mark.parametrize("folder", LINES)
def test_room_keeps_its_budget(folder):
    data = lines_of(folder, "toml", "po", "json")
    counts = {"python": lines_of(folder, "py"), "data": data}
    cure = "make it smaller, or raise [tool.plumbob.lines] in pyproject.toml with a reason"
    for kind, limit in LINES[folder].items():
        assert counts[kind] <= limit, f"{folder} has {counts[kind]} lines of {kind}: {cure}"


def test_every_room_and_its_tests_have_a_budget():
    rooms = {folder_of(name) for name in ROOMS} - {"plumbob"}
    assert set(LINES) == rooms | {"plumbob/cli", "tests"}


# Modules of the judge that explain a verdict; all but those that put both together decide it.
DIAGNOSIS = {
    "cause_search", "explain", "fault_programs", "one_line", "observe", "programs", "dictionary",
    "take", "kinematics/claims", "kinematics/early_ends", "mass_spring/iterations",
}  # fmt: skip
BOTH = {"verify", "disciplines", "self_test", "pytest_laws", "connections", "screen", "templates"}


def explains(parts):
    """Whether parts of a path in the judge lead to a module that explains verdicts."""
    paths = {"/".join(parts[:end]) for end in range(1, len(parts) + 1)}
    return bool(paths & DIAGNOSIS) or any(part.endswith("_diagnosis") for part in parts)


def test_no_module_that_decides_a_verdict_imports_one_that_explains_it():
    paths = [p.relative_to(ROOT) for p in (ROOT / "verify").rglob("*.py")]
    deciding = [p for p in paths if not explains(p.with_suffix("").parts[1:])]
    deciding = [p for p in deciding if p.with_suffix("").parts[1] not in BOTH]
    assert len(deciding) > 40
    wrong = {
        (path.as_posix(), ".".join(parts))
        for path in deciding
        for parts in imported_relatively(path, ast.parse((ROOT / path).read_text("utf-8")))
        if explains(parts[1:])
    }
    assert not wrong
