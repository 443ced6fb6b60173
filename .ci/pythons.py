"""Check that Plumbob installs and passes its tests on every Python that it names.

    wheels    the locks install from wheels alone on every Python and machine below
    tests     the tests pass on every one of these Pythons that this machine has, from the lock
    lowest    the tests pass on the oldest of them with the lowest versions of pyproject.toml

What follows the command goes to pytest. `make wheels`, `make test-pythons` and `make test-lowest`
call it. All need the network, the first and the last also uv (UV says where it is).
"""

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
LOCK = ROOT / "requirements.lock"
PYTHONS = ("3.11", "3.12", "3.13", "3.14")
PLATFORMS = ("x86_64-manylinux_2_28", "aarch64-manylinux_2_28", "aarch64-apple-darwin")
# Of peers there are wheels for later systems only: Debian 12, Ubuntu 22.04, macOS 15.
LATER = ("x86_64-manylinux_2_35", "aarch64-manylinux_2_35", "aarch64-apple-darwin")
LOCKS = {
    LOCK: PLATFORMS,
    ROOT / "requirements-docs.lock": PLATFORMS,
    ROOT / "requirements-peers.lock": LATER,
    ROOT / "requirements-placo.lock": LATER,
}
MACOS = {PLATFORMS: "13.0", LATER: "15.0"}
EXTRAS = ("robots", "test")
VENVS = ROOT / "build" / "pythons"


def without_wheels(
    lock: Path, pythons: Iterable[str] = PYTHONS, platforms: Iterable[str] = PLATFORMS
) -> list[str]:
    """Return a sentence for each Python and platform on which a lock needs more than wheels."""
    machines = [(python, platform) for python in pythons for platform in platforms]
    return [
        f"Python {python} on {platform}: {why}"
        for python, platform in machines
        if (why := _refusal(lock, python, platform))
    ]


def _refusal(lock: Path, python: str, platform: str) -> str:
    """Return why uv would not install a lock there, "" if it would; nothing is installed."""
    target = ("--python-version", python, "--python-platform", platform, "--target", "nowhere")
    run = subprocess.run(
        [uv(), "pip", "install", "--dry-run", "--quiet", "--python", sys.executable, *target,
         "--only-binary", ":all:", "--require-hashes", "--requirements", str(lock)],
        capture_output=True, text=True, check=False, cwd=tempfile.gettempdir(),
        env={**_environment(), "MACOSX_DEPLOYMENT_TARGET": MACOS[LOCKS[lock]]},
    )  # fmt: skip
    return " ".join(run.stderr.split()) or "uv fails silently" if run.returncode else ""


def installed() -> Iterator[tuple[str, Path]]:
    """Yield the Pythons of our list that this machine has: on the path, or of pyenv's."""
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"
    for version in PYTHONS:
        on_path = shutil.which(f"python{version}")
        places = [*sorted(pyenv.glob(f"{version}.*/bin/python")), *([on_path] if on_path else [])]
        found = next((Path(place) for place in places if _version(place) == version), None)
        if found:
            yield version, found


def _version(python: str | Path) -> str:
    """Return a Python's version as "3.12", "" if it does not start."""
    ask = "import sys; print('%d.%d' % sys.version_info[:2])"
    run = subprocess.run([python, "-c", ask], capture_output=True, text=True, check=False)
    return run.stdout.strip()


def test(name: str, python: Path, requirements: Path, options: list[str]) -> bool:
    """Return whether the tests pass in an environment made anew from pinned requirements."""
    print(f"== {name}", flush=True)
    home = VENVS / name
    hashed = ["--require-hashes"] if "--hash" in requirements.read_text(encoding="utf-8") else []
    pip = [home / "bin" / "python", "-m", "pip", "install", "--quiet"]
    steps = (
        [python, "-m", "venv", "--clear", home],
        [*pip, *hashed, "--only-binary", ":all:", "-r", requirements],
        [*pip, "--no-deps", "-e", ROOT],
        [home / "bin" / "python", "-m", "pytest", *options],
    )
    # Compiled kernels of one version of numba would push those of another out of __pycache__.
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(home / "numba")}
    return all(
        subprocess.run(step, cwd=ROOT, check=False, env=environment).returncode == 0
        for step in steps
    )


def lowest() -> Path:
    """Return a file that pins the lowest versions pyproject.toml allows on the oldest Python."""
    pinned = VENVS / "lowest.txt"
    extras = [word for extra in EXTRAS for word in ("--extra", extra)]
    subprocess.run(
        [uv(), "pip", "compile", "pyproject.toml", *extras, "--resolution", "lowest-direct",
         "--python-version", PYTHONS[0], "--only-binary", ":all:", "--quiet", "-o", pinned],
        check=True, env=_environment(), cwd=ROOT, stdout=subprocess.DEVNULL,
    )  # fmt: skip
    return pinned


def uv() -> str:
    """Return how uv is called: what UV says, or what is on the path."""
    found = shutil.which(os.environ.get("UV", "uv"))
    return str(Path(found).absolute()) if found else sys.exit("uv: not found; pip install uv")


def _environment() -> dict[str, str]:
    return {**os.environ, "UV_PYTHON_DOWNLOADS": "never"}


def main(command: str = "", *options: str) -> int:
    """Run one of the checks; 0 if it holds, 1 if not, 2 if there is no such check."""
    VENVS.mkdir(parents=True, exist_ok=True)
    pythons = dict(installed())
    if command == "wheels":
        refused = {lock: without_wheels(lock, platforms=where) for lock, where in LOCKS.items()}
        for lock, why in refused.items():
            said = why or [f"wheels for all of {', '.join(PYTHONS)}"]
            print("\n".join(f"{lock.name}: {line}" for line in said), flush=True)
        return any(refused.values())
    if command == "tests":
        absent = sorted({*PYTHONS} - {*pythons})
        print(f"here: {', '.join(pythons)}; not here: {', '.join(absent)}", flush=True)
        passed = [test(name, at, LOCK, [*options]) for name, at in pythons.items()]
        return not all(passed)
    if command == "lowest":
        return not test("lowest", pythons[PYTHONS[0]], lowest(), [*options])
    print(__doc__)
    return 2


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
