"""Problems of a user's own from files: Python, URDF, MJCF, BVH, OBJ, or a folder of these."""

import hashlib
import importlib.util
import inspect
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from plumbob.reference import MassSpring, Skeleton, State
from plumbob.reference.formats.source import read_bytes, read_text

from ..experiments.chain.problem import TargetsForSkeleton
from ..experiments.robots.problem import ALL
from . import models
from .opening import clean
from .problems import OwnProblem

SUFFIXES = (".py", ".urdf", ".xml", ".mjcf", ".bvh", ".obj")
LIST = "PROBLEMS"
_GRAVITY = (0.0, -9.81, 0.0)


def read(
    words: Sequence[str], suites: Sequence[str], effector: str | None, pins: str | None
) -> tuple[list[OwnProblem], list[str]]:
    """Return the problems in files, and the names of all problems that are meant.

    Raises:
        ValueError: if a file cannot be read, or holds nothing that the suites ask.
    """
    own: list[OwnProblem] = []
    names: list[str] = []
    for word in words:
        path = Path(word)
        if not path.exists() and path.suffix.lower() not in SUFFIXES:
            names.append(word)
            continue
        found = [one for one in _in(path, effector, pins) if one.suite in suites]
        if not found:
            raise ValueError(f"problem: expected one for {' or '.join(suites)}, got {word}")
        own += found
        names += [name for one in found for name in one.recorded]
    doubled = [name for i, name in enumerate(names) if name in names[:i]]
    if doubled:
        raise ValueError(f"problem: expected different names, got {doubled[0]!r} twice")
    return own, names


def _in(path: Path, effector: str | None, pins: str | None) -> list[OwnProblem]:
    if path.is_dir():
        files = sorted(one for one in path.iterdir() if one.suffix.lower() in SUFFIXES)
        return [one for file in files for one in _in(file, effector, pins)]
    if not path.is_file():
        raise ValueError(f"problem: expected a file or a folder, got {path}, which does not exist")
    suffix, digest = path.suffix.lower(), _digest(read_bytes(path))
    name = clean(path.stem)
    if suffix == ".py":
        return [_of_dict(*made) for made in _in_python(path)]
    if suffix == ".bvh":
        return [
            OwnProblem(clean(f"{name}, {made.title.rpartition(', ')[2]}"), digest, "ik", made)
            for made in models.skeletons(path, effector)
        ]
    if suffix == ".obj":
        cloth = models.cloth(path, pins)
        return [OwnProblem(name, _digest(digest.encode(), cloth[0].pinned), "cloth", cloth=cloth)]
    if suffix == ".xml" and "<mujoco" not in read_text(path):
        raise ValueError(f"{path}: expected MJCF, URDF, BVH, OBJ or Python, got other XML")
    name = f"{name} of yours" if name in ALL else name
    robot = models.robot(path, name, effector)
    return [OwnProblem(name, _digest(robot.text.encode()), "ik", robot=robot)]


def _digest(content: bytes, *arrays: Any) -> str:
    digest = hashlib.sha256(content)
    for array in arrays:
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()[:12]


