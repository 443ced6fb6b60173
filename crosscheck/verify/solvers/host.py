"""The child process that a Python solver lives in; it speaks the protocol of any program.

The protocol moves away from standard output before the solver is loaded: what the solver prints
goes to standard error and is told as a remark. Nothing of ours but what answers needs is loaded
here, so that the solver meets no module of another name.
"""

import contextlib
import faulthandler
import importlib
import importlib.util
import inspect
import io
import os
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import FrameType
from typing import Any, BinaryIO

import msgspec

from ...child_process import take_streams
from ..contestant import Answer, Failure, FailureKind
from ..functions import call, describe_exception, is_beside, takes
from ..greeting import PROTOCOL
from ..message import (
    GREETING,
    Request,
    decode_greeting,
    decode_request,
    encode_answer,
    excerpt,
)
from ..sentence import did_you_mean
from ..task import TASKS

# Functions by these names are methods of inverse kinematics where nothing declares methods.
METHODS = ("ccd", "fabrik")
INVERSE_KINEMATICS = "inverse_kinematics"
# Names that a function of something else may have by chance.
COMMON_NAMES = frozenset({"track", "resample", "energy"})


class OfferError(ValueError):
    """A solver was loaded, but offers nothing that is understood; the message says why."""


class PythonSolver:
    """What a Python file or object offers.

    Attributes:
        functions: by the name of a task, or of a method of inverse kinematics.
        greeting: fields of the greeting.

    Raises:
        OfferError: if it offers nothing, or what it declares is not understood.
    """

    def __init__(self, found: object, name: str, declared: object) -> None:
        if not isinstance(declared, Mapping) or not all(isinstance(one, str) for one in declared):
            raise OfferError(
                f"PLUMBOB: expected a dict with texts as keys, got {excerpt(declared)}"
            )
        methods = declared.get("methods") or ()
        methods = methods if isinstance(methods, list | tuple) else ()
        self.functions = _functions(found, methods)
        if not self.functions:
            raise OfferError(_offers_nothing(found, name))
        if INVERSE_KINEMATICS not in self.functions and not methods:
            methods = [one for one in METHODS if one in self.functions]
        self.greeting = {
            "protocol": PROTOCOL,
            "tasks": [task for task in TASKS if self._offers(task)],
            "name": name,
            "language": "Python",
            **({"methods": list(methods)} if methods else {}),
            **msgspec.to_builtins(declared, enc_hook=repr),
        }
        try:
            decode_greeting(self.greeting, "PLUMBOB")
        except ValueError as error:
            raise OfferError(str(error)) from None

    def answer(self, request: Request) -> dict[str, Any]:
        """Return the fields of an answer."""
        if request.task == GREETING:
            return self.greeting
        function = self.functions.get(request.task)
        if request.task == INVERSE_KINEMATICS:
            function = self.functions.get(request.inputs.get("method", ""), function)
        if function is None:
            return {"error": f"there is no function {request.task}"}
        return _fields(call(function, TASKS[request.task], request.inputs))

    def _offers(self, task: str) -> bool:
        by_method = task == INVERSE_KINEMATICS and self.functions.keys() - TASKS.keys()
        return task in self.functions or bool(by_method)


def _get(found: object, name: str) -> Any:
    return found.get(name) if isinstance(found, Mapping) else getattr(found, name, None)


def _functions(found: object, methods: Any) -> dict[str, Callable[..., Any]]:
    names = [*TASKS, *(methods or METHODS)]
    if inspect.isroutine(found) and getattr(found, "__name__", "") in names:
        return {found.__name__: found}
    functions = {name: _get(found, name) for name in names if isinstance(name, str)}
    return {
        name: function
        for name, function in functions.items()
        if callable(function) and _is_meant(function, name)
    }


def _is_meant(function: Callable[..., Any], name: str) -> bool:
    """Return whether a function is of its task; one of a common name has to take an input."""
    if name not in COMMON_NAMES:
        return True
    return any(takes(function, field.name) for field in TASKS[name].inputs)


def _offers_nothing(found: object, name: str) -> str:
    own = _names(found)
    namesakes = [one for one in own if one in TASKS]
    if namesakes:
        arguments = ", ".join(field.name for field in TASKS[namesakes[0]].inputs)
        return f"{name}: expected {namesakes[0]} to take some of {arguments}, got others"
    hints = ((one, did_you_mean(one, TASKS).removeprefix("; ")) for one in own[:8])
    got = ", ".join(f"{one} ({hint})" if hint else one for one, hint in hints) or "none"
    return f"{name}: expected functions named as some of {', '.join(TASKS)}, got {got}"


def _names(found: object) -> list[str]:
    """Return the names of functions and classes: of a module, of those that it defines itself."""
    inside = {
        str(one): _get(found, one) for one in (found if isinstance(found, Mapping) else dir(found))
    }
    home = found.__name__ if inspect.ismodule(found) else None
    return [
        name
        for name, one in inside.items()
        if callable(one)
        and not name.startswith("_")
        and home in (None, getattr(one, "__module__", home))
    ]


