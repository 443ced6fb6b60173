"""Problems of a user's own from files: Python, URDF, MJCF, BVH, OBJ, or a folder of these."""

import hashlib
import importlib.util
import inspect
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from plumbob.reference import MassSpring, Skeleton, State
from plumbob.reference.formats.source import read_bytes, read_text

from . import models
from .chains import TargetsForSkeleton
from .own import OwnProblem, clean
from .robots import ROBOTS

SUFFIXES = (".py", ".urdf", ".xml", ".mjcf", ".bvh", ".obj")
LIST = "PROBLEMS"
_OF_SKELETON = {"name", "parents", "offsets", "skeleton", "targets", "starts", "effector"}
_OF_CLOTH = {"name", "positions", "springs", "stiffness", "masses", "pinned", "velocities"}
_OF_CLOTH |= {"gravity", "rest_lengths", "h"}


def read(
    words: Sequence[str], suites: Sequence[str], effector: str | None, pins: str | None
) -> tuple[list[OwnProblem], list[str]]:
    """Return the problems in files, and the names of all selected problems.

    Raises:
        ValueError: if a file cannot be read, or has no problem for the suites.
    """
    own: list[OwnProblem] = []
    names: list[str] = []
    for word in words:
        path = Path(word)
        if not path.exists() and path.suffix.lower() not in SUFFIXES:
            names.append(word)
            continue
        problems = [problem for problem in _read(path, effector, pins) if problem.suite in suites]
        if not problems:
            raise ValueError(f"problem: expected one for {' or '.join(suites)}, got {word}")
        own += problems
        names += [name for problem in problems for name in problem.recorded]
    doubled = [name for i, name in enumerate(names) if name in names[:i]]
    if doubled:
        raise ValueError(f"problem: expected different names, got {doubled[0]!r} twice")
    return own, names


def _read(path: Path, effector: str | None, pins: str | None) -> list[OwnProblem]:
    if path.is_dir():
        files = sorted(file for file in path.iterdir() if file.suffix.lower() in SUFFIXES)
        return [problem for file in files for problem in _read(file, effector, pins)]
    if not path.is_file():
        raise ValueError(f"problem: expected a file or a folder, got {path}, which does not exist")
    suffix, name, digest = path.suffix.lower(), clean(path.stem), _digest(read_bytes(path))
    if suffix == ".py":
        return [_of_dict(path, name, fields) for name, fields in _in_python(path)]
    if suffix == ".bvh":
        skeletons = models.skeletons(path, name, effector)
        return [OwnProblem(targets.title, digest, "ik", targets) for targets in skeletons]
    if suffix == ".obj":
        cloth = models.cloth(path, pins)
        return [OwnProblem(name, _digest(digest.encode(), cloth[0].pinned), "cloth", cloth=cloth)]
    if suffix == ".xml" and "<mujoco" not in read_text(path):
        raise ValueError(f"{path}: expected MJCF, URDF, BVH, OBJ or Python, got other XML")
    name = f"{name} of yours" if name in ROBOTS else name
    robot = models.robot(path, name, effector)
    return [OwnProblem(name, _digest(robot.text.encode()), "ik", robot=robot)]


def _digest(content: bytes, *arrays: Any) -> str:
    digest = hashlib.sha256(content)
    for array in arrays:
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()[:12]


def _in_python(path: Path) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield the name and the dict of each function without arguments, and of the list."""
    problems: list[tuple[str, Any]] = []
    try:
        spec = importlib.util.spec_from_file_location(f"problems_{path.stem}", path)
        assert spec is not None and spec.loader is not None  # noqa: PT018
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        for name, member in vars(module).items():
            is_own = inspect.isfunction(member) and member.__module__ == module.__name__
            if is_own and name[0] != "_" and not inspect.signature(member).parameters:
                problems.append((name, member()))
        listed = enumerate(getattr(module, LIST, []), 1)
        problems += [(f"problem {i}", fields) for i, fields in listed]
    except (Exception, SystemExit) as error:
        why = " ".join(f"{type(error).__name__}: {error}".split())[:200]
        raise ValueError(f"{path}: expected problems, got {why}") from None
    if not problems:
        raise ValueError(f"{path}: expected functions without arguments or {LIST}, got none")
    for name, fields in problems:
        if not isinstance(fields, Mapping):
            raise ValueError(f"{path}: {name}: expected a dict, got {type(fields).__name__}")
        yield clean(str(fields.get("name", name))), fields


def _of_dict(path: Path, name: str, fields: Mapping[str, Any]) -> OwnProblem:
    """Return the problem of a dict: a cloth if it has springs, else targets of a skeleton."""
    read_fields, allowed = (_cloth, _OF_CLOTH) if "springs" in fields else (_skeleton, _OF_SKELETON)
    try:
        if unknown := sorted(map(str, fields.keys() - allowed)):
            raise ValueError(f"expected keys of {', '.join(sorted(allowed))}, got {unknown[0]!r}")
        return read_fields(name, fields)
    except (KeyError, TypeError, ValueError, IndexError) as error:
        why = f"lacks {error}" if isinstance(error, KeyError) else str(error)
        raise ValueError(f"{path}: {name}: {why}") from None


def _skeleton(name: str, fields: Mapping[str, Any]) -> OwnProblem:
    skeleton = fields.get("skeleton")
    if not isinstance(skeleton, Skeleton):
        skeleton = Skeleton(*(skeleton or (fields["parents"], fields["offsets"])))
    count = skeleton.joint_count
    effector = int(fields.get("effector", count - 1))
    if not 0 <= effector < count:
        raise ValueError(f"effector: expected 0 to {count - 1}, got {effector}")
    targets = np.asarray(fields["targets"], dtype=float)
    if targets.ndim != 2 or targets.shape[1] != 3 or not np.isfinite(targets).all():
        raise ValueError(f"targets: expected finite numbers (target, 3), got {targets.shape}")
    rest = np.tile([1.0, 0.0, 0.0, 0.0], (count, 1))
    starts = np.asarray(fields.get("starts", rest), dtype=float)
    if starts.shape not in ((count, 4), (len(targets), count, 4)):
        raise ValueError(f"starts: expected (joint, 4) or (target, joint, 4), got {starts.shape}")
    chain, starts = models.path_to(skeleton, effector), starts[..., skeleton.path(effector), :]
    problem = TargetsForSkeleton(f"chain/{name}", name, chain, starts, targets)
    return OwnProblem(name, _digest(b"", chain.offsets, starts, targets), "ik", problem)


def _cloth(name: str, fields: Mapping[str, Any]) -> OwnProblem:
    x, springs = np.asarray(fields["positions"], dtype=float), np.asarray(fields["springs"])
    lengths = np.linalg.norm(x[springs[:, 0]] - x[springs[:, 1]], axis=1)
    masses = np.broadcast_to(np.asarray(fields["masses"], dtype=float), (len(x),))
    optional = {key: fields[key] for key in ("pinned", "gravity") if key in fields}
    rest_lengths = fields.get("rest_lengths", lengths)
    system = MassSpring(masses, springs, rest_lengths, fields["stiffness"], **optional)
    h = float(fields.get("h", 1 / 60))
    if not 0.0 < h < np.inf:
        raise ValueError(f"h: expected seconds above 0, got {h}")
    state = State(x, fields.get("velocities", np.zeros_like(x)))
    parts = (system.rest_lengths, system.masses, system.stiffnesses, system.pinned, system.gravity)
    digest = _digest(repr(h).encode(), x, springs, *parts, state.velocities)
    return OwnProblem(name, digest, "cloth", cloth=(system, state), h=h)
