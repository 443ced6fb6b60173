"""What `plumbob explain` prints: a fault's cause, remedy, lines of programs, and symptom."""

import re
from collections.abc import Iterator, Sequence
from difflib import get_close_matches, unified_diff
from itertools import groupby

import numpy as np

from plumbob.text.sentence import Say, Sentence, sentence

from ..connections.saved import SavedCase, cases_of
from ..disciplines import DISCIPLINES
from ..fault_programs import FAMILIES, CodedFault, coded_faults, connection_to
from ..judgement import CaseJudgement, Verdict
from ..verify import judge_cases, trials
from .terminal import numbers, wrapped

# The lines around a change.
CONTEXT = 2
# The end of the first sentence, in English and in Chinese; a dot after a space is a product.
_FIRST_END = re.compile(r"(?<=[^\s.]\.) (?=\S)|(?<=。)")


def fault_help(words: Sequence[str], say: Say) -> Iterator[str]:
    """Yield the explanation of a code, the faults with all words, or without words the families.

    Raises:
        ValueError: if no fault has these words; the message has the nearest code.
    """
    faults, text = coded_faults(), " ".join(words)
    if (name := text.upper()) in faults:
        return explained(faults[name], say)
    if not words:
        return _families(say)
    folded = [word.casefold() for word in words]
    causes = {code: cause_and_remedy(fault, say)[0].casefold() for code, fault in faults.items()}
    family = [code for code in causes if code.startswith(f"{name}-")]
    matches = family or [c for c, cause in causes.items() if all(w in cause for w in folded)]
    if not matches:
        raise ValueError(f"code: {_why_unknown(name, text)}")
    return _listed([faults[code] for code in matches], say)


def _why_unknown(name: str, text: str) -> str:
    """Return why a name in capitals, typed as `text`, is no code: retired, or never given."""
    code = re.fullmatch(r"PB-([A-Z]+)-(\d{3})", name)
    if code and 0 < int(code[2]) <= FAMILIES.get(code[1], {"last": 0})["last"]:
        return (
            f"{name} is retired, its mistake may show as a changed line (PB-LINE); "
            f"`plumbob explain PB-{code[1]}` lists those with a code of their own"
        )
    near = get_close_matches(name, coded_faults(), n=1)
    hint = f"nearest: {near[0]}" if near else "`plumbob explain` lists the families"
    return f"expected a code of a fault, or words, got {text!r}; {hint}"


def _families(say: Say) -> Iterator[str]:
    """Yield a line for each family of faults: what its codes begin with, number and subject."""
    for family, faults in groupby(coded_faults().values(), key=lambda fault: fault.family):
        about = say(Sentence(FAMILIES[family]["about"], {}))
        yield f"  {f'PB-{family}':<11} {len(list(faults)):>4}  {about}"
    yield ""
    yield say(sentence("plumbob explain PB-FK lists a family, plumbob explain WORD ... searches."))
    yield say(sentence("plumbob explain CODE shows a fault in a short program."))


def _listed(faults: Sequence[CodedFault], say: Say) -> Iterator[str]:
    """Yield code and cause of each fault, by family."""
    for family, members in groupby(faults, key=lambda fault: fault.family):
        yield say(Sentence(FAMILIES[family]["about"], {}))
        for fault in members:
            margin = " " * (len(fault.code) + 4)
            first, *more = wrapped(cause_and_remedy(fault, say)[0], margin)
            yield from (f"  {fault.code}  {first.strip()}", *more)
        yield ""
    yield say(sentence("plumbob explain CODE shows a fault in a short program."))


def explained(fault: CodedFault, say: Say) -> Iterator[str]:
    """Yield the cause of a fault, its remedy, the differing lines, and the symptom."""
    cause, remedy = cause_and_remedy(fault, say)
    yield f"{fault.code}  {say(Sentence(FAMILIES[fault.family]['about'], {}))}"
    yield from _section(sentence("Cause"), wrapped(cause, "  "), say)
    if remedy:
        yield from _section(sentence("Remedy"), wrapped(remedy, "  "), say)
    if not fault.lines:
        return
    heading = sentence("A wrong program in Python (-) and the right one (+)")
    yield from _section(heading, (f"  {line}".rstrip() for line in changed_lines(fault)), say)
    yield from _section(sentence("Symptom"), _symptom(fault, say), say)


def _section(heading: Sentence, lines: Iterator[str] | list[str], say: Say) -> Iterator[str]:
    yield from ("", say(heading), *lines)


def cause_and_remedy(fault: CodedFault, say: Say) -> tuple[str, str]:
    """Return the first of a fault's sentences, which is the mistake, and the others."""
    cause, *remedy = _FIRST_END.split(say(fault.sentence), 1)
    return cause, "".join(remedy)


def changed_lines(fault: CodedFault) -> list[str]:
    """Return the difference between the wrong and the right program, as a diff."""
    wrong, right = fault.wrong_program.splitlines(), fault.right_program.splitlines()
    lines = []
    for line in list(unified_diff(wrong, right, n=CONTEXT, lineterm=""))[2:]:
        if hunk := re.match(r"@@ .*\+(\d+)", line):
            above = right[: int(hunk[1]) - 1]
            function = next((text for text in reversed(above) if text.startswith("def ")), None)
            lines += [f" {function}", "     ..."] if function else []
        else:
            lines.append(line)
    return lines


def _symptom(fault: CodedFault, say: Say) -> Iterator[str]:
    """Yield the smallest failing case of the wrong program."""
    failure = failure_of(fault)
    if failure is None:
        text = sentence("No case breaks a law: it may be on purpose, or show in other cases only.")
        yield from wrapped(say(text), "  ")
    else:
        (complaint, *_), name = failure.complaints, f'"{failure.case.name}"'
        text = sentence("Smallest failing case, {name}: {what}", name=name, what=complaint)
        yield from (*wrapped(say(text), "  "), *numbers(failure, say))


def failure_of(fault: CodedFault) -> CaseJudgement | None:
    """Judge the wrong program on its cases until a case fails; return its judgement, or None.

    A failing whole solve is shown before a single sweep unlike the textbook's.
    """
    connection, seed = connection_to(fault.wrong_program), 0
    ((task, method),) = trials(connection.greeting, [fault.task])
    cases = DISCIPLINES[task].cases(connection.greeting, method, seed, False)
    first = None
    for case in cases:
        requests = cases_of(SavedCase(task, method, seed, False, case.name), cases)
        with np.errstate(all="ignore"):  # a wrong program may divide by zero
            failure = judge_cases(connection, task, method, requests).smallest_failure
        if failure and any(
            finding.verdict >= Verdict.WRONG and finding.law != "one sweep"
            for finding in failure.findings
        ):
            return failure
        first = first or failure
    # A single case may be undecided where all cases together show the fault.
    return first or judge_cases(connection, task, method, cases).smallest_failure
