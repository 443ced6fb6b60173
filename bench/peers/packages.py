"""The packages of peers: their versions, their environments, the command to install them."""

import functools
import importlib.metadata
import json
import shlex
import sys
from pathlib import Path
from urllib.parse import urlsplit
from urllib.request import url2pathname

_PACKAGE = "plumbob"


def environment_python(name: str) -> Path:
    """Return the path of the Python of a peer's environment, which need not exist.

    Peers with requirements in conflict with ours have environments of their own. `make peers` makes
    these as `peers/NAME` below the environment of the bench.
    """
    place = "Scripts/python.exe" if sys.platform == "win32" else "bin/python"
    return Path(sys.prefix, "peers", name, place)


def distribution_of(package: str, environment: str = "") -> importlib.metadata.Distribution | None:
    """Return a package in a peer's environment, or in ours if "", None if missing."""
    places = map(str, Path(sys.prefix, "peers", environment).glob("lib/python*/site-packages"))
    path = list(places) if environment else sys.path
    return next(iter(importlib.metadata.distributions(name=package, path=path)), None)


@functools.cache
def version(package: str, environment: str = "") -> str:
    """Return the version of a package in a peer's environment, or in ours if "", "" if missing."""
    distribution = distribution_of(package, environment)
    return distribution.version if distribution else ""


@functools.cache
def peers_command() -> str:
    """Return the command to install the peers into the environment of this Plumbob."""
    distributions = importlib.metadata.distributions(name=_PACKAGE)
    texts = filter(None, (d.read_text("direct_url.json") for d in distributions))
    origin = json.loads(next(texts, "{}"))
    url, revision = origin.get("url", ""), origin.get("vcs_info", {})
    folder = url2pathname(urlsplit(url).path) if "dir_info" in origin else ""
    if folder and Path(sys.prefix) == Path(folder, ".venv"):
        return "make peers"
    if folder:
        is_editable = origin["dir_info"].get("editable", False)
        return f"pip install {'-e ' * is_editable}{shlex.quote(f'{folder}[peers]')}"
    prefix = f"{revision['vcs']}+" if revision else ""
    place = f" @ {prefix}{url}" if url else ""
    return f"pip install '{_PACKAGE}[peers]{place}'"
