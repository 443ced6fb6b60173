"""The locks and the script that holds them against every Python; the network is never asked."""

import importlib.util
import re
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet

ROOT = Path(__file__).parents[1]
LOCKS = [ROOT / f"requirements{which}.lock" for which in ("", "-peers", "-placo")]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
LINUX, ARM, MAC = ("linux", "x86_64"), ("linux", "aarch64"), ("darwin", "arm64")


@pytest.fixture(scope="session")
def pythons():
    """The script, as a module."""
    spec = importlib.util.spec_from_file_location("pythons", ROOT / ".ci" / "pythons.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def blocks(text):
    """Each requirement of a lock with its hashes and comments."""
    return re.split(r"\n(?=\S)", text.strip())


def pins(text):
    return [Requirement(block.partition("\\")[0].strip()) for block in blocks(text)]


def needed(text, python, machine):
    """The names of what a lock installs there."""
    where = {
        "python_version": python,
        "python_full_version": f"{python}.0",
        "sys_platform": machine[0],
        "platform_machine": machine[1],
    }
    return {pin.name for pin in pins(text) if not pin.marker or pin.marker.evaluate(where)}


def has_no_wheel(python):
    """What is known to have no wheel there; `make wheels` asks about everything."""
    return {"labmaze", "dm-control"} if python in ("3.13", "3.14") else set()


@pytest.mark.parametrize("lock", LOCKS, ids=lambda path: path.name)
def test_everything_is_pinned_with_hashes_and_no_host_is_named(lock):
    text = lock.read_text(encoding="utf-8")
    assert "://" not in text
    assert "--index" not in text
    for block, pin in zip(blocks(text), pins(text), strict=True):
        assert "--hash=sha256:" in block, pin
        assert [part.operator for part in pin.specifier] == ["=="]


@pytest.mark.parametrize("machine", [LINUX, ARM, MAC], ids="-".join)
def test_what_has_no_wheel_is_left_out_by_its_marker(pythons, machine):
    text = LOCKS[0].read_text(encoding="utf-8")
    for python in pythons.PYTHONS:
        assert not needed(text, python, machine) & has_no_wheel(python)
        assert {"numpy", "numba", "pin", "mujoco", "gymnasium"} <= needed(text, python, machine)
        unmarked = re.sub(r" ; .*? \\\n", " \\\n", text)
        assert needed(unmarked, python, machine) >= has_no_wheel(python)


@pytest.mark.parametrize("lock", LOCKS[:2], ids=lambda path: path.name)
def test_pinocchio_is_left_out_on_windows(pythons, lock):
    text = lock.read_text(encoding="utf-8")
    for python in pythons.PYTHONS:
        names = needed(text, python, ("win32", "AMD64"))
        assert not {"pin", "libpinocchio", "coal", "pin-pink"} & names
        assert {"numba", "mujoco"} <= names


def peers_without_wheels(python, machine):
    """The peers that are known to have no wheel there, or none that goes with the other locks."""
    has = {
        "pytracik": machine != ARM and python != "3.14",
        "eaik": python != "3.14",
        "drake": {LINUX: True, ARM: python != "3.11", MAC: python in ("3.13", "3.14")}[machine],
        "dartpy": machine != MAC or python != "3.11",
        "pybullet": machine == LINUX and python == "3.11",
    }
    return {name for name, there in has.items() if not there}


@pytest.mark.parametrize("machine", [LINUX, ARM, MAC], ids="-".join)
def test_each_peer_is_asked_for_where_it_has_a_wheel_and_nowhere_else(pythons, machine):
    peers, placo = (lock.read_text(encoding="utf-8") for lock in LOCKS[1:])
    marked = {"pytracik", "eaik", "drake", "dartpy", "pybullet"}
    for python in pythons.PYTHONS:
        missing = peers_without_wheels(python, machine)
        assert marked & needed(peers, python, machine) == marked - missing
        assert ("placo" in needed(placo, python, machine)) == (python != "3.14")


def test_the_locks_hold_what_the_project_asks_for(pythons):
    extras = [PROJECT["optional-dependencies"][extra] for extra in pythons.EXTRAS]
    text = LOCKS[0].read_text(encoding="utf-8")
    pinned = {pin.name: pin.specifier for pin in pins(text)}
    for wanted in map(Requirement, sum(extras, PROJECT["dependencies"])):
        (pin,) = {str(part.version) for part in pinned[wanted.name.replace("_", "-")]}
        assert pin in wanted.specifier, wanted


def test_the_same_pythons_are_named_everywhere(pythons):
    first, last = pythons.PYTHONS[0], pythons.PYTHONS[-1]
    assert f"Python {first} to {last}" in (ROOT / "README.md").read_text(encoding="utf-8")
    assert f"Python {first} to {last}" in (ROOT / "Makefile").read_text(encoding="utf-8")
    assert set(SpecifierSet(PROJECT["requires-python"]).filter(pythons.PYTHONS)) == set(
        pythons.PYTHONS
    )