def _fields(answer: Answer | Failure) -> dict[str, Any]:
    if isinstance(answer, Answer):
        changed = [one.values["name"] for one in answer.remarks]
        return {**answer.values, "seconds": answer.seconds, "changed": changed}
    return _failed(answer)


def _failed(failure: Failure) -> dict[str, Any]:
    said = failure.sentence.values
    fields: dict[str, Any] = {"error": str(said["why"]) or "no message", "kind": str(failure.kind)}
    if failure.kind is FailureKind.RAISED:
        fields |= {"exception": said["kind"]}
        fields |= {key: said[key] for key in ("file", "line") if key in said}
    return fields


def load(spec: str) -> PythonSolver:
    """Return the solver in a Python file, file:object or module:object.

    Raises:
        OfferError: if it offers nothing.
        Exception: whatever it raises while it is loaded.
    """
    place, _, attribute = spec.partition(":")
    is_file = place.endswith(".py")
    module = _load_file(Path(place)) if is_file else importlib.import_module(place)
    found: Any = module
    for part in attribute.split(".") if attribute else ():
        if not hasattr(found, part):
            near = did_you_mean(part, [one for one in dir(found) if not one.startswith("_")])
            raise OfferError(f"{part}: expected something of that name in {place}, got none{near}")
        found = getattr(found, part)
    declared = _get(found, "PLUMBOB") or _get(module, "PLUMBOB") or {}
    if isinstance(found, type):
        found = found()
    return PythonSolver(found, attribute or Path(place).name, declared)


def _load_file(path: Path) -> Any:
    name = path.stem if path.stem not in sys.modules else f"contestant_{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


class _Prints(io.RawIOBase):
    """What is printed: passed on to standard error, its beginning kept."""

    def __init__(self) -> None:
        self.first = b""

    def writable(self) -> bool:
        return True

    def write(self, data: Any) -> int:
        words = bytes(data)
        self.first = (self.first + words[:200])[:200]
        with contextlib.suppress(OSError):
            os.write(2, words[:4096])
        return len(words)

    def taken(self) -> dict[str, str]:
        first, self.first = self.first, b""
        return {"printed": first.decode(errors="replace")} if first.strip() else {}


@contextlib.contextmanager
def _moved() -> Iterator[tuple[BinaryIO, BinaryIO, _Prints]]:
    """Yield the protocol's streams, and what is printed instead of them."""
    descriptors = take_streams()
    requests, answers = os.fdopen(descriptors[0], "rb"), os.fdopen(descriptors[1], "wb")
    prints = _Prints()
    stream = io.TextIOWrapper(prints, encoding="utf-8", errors="replace", write_through=True)  # type: ignore[type-var]
    sys.stdout = stream
    with requests, answers:
        yield requests, answers, prints


class _Watch(threading.Thread):
    """Says on standard error in which line the solver is, each time that it took so long."""

    def __init__(self, folder: str, patience: float) -> None:
        super().__init__(daemon=True)
        self._folder, self._patience = folder, patience
        self._solver = threading.get_ident()
        self.since: float | None = None

    def run(self) -> None:
        while True:
            time.sleep(self._patience / 10)
            since, now = self.since, time.monotonic()
            if since is not None and now - since > self._patience:
                self.since = now
                self._say(sys._current_frames().get(self._solver))

    def _say(self, frame: FrameType | None) -> None:
        beside = Path(self._folder) / "solver.py"
        while frame is not None and not is_beside(Path(frame.f_code.co_filename), beside):
            frame = frame.f_back
        if frame is not None:
            file = Path(frame.f_code.co_filename).name
            os.write(2, f"It was in line {frame.f_lineno} of {file}.\n".encode())


def serve(spec: str, folder: str, patience: float) -> None:
    """Answer requests about a solver until they end.

    Args:
        spec: as of `load`.
        folder: its own one, where it finds its other modules.
        patience: after which it is told where the solver is [s].
    """
    faulthandler.enable(all_threads=False)
    with _moved() as (requests, answers, prints):
        sys.argv = [spec]
        if folder not in sys.path:
            sys.path.insert(0, folder)
        watch = _Watch(folder, patience)
        watch.start()
        watch.since = time.monotonic()
        solver, failure = _loaded(spec, folder)
        watch.since = None
        for line in requests:
            watch.since = time.monotonic()
            request = decode_request(line)
            fields = solver.answer(request) if solver else failure
            watch.since = None
            answers.write(encode_answer(request.id, **{**fields, **prints.taken()}))
            answers.flush()


def _loaded(spec: str, folder: str) -> tuple[PythonSolver | None, dict[str, Any]]:
    try:
        return load(spec), {}
    except OfferError as error:
        return None, {"error": str(error), "kind": str(FailureKind.GARBAGE)}
    except (Exception, SystemExit) as error:
        place = spec.partition(":")[0]
        return None, _failed(describe_exception(error, str(Path(folder) / place)))
