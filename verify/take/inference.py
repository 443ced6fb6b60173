"""Infer the restrictions of a solver from its answers.

A solver with wrong answers may be right on chains, with a single mass for all particles or in a
plane. Changed requests show whether answers depend on an input, or come at all. Without either, the
solver is judged by requests without a need of the input, and the report says so.
"""

import json
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy as np

from plumbob.text.sentence import Sentence, sentence

from ..case import Case
from ..exchange import Answer, Connection, Failure, is_hung
from ..gaps import largest_gap
from ..greeting import Greeting
from ..judgement import TaskReport, Verdict
from ..kinematics.robot_models import urdf
from ..task import TASKS
from . import precision
from .constants import MEASURES, is_unread
from .examination import SAME, TRIALS, Examination

UNRELATED = sentence("it gives no answer otherwise")
# What is judged by where answers do not show the number itself.
WITHOUT_NUMBER: Mapping[str, Sentence] = {
    "tolerance": sentence("Judged by the distances at which its solves end"),
    "max_iterations": sentence("Judged by whole solves"),
}
NUMBER = sentence("N is a number of your program, which its answers do not show.")
# Methods of inverse kinematics for undeclared programs.
METHODS = ("ccd", "fabrik")
_TABLE = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))


class Restriction(NamedTuple):
    """An input outside a solver's reach, and its declaration in a greeting."""

    input: str  # its name
    greeting: Mapping[str, Any]  # the fields that declare it
    about: Sentence  # what it is judged on
    sentence: Sentence  # how its answers show that
    needs_declaration: bool = False  # whether it is a mistake unless the greeting declares it
    detection: str = "replaced"  # what shows it, a key of `_DETECTORS`
    unused: bool = False  # whether answers do not depend on it at all
    tasks: Sequence[str] = tuple(TASKS)  # those that it is inferred of
    is_assumed: bool = False  # whether its constant is assumed, which answers do not show

    @property
    def measured(self) -> bool:
        """Whether a constant takes the place of the input, which `fixed` declares."""
        return self.detection == "constant"


# Restrictions, each with the evidence of answers.
Evidence = Sequence[tuple[Restriction, Sentence]]
RESTRICTIONS = tuple(
    Restriction(
        **{"greeting": {}, **entry}
        | {name: Sentence(entry.get(name, ""), {}) for name in ("about", "sentence")}
    )
    for entry in _TABLE["restriction"]
)
_SHARED = ("masses", "stiffnesses", "dampings", "rest_lengths")


def _first_for_all(name: str, inputs: Mapping[str, Any]) -> Any:
    return np.resize(inputs[name][:1], len(inputs[name]))


# The view of a solver without an input, given all inputs.
_REPLACEMENTS: Mapping[str, Callable[[Mapping[str, Any]], Any]] = {
    "parents": lambda inputs: np.arange(-1, len(inputs["parents"]) - 1),
    "effector": lambda inputs: len(inputs["parents"]) - 1,
    "gravity": lambda inputs: inputs["gravity"] * [0.0, 1.0, 0.0],
    "pinned": lambda inputs: inputs["pinned"][:0],
    "rest_positions": lambda inputs: inputs["positions"],
    "previous_positions": lambda inputs: inputs["positions"] - inputs["h"] * inputs["velocities"],
    **{name: partial(_first_for_all, name) for name in _SHARED},
}
# Inputs for declared greetings alone.
_ADDED = ("rest_positions", "previous_positions")


