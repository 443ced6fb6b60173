"""The child process of a Python solver, with the protocol of any program.

The protocol moves away from standard output before the solver is loaded: prints of the solver go
to standard error and become a remark. Only the modules for answers are loaded here, so the
solver meets no module of ours under a name of its own.
"""

import contextlib
import faulthandler
import importlib
import importlib.util
import inspect
import io
import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, BinaryIO

import msgspec

from plumbob.process.child import take_streams
from plumbob.text.sentence import did_you_mean

from ..exchange import Answer, Failure, FailureKind
from ..functions import call, describe_exception, takes
from ..greeting import PROTOCOL
from ..message import GREETING, Request, decode_greeting, decode_request, encode_answer, excerpt
from ..task import TASKS

# Functions by these names are methods of inverse kinematics where nothing declares methods.
METHODS = ("ccd", "fabrik")
INVERSE_KINEMATICS = "inverse_kinematics"
# Names of functions for other purposes by chance.
COMMON_NAMES = frozenset({"track", "resample", "energy"})
# How much of what is printed for a request is remarked and passed on [B].
PRINT_SHOWN, PRINT_PASSED = 200, 4096


class OfferError(ValueError):
    """A solver was loaded, but offers no known task; the message says why."""


class PythonSolver:
    """The functions of a Python file or object by task or method, and the fields of its greeting.

    Raise OfferError without an offered task, or of an invalid declaration.
    """

    def __init__(self, source: object, name: str, declared: object) -> None:
        if not isinstance(declared, Mapping) or not all(isinstance(key, str) for key in declared):
            raise OfferError(
                f"PLUMBOB: expected a dict with texts as keys, got {excerpt(declared)}"
            )
        methods = declared.get("methods") or ()
        methods = methods if isinstance(methods, list | tuple) else ()
        self.functions = _functions(source, methods or METHODS)
        if not self.functions:
            raise OfferError(_offers_nothing(source, name))
        if INVERSE_KINEMATICS not in self.functions and not methods:
            methods = [method for method in METHODS if method in self.functions]
        tasks = {name if name in TASKS else INVERSE_KINEMATICS for name in self.functions}
        self.greeting = {
            "protocol": PROTOCOL,
            "tasks": [task for task in TASKS if task in tasks],
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
        answer = call(function, TASKS[request.task], request.inputs)
        if not isinstance(answer, Answer):
            return _failed(answer)
        changed = [remark.values["name"] for remark in answer.remarks]
        return {**answer.values, "seconds": answer.seconds, "changed": changed}


def _get(source: object, name: str) -> Any:
    return source.get(name) if isinstance(source, Mapping) else getattr(source, name, None)


def _functions(source: object, methods: Sequence[Any]) -> dict[str, Callable[..., Any]]:
    names = [*TASKS, *(method for method in methods if isinstance(method, str))]
    if inspect.isroutine(source) and getattr(source, "__name__", "") in names:
        return {source.__name__: source}
    functions = {name: _get(source, name) for name in names}
    return {name: f for name, f in functions.items() if callable(f) and _is_meant(f, name)}


def _is_meant(function: Callable[..., Any], name: str) -> bool:
    """Return whether a function is of its task; under a common name an input is needed."""
    inputs = TASKS[name].inputs if name in COMMON_NAMES else ()
    return not inputs or any(takes(function, definition.name) for definition in inputs)


def _offers_nothing(source: object, name: str) -> str:
    """Return why no task is offered: no names of tasks, or functions of other arguments."""
    names = source if isinstance(source, Mapping) else dir(source)
    home = source.__name__ if inspect.ismodule(source) else None
    own = [
        text
        for text, attribute in ((str(key), _get(source, str(key))) for key in names)
        if callable(attribute)
        and not text.startswith("_")
        and home in (None, getattr(attribute, "__module__", home))
    ]
    for task in (text for text in own if text in TASKS):
        arguments = ", ".join(definition.name for definition in TASKS[task].inputs)
        return f"{name}: expected {task} to take some of {arguments}, got others"
    hints = ((text, did_you_mean(text, TASKS).removeprefix("; ")) for text in own[:8])
    offered = ", ".join(f"{text} ({hint})" if hint else text for text, hint in hints) or "none"
    return f"{name}: expected functions named as some of {', '.join(TASKS)}, got {offered}"


def _failed(failure: Failure) -> dict[str, Any]:
    values = failure.sentence.values
    fields: dict[str, Any] = {
        "error": str(values["why"]) or "no message",
        "kind": str(failure.kind),
    }
    if failure.kind is FailureKind.RAISED:
        fields |= {"exception": values["kind"]}
        fields |= {key: values[key] for key in ("file", "line") if key in values}
    return fields


def load(spec: str) -> PythonSolver:
    """Return the solver in a Python file, file:object or module:object.

    Raise OfferError without an offered task, and any exception of the solver while loading.
    """
    place, _, attribute = spec.partition(":")
    path = Path(place)
    module = _load_file(path) if path.suffix == ".py" else importlib.import_module(place)
    source: Any = module
    for part in attribute.split(".") if attribute else ():
        if not hasattr(source, part):
            names = [name for name in dir(source) if not name.startswith("_")]
            near = did_you_mean(part, names)
            raise OfferError(f"{part}: expected something of that name in {place}, got none{near}")
        source = getattr(source, part)
    declared = _get(source, "PLUMBOB") or _get(module, "PLUMBOB") or {}
    if isinstance(source, type):
        source = source()
    return PythonSolver(source, attribute or path.name, declared)


def _load_file(path: Path) -> Any:
    name = path.stem if path.stem not in sys.modules else f"solver_{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


class _Prints(io.RawIOBase):
    """A stream to standard error for prints; their beginning is kept."""

    def __init__(self) -> None:
        self.beginning = b""

    def writable(self) -> bool:
        return True

    def write(self, data: Any) -> int:
        text = bytes(data)
        self.beginning = (self.beginning + text[:PRINT_SHOWN])[:PRINT_SHOWN]
        with contextlib.suppress(OSError):
            os.write(2, text[:PRINT_PASSED])
        return len(text)

    def take(self) -> dict[str, str]:
        """Return the beginning as a field of an answer, if any, then forget the prints."""
        beginning, self.beginning = self.beginning, b""
        return {"printed": beginning.decode(errors="replace")} if beginning.strip() else {}


@contextlib.contextmanager
def _protocol_streams() -> Iterator[tuple[BinaryIO, BinaryIO, _Prints]]:
    """Yield the streams of requests, answers and prints."""
    descriptors = take_streams()
    prints = _Prints()
    sys.stdout = io.TextIOWrapper(prints, encoding="utf-8", errors="replace", write_through=True)
    with os.fdopen(descriptors[0], "rb") as requests, os.fdopen(descriptors[1], "wb") as answers:
        yield requests, answers, prints


@contextlib.contextmanager
def _watched(patience: float) -> Iterator[None]:
    """Note on standard error where the solver is, each time the block lasts so long [s]."""
    faulthandler.dump_traceback_later(patience, repeat=True, file=2)
    yield
    faulthandler.cancel_dump_traceback_later()


def serve(spec: str, folder: str, patience: float) -> None:
    """Answer requests about a solver until the end of input.

    The solver and its other modules are in the folder; after so much patience [s] its lines are
    noted on standard error.
    """
    faulthandler.enable(all_threads=False)
    with _protocol_streams() as (requests, answers, prints):
        sys.argv = [spec]
        if folder not in sys.path:
            sys.path.insert(0, folder)
        with _watched(patience):
            solver, failure = load_safely(spec, folder)
        for line in requests:
            with _watched(patience):
                request = decode_request(line)
                fields = solver.answer(request) if solver else failure
            answers.write(encode_answer(request.id, **{**fields, **prints.take()}))
            answers.flush()


def load_safely(spec: str, folder: str) -> tuple[PythonSolver | None, dict[str, Any]]:
    """Return the solver of `load`, or the fields of an answer with the reason for none."""
    try:
        return load(spec), {}
    except OfferError as error:
        return None, {"error": str(error), "kind": str(FailureKind.GARBAGE)}
    except (Exception, SystemExit) as error:
        place = spec.partition(":")[0]
        return None, _failed(describe_exception(error, str(Path(folder) / place)))
