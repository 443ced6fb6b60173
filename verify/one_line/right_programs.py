"""The right programs of a task, known faults in their lines, and the comparable part of answers."""

import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from ..case import Case
from ..exchange import Answer, Exchange
from ..fault_programs import PROGRAMS, CodedFault, coded_faults, source_of
from ..functions import call
from ..greeting import Step
from ..kinematics.sweeps import PoseTrial
from ..kinematics.textbook import SOLVERS as METHODS
from ..task import BUILDS_ON, TASKS
from . import tool_steps
from .mutants import Program

_TABLE = tomllib.loads(Path(__file__).with_name("faults.toml").read_text(encoding="utf-8"))
FAULTS = _TABLE["line"]
# The names of all faults that only the lines of programs tell.
BY_LINES = {*FAULTS, *_TABLE["known"]}
# Of changes that no answer tells apart the first of these kinds is named.
KINDS = list(FAULTS)
# The tasks whose known faults programs of a task may have; those of steps have all of robots.
FOUNDATIONS = BUILDS_ON | {tool_steps.TASK: (*BUILDS_ON["robot_track"], "robot_track")}
# The declaration of programs of Jacobian methods.
JACOBIAN = '"methods": ["jacobian"]'
# Fields of a declared step that constants of a program may have.
CHOICES = ("method", "order", "start", "iterations", "substeps", "damper", "pins")
# Faults of these families are named in other ways than by the lines of a program.
SELF_NAMED = ("LINE", "STATE")


def faults_in(source: str, task: str, method: str = "") -> list[CodedFault]:
    """Return the known faults of a task, and of those it builds upon, whose lines a program has."""
    return [
        fault
        for fault in coded_faults().values()
        if fault.family not in SELF_NAMED
        and (fault.task in FOUNDATIONS.get(task, ()) or _is_shared(fault, task, method))
        and fault.lines
        and all(source.count(right) == 1 for right, _ in fault.lines)
    ]


def _is_shared(fault: CodedFault, task: str, method: str) -> bool:
    """Return whether a program of a task may have a fault: of its method, or of all methods."""
    return is_of(fault.program, task, "" if fault.family == "QUAT" else method)


def is_of(program: str, task: str, method: str) -> bool:
    """Return whether a right program has a task, and a method of it.

    A Jacobian method has a name of its solver's own; the program's stands in its declaration.
    """
    source = source_of(program)
    is_own = method not in ("", *METHODS) and JACOBIAN in source
    return bool(PROGRAMS[program]["task"] == task) and (f"def {method}" in source or is_own)


def programs_of(task: str, method: str, step: Step) -> Iterator[Program]:
    """Yield the right programs of a task that have its method and the declared step."""
    for name, entry in PROGRAMS.items():
        if not is_of(name, task, method) or not entry.get("searched", True):
            continue
        program = Program(source_of(name))
        own = program.names.get("PLUMBOB", {}).get("step", {})
        choices = {field for field in CHOICES if field.upper() in program.names}
        declared = {field: getattr(step, field) for field in (*own, *choices)}
        is_fixed = all(declared[field] in (None, own[field]) for field in own.keys() - choices)
        methods = (None, own.get("method"), *entry.get("methods", ()))
        if is_fixed and declared.get("method") in methods:
            chosen = {f.upper(): declared[f] for f in choices if declared[f] is not None}
            yield from _in_choices(name, chosen)


def in_choices(name: str, step: Step) -> Iterator[Program]:
    """Yield a program with each combination of its choices that a greeting leaves open."""
    open_choices = PROGRAMS[name].get("undeclared", {})
    declared = {field: getattr(step, field.lower(), None) for field in open_choices}
    return _in_choices(name, {f: value for f, value in declared.items() if value is not None})


def _in_choices(name: str, chosen: Mapping[str, Any]) -> Iterator[Program]:
    """Yield a program with each combination of the choices that are not made."""
    undeclared = PROGRAMS[name].get("undeclared", {})
    values = {field: each for field, each in undeclared.items() if field not in chosen}
    for combination in product(*values.values()):
        program = Program(source_of(name))
        program.choose({**dict(zip(values, combination, strict=True)), **chosen})
        yield program


def comparable(exchange: Exchange) -> Exchange:
    """Return what no choice of a program changes of an exchange.

    The larger part of a Jacobian comes last, and global rotations are normalised.
    """
    if exchange.case.task == "forward_kinematics":
        assert isinstance(exchange.answer, Answer)
        values = dict(exchange.answer.values)
        if "rotations" in values:
            lengths = np.linalg.norm(values["rotations"], axis=-1, keepdims=True)
            values["rotations"] = values["rotations"] / np.where(lengths > 0.0, lengths, 1.0)
        return replace(exchange, answer=Answer(values, 0.0))
    if exchange.case.task == "robot_jacobian":
        assert isinstance(exchange.answer, Answer)
        parts = sorted(np.split(exchange.answer.values["jacobian"], 2), key=np.linalg.norm)
        return replace(exchange, answer=Answer({"jacobian": np.concatenate(parts)}, 0.0))
    if exchange.case.task != "inverse_kinematics":
        return exchange
    return PoseTrial(exchange).comparable


def answer_of(program: Program, method: str, case: Case) -> Mapping[str, Any]:
    """Return the comparable outputs of a right program; raise ArithmeticError if it has none."""
    if case.task == tool_steps.TASK:
        return tool_steps.answer_of(program, case)
    function = program.names.get(method) or program.names.get(case.task)
    if function is None:
        function = next(program.names[m] for m in ("ccd", "fabrik") if m in program.names)
    answer = call(function, TASKS[case.task], case.inputs)
    if not isinstance(answer, Answer):
        raise ArithmeticError(answer.sentence)
    outputs = comparable(Exchange(case, answer, answer)).answer
    assert isinstance(outputs, Answer)
    return outputs.values