def examine(examination: Examination, report: TaskReport) -> TaskReport:
    """Return the report by the restrictions of a solver, the same report if none show.

    The fewest restrictions with a right verdict are taken; a solver with wrong answers beside
    restrictions gets both said.
    """
    connection = examination.connection
    greeting = connection.greeting
    is_stuck = any(is_hung(judgement.answer) for judgement in report.judgements)
    if report.verdict is Verdict.RIGHT or greeting.system.continues or is_stuck:
        return report
    is_sound = report.verdict is Verdict.RIGHT_EXCEPT
    evidence, unknown = list[tuple[Restriction, Sentence]](), list[Restriction]()
    for restriction in RESTRICTIONS:
        is_tried = restriction.measured or not is_sound
        why = _evidence(connection, report, restriction) if is_tried else None
        if why is not None and (measured := _with_constant(connection, report, restriction)):
            evidence.append((measured, why))
        elif why is not None:
            unknown.append(restriction)
    if not evidence:
        return _with_unknown(report, unknown)

    def judge(items: Evidence) -> TaskReport:
        return precision.examine(examination, examination.judge(restricted(greeting, items)))

    best = judge(evidence)
    if best.verdict > Verdict.RIGHT_EXCEPT:
        is_worse = is_sound or _passed(best) < _passed(report)
        best = report if is_worse else _restricted_report(report, best, evidence)
        return _with_unknown(best, unknown)
    for item in [item for item in evidence if not item[0].measured]:
        fewer = [other for other in evidence if other is not item]
        if fewer and (simpler := judge(fewer)).verdict <= Verdict.RIGHT_EXCEPT:
            evidence, best = fewer, simpler
    return _restricted_report(report, best, evidence)


def _with_unknown(report: TaskReport, unknown: Sequence[Restriction]) -> TaskReport:
    """Return the report on wrong answers with inputs ignored for unknown constants."""
    if report.verdict < Verdict.WRONG or not unknown:
        return report
    words = sentence(
        "Its answers do not depend on {inputs}. If that is meant, declare the constants of your "
        'program in "fixed"; if not, it is a mistake.',
        inputs=", ".join(restriction.input for restriction in unknown),
    )
    return replace(report, assumptions=(*report.assumptions, words))


def _passed(report: TaskReport) -> float:
    """Return the share of the cases with right answers."""
    passed = [judgement.verdict <= Verdict.RIGHT_EXCEPT for judgement in report.judgements]
    return sum(passed) / max(len(passed), 1)


def restricted(greeting: Greeting, evidence: Evidence) -> Greeting:
    """Return a greeting with declared restrictions as well."""
    fields = {
        name: msgspec.structs.replace(getattr(greeting, name), **field)
        if isinstance(field, dict)
        else field
        for name, field in _fields(evidence).items()
    }
    return msgspec.structs.replace(greeting, **fields)


def _with_constant(
    connection: Connection, report: TaskReport, restriction: Restriction
) -> Restriction | None:
    """Return a restriction with the constant in place of its input, or None."""
    name = restriction.input
    if not restriction.measured:
        return restriction
    constant = MEASURES[name](connection, report)
    if constant is None:
        return None
    about = Sentence(restriction.about.template, {"value": constant.value})
    return restriction._replace(
        greeting={"fixed": {name: constant.value}},
        about=about if constant.is_own else WITHOUT_NUMBER[name],
        is_assumed=not constant.is_own,
    )


def _fields(evidence: Evidence) -> dict[str, Any]:
    """Return the fields of a greeting for restrictions."""
    fields: dict[str, Any] = {}
    for restriction, _ in evidence:
        for name, field in restriction.greeting.items():
            is_part = isinstance(field, dict)
            fields[name] = {**fields.get(name, {}), **field} if is_part else field
    return fields


def _declaration(evidence: Evidence) -> str:
    """Return the declaration of restrictions, with N for an unknown number."""
    fields = _fields(evidence)
    for name in (restriction.input for restriction, _ in evidence if restriction.is_assumed):
        fields["fixed"] = {**fields["fixed"], name: "N"}
    return json.dumps(fields)[1:-1].replace('"N"', "N")