def _in_python(path: Path) -> Iterator[tuple[Path, str, Mapping[str, Any]]]:
    """Yield the name and the dict of each function without arguments, and of the list."""
    spec = importlib.util.spec_from_file_location(f"problems_{path.stem}", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    _tried(path, lambda: spec.loader.exec_module(module))  # type: ignore[union-attr]
    makers: list[tuple[str, Callable[[], Any]]] = [
        (name, made) for name, made in vars(module).items()
        if inspect.isfunction(made) and made.__module__ == module.__name__
        and name[0] != "_" and not inspect.signature(made).parameters
    ]  # fmt: skip
    listed = getattr(module, LIST, [])
    makers += [(f"problem {i + 1}", partial(_as_it_is, one)) for i, one in enumerate(listed)]
    if not makers:
        raise ValueError(f"{path}: expected functions without arguments or {LIST}, got none")
    for name, make in makers:
        made = _tried(path, make)
        if not isinstance(made, Mapping):
            raise ValueError(f"{path}: {name}: expected a dict, got {type(made).__name__}")
        yield path, str(made.get("name", name)), made


def _as_it_is(made: object) -> object:
    return made


def _tried(path: Path, call: Callable[[], Any]) -> Any:
    try:
        return call()
    except (Exception, SystemExit) as error:
        why = " ".join(f"{type(error).__name__}: {error}".split())[:200]
        raise ValueError(f"{path}: expected problems, got {why}") from None


def _of_dict(path: Path, name: str, given: Mapping[str, Any]) -> OwnProblem:
    """Return the problem of a dict: a cloth if it has springs, else targets of a skeleton."""
    make = _cloth if "springs" in given else _skeleton
    try:
        return make(clean(name), given)
    except (KeyError, TypeError, ValueError, IndexError) as error:
        what = f"lacks {error}" if isinstance(error, KeyError) else str(error)
        raise ValueError(f"{path}: {name}: {what}") from None


def _skeleton(name: str, given: Mapping[str, Any]) -> OwnProblem:
    known = {"name", "parents", "offsets", "skeleton", "targets", "starts", "effector"}
    _check_keys(given, known)
    if isinstance(given.get("skeleton"), Skeleton):
        parents, offsets = given["skeleton"].parents, given["skeleton"].offsets
    else:
        parents, offsets = given.get("skeleton") or (given["parents"], given["offsets"])
    whole = Skeleton(parents, offsets)
    effector = int(given.get("effector", whole.joint_count - 1))
    if not 0 <= effector < whole.joint_count:
        raise ValueError(f"effector: expected 0 to {whole.joint_count - 1}, got {effector}")
    targets = np.asarray(given["targets"], dtype=float)
    if targets.ndim != 2 or targets.shape[1] != 3 or not np.isfinite(targets).all():
        raise ValueError(f"targets: expected finite numbers (target, 3), got {targets.shape}")
    still = np.tile([1.0, 0.0, 0.0, 0.0], (whole.joint_count, 1))
    starts = np.asarray(given.get("starts", still), dtype=float)
    if starts.shape not in ((whole.joint_count, 4), (len(targets), whole.joint_count, 4)):
        raise ValueError(f"starts: expected (joint, 4) or (target, joint, 4), got {starts.shape}")
    path = whole.path(effector)
    chain, starts = models.path_to(whole.parents, whole.offsets, effector), starts[..., path, :]
    made = TargetsForSkeleton(f"chain/{name}", name, chain, starts, targets)
    digest = _digest(b"", chain.offsets, starts, targets)
    return OwnProblem(name, digest, "ik", made)


def _cloth(name: str, given: Mapping[str, Any]) -> OwnProblem:
    known = {"name", "positions", "springs", "stiffness", "masses", "pinned", "velocities",
             "gravity", "rest_lengths", "h"}  # fmt: skip
    _check_keys(given, known)
    x = np.asarray(given["positions"], dtype=float)
    springs = np.asarray(given["springs"])
    ends = x[springs[:, 0]] - x[springs[:, 1]]
    rest = given.get("rest_lengths", np.linalg.norm(ends, axis=1))
    masses = np.broadcast_to(np.asarray(given["masses"], dtype=float), (len(x),))
    stiffness = np.broadcast_to(np.asarray(given["stiffness"], dtype=float), (len(springs),))
    system = MassSpring(
        masses, springs, rest, stiffness, np.zeros(len(springs)), given.get("pinned", ()),
        given.get("gravity", _GRAVITY),
    )  # fmt: skip
    h = float(given.get("h", 1 / 60))
    if not 0.0 < h < np.inf:
        raise ValueError(f"h: expected seconds above 0, got {h}")
    state = State(x, np.asarray(given.get("velocities", np.zeros_like(x)), dtype=float))
    arrays = (x, springs, system.rest_lengths, masses, stiffness, system.pinned, system.gravity)
    digest = _digest(repr(h).encode(), *arrays, state.velocities)
    return OwnProblem(name, digest, "cloth", cloth=(system, state), h=h)


def _check_keys(given: Mapping[str, Any], known: set[str]) -> None:
    if unknown := given.keys() - known:
        one = min(map(str, unknown))
        raise ValueError(f"expected keys of {', '.join(sorted(known))}, got {one!r}")