def _restricted_report(report: TaskReport, best: TaskReport, evidence: Evidence) -> TaskReport:
    """Return the report on a restricted solver with its assumptions, and the faults elsewhere."""
    notes = [
        sentence("{about}: {why}.", about=restriction.about, why=why)
        for restriction, why in evidence
    ]
    declaration = _declaration(evidence)
    needs_declaration = any(restriction.needs_declaration for restriction, _ in evidence)
    notes.append(
        sentence("If that is meant, declare it with {declaration}; if not, it is a mistake.",
                 declaration=declaration)
        if needs_declaration
        else sentence("Declare it with {declaration}.", declaration=declaration)
    )  # fmt: skip
    if any(restriction.is_assumed for restriction, _ in evidence):
        notes.append(NUMBER)
    assumptions = (*best.assumptions, *notes)
    return replace(
        best, assumptions=assumptions, needs_declaration=needs_declaration, original=report
    )


def _evidence(
    connection: Connection, report: TaskReport, restriction: Restriction
) -> Sentence | None:
    """Return how answers show an input outside a solver's reach.

    None stands for no such evidence, or a declared restriction.
    """
    greeting, is_tried = connection.greeting, report.task in restriction.tasks
    if restriction.greeting and restricted(greeting, [(restriction, UNRELATED)]) == greeting:
        return None
    return _DETECTORS[restriction.detection](connection, report, restriction) if is_tried else None


def _constant(
    connection: Connection, report: TaskReport, restriction: Restriction
) -> Sentence | None:
    """Return the sentence on answers independent of an undeclared input, or None."""
    is_undeclared = getattr(connection.greeting.fixed, restriction.input) is None
    is_constant = is_undeclared and is_unread(connection, report, restriction.input)
    return restriction.sentence if is_constant else None


def _points(_: Connection, report: TaskReport, restriction: Restriction) -> Sentence | None:
    """Return the sentence on answers to targets with positions alone, or None."""
    answers = [j.answer.values for j in report.judgements if isinstance(j.answer, Answer)]
    are_points = bool(answers) and all("local_rotations" not in values for values in answers)
    return restriction.sentence if "target" in _inputs_of(report) and are_points else None


def _plane(_: Connection, report: TaskReport, restriction: Restriction) -> Sentence | None:
    """Return the sentence on answers in the plane z = 0, or on absent answers; else None."""
    answers = [(j.case, j.answer.values) for j in report.judgements if isinstance(j.answer, Answer)]
    if not {"offsets", "positions"} & _inputs_of(report):
        return None
    if not answers:
        return UNRELATED
    return restriction.sentence if all(_is_flat(*pair) for pair in answers) else None


def _inputs_of(report: TaskReport) -> set[str]:
    return {field.name for field in TASKS[report.task].inputs}


def _is_flat(case: Case, outputs: Mapping[str, Any]) -> bool:
    """Return whether answered vectors have a common or unchanged z; rotations are about z."""
    before = case.inputs["positions" if "positions" in case.inputs else "offsets"][:, 2]
    vectors = [np.asarray(x)[..., 2] for x in outputs.values() if np.shape(x)[-1:] == (3,)]
    rotations = [np.asarray(x) for x in outputs.values() if np.shape(x)[-1:] == (4,)]
    is_flat = all((z == 0.0).all() or (z == before).all() or np.ptp(z) == 0.0 for z in vectors)
    if not vectors:
        return bool(rotations) and not any(q[..., 1:3].any() for q in rotations)
    return is_flat


def _unchanged(
    connection: Connection, report: TaskReport, restriction: Restriction
) -> Sentence | None:
    """Return how an input leaves answers unchanged, or None; the other inputs are plain."""
    name, names, pairs = restriction.input, _inputs_of(report), []
    if name not in names:
        return None
    for case in sorted((j.case for j in report.judgements), key=lambda case: -case.size):
        plain = _plain(case, names)
        full = {key: value for key, value in plain.items() if key != name or name not in _ADDED}
        full |= {name: case.inputs[name]} if name in case.inputs else {}
        if largest_gap(full.get(name, np.nan), plain.get(name, np.nan)) != 0.0:
            pairs.append([replace(case, inputs=_with_urdf(inputs)) for inputs in (plain, full)])
    reason = None
    for plain_case, full_case in pairs[:TRIALS]:
        answer = connection.answer(plain_case)
        reason = _reason(answer, connection.answer(full_case), restriction)
        if reason is None:
            return None
        if _is_unused(connection, plain_case, answer, restriction) is not restriction.unused:
            return None
    return reason


def _unread(
    connection: Connection, report: TaskReport, restriction: Restriction
) -> Sentence | None:
    """Return how answers to requests with an optional input ignore this input, or None."""
    name = restriction.input
    pairs = [(j.case, j.answer) for j in report.judgements if name in j.case.inputs]
    if len(pairs) in (0, len(report.judgements)):
        return None
    if all(isinstance(answer, Failure) for _, answer in pairs):
        return UNRELATED
    return restriction.sentence if all(_keeps(connection, *pair, name) for pair in pairs) else None


def _keeps(connection: Connection, case: Case, answer: Answer | Failure, name: str) -> bool:
    """Return whether an answer stays the same with twice an input."""
    doubled = connection.answer(replace(case, inputs={**case.inputs, name: 2 * case.inputs[name]}))
    return isinstance(answer, Answer) and isinstance(doubled, Answer) and _are_same(answer, doubled)


def _is_unused(
    connection: Connection, case: Case, answer: Answer | Failure, restriction: Restriction
) -> bool:
    """Return whether answers do not even depend on the first of many numbers, or on gravity."""
    name = restriction.input
    return name in ("gravity", *_SHARED) and _keeps(connection, case, answer, name)


def _with_urdf(inputs: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return a request whose robot is the same as URDF, which many programs read alone."""
    return {**inputs, "urdf": urdf(inputs)} if "urdf" in inputs else inputs


def _plain(case: Case, names: set[str]) -> dict[str, Any]:
    """Return a request with inputs as for solvers of all restrictions."""
    inputs = dict(case.inputs)
    for name, replacement in _REPLACEMENTS.items():
        if name in names:
            inputs[name] = replacement(case.inputs)
    return inputs


def _reason(
    plain: Answer | Failure, full: Answer | Failure, restriction: Restriction
) -> Sentence | None:
    """Return how two answers show an input outside the solver's reach."""
    if not isinstance(plain, Answer):
        return None
    if not isinstance(full, Answer):
        return UNRELATED
    is_added = restriction.input in _ADDED
    return restriction.sentence if _are_same(plain, full) and not is_added else None


# Detectors of a restriction; each returns the evidence, or None.
_DETECTORS: Mapping[str, Callable[[Connection, TaskReport, Restriction], Sentence | None]] = {
    "replaced": _unchanged, "constant": _constant, "absent": _unread, "points": _points,
    "plane": _plane,
}  # fmt: skip


def _are_same(first: Answer, second: Answer) -> bool:
    names = first.values.keys()
    return names == second.values.keys() and all(
        largest_gap(first.values[name], second.values[name]) <= SAME for name in names
    )


def methods_of(connection: Connection, cases: Sequence[Case]) -> tuple[str, ...]:
    """Return the declared methods of inverse kinematics, or the methods in a solver's answers.

    Methods show where the answer to a case differs by the request's method, or only comes with a
    named method.
    """
    declared = connection.greeting.methods
    for case in cases if declared == ("",) else ():
        answers = {
            method: connection.answer(replace(case, inputs={**case.inputs, "method": method}))
            for method in ("", *METHODS)
        }
        offered = {m: answer for m, answer in answers.items() if isinstance(answer, Answer)}
        default, method_answers = offered.pop("", None), list(offered.values())
        if default is None and method_answers:
            return tuple(offered)
        if len(method_answers) == len(METHODS) and not _are_same(*method_answers):
            is_either = default and any(_are_same(default, answer) for answer in method_answers)
            return METHODS if is_either else declared
    return declared
