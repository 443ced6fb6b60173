"""Ask a solver every case of its tasks, judge its answers, and explain wrong answers."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Protocol

import msgspec

from . import precision
from .case import Case
from .contestant import Contestant, Exchange, Failure, is_hung
from .greeting import Greeting
from .inference import inferred, methods_of
from .judgement import Diagnosis, Report, TaskReport, Verdict
from .kept_state import with_kept_state
from .kinematics import (
    faults,
    forward_kinematics,
    inverse_kinematics,
    resample,
    robot_inverse_kinematics,
    robot_jacobian,
    robot_track,
    robot_velocity,
    track,
)
from .kinematics.claims import OF_WRONG_POSES
from .kinematics.faults import SwitchFault
from .laws import NO_NUMBERS
from .mass_spring import energy, forces
from .mass_spring.search import Budget
from .mass_spring.stepping import Stepping
from .one_line.search import with_changed_line
from .sentence import Sentence, codes_in, sentence
from .task import BUILDS_ON
from .timing import with_lesser_time

# After so many timeouts in a task its other cases are not asked, nor are they asked again.
MAX_HANGS = 2
# Tasks that are tried once for every method that the greeting names.
WITH_METHODS = ("inverse_kinematics", "track")
Notify = Callable[[str, int, int], None]


class Discipline(Protocol):
    """A module that tries one task."""

    def cases(self, greeting: Greeting, method: str, seed: int, thorough: bool) -> list[Case]:
        """Return cases that suit the solver, from trivial to hostile, the smallest first."""

    def judge(self, exchanges: Sequence[Exchange], greeting: Greeting, method: str) -> TaskReport:
        """Judge answers by laws, the reference and the declaration; name the faults."""


DISCIPLINES: Mapping[str, Discipline] = {
    "forward_kinematics": forward_kinematics,
    "inverse_kinematics": inverse_kinematics,
    "track": track,
    "resample": resample,
    "mass_spring_forces": forces,
    "energy": energy,
    "mass_spring_step": Stepping("mass_spring_step"),
    "mass_spring_motion": Stepping("mass_spring_motion"),
    "robot_jacobian": robot_jacobian,
    "robot_velocity": robot_velocity,
    "robot_inverse_kinematics": robot_inverse_kinematics,
    "robot_track": robot_track,
}


def verify(
    contestant: Contestant,
    tasks: Sequence[str] | None = None,
    seed: int = 0,
    thorough: bool = False,
    notify: Notify = lambda task, count, total: None,
) -> Report:
    """Try a solver at its tasks, by default all that it offers, and return the report.

    The cases are random by the seed; there are more if `thorough`. `notify` is called before each
    with the task, the number of cases done, and of all, and likewise before each stage of a search
    of faults. Raise ValueError if a task is not offered.
    """
    greeting, remarks = _with_methods(contestant, tasks, seed)
    reports = list[TaskReport]()
    for task, method in trials(greeting, tasks):
        causes = [r for r in reports if _builds_on(task, method, r)]
        causes.sort(key=lambda r: (not r.diagnosis.explained, BUILDS_ON[task].index(r.task)))

        known, budget = _known_faults(task, reports, causes), Budget()

        def judge(
            greeting: Greeting,
            task: str = task,
            method: str = method,
            known: Sequence[SwitchFault | str] | None = known,
            budget: Budget = budget,
        ) -> TaskReport:
            cases = DISCIPLINES[task].cases(greeting, method, seed, thorough)
            return judge_cases(contestant, task, method, cases, notify, greeting, known, budget)

        report = inferred(contestant, judge(contestant.greeting), judge)
        report = with_kept_state(contestant, report)
        if not causes:
            report = with_changed_line(report, contestant.greeting, partial(notify, task))
        reports.append(_with_cause(report, causes))
    return Report(contestant.greeting, reports, seed, remarks)


def _known_faults(
    task: str, reports: Sequence[TaskReport], causes: Sequence[TaskReport]
) -> Sequence[SwitchFault | str] | None:
    """Return the faults of what a task builds upon, None if that is right or not explained.

    Of robots they are keys, none if their Jacobian is wrong for an unknown reason. Poses that miss
    for a known reason do so in motions too.
    """
    if not task.startswith("robot"):
        return next(filter(None, map(faults.explaining, causes)), None)
    if task == robot_jacobian.TASK:
        return None
    wrong = [r for r in reports if r.task == robot_jacobian.TASK and r.verdict >= Verdict.WRONG]
    wrong += [cause for cause in causes if cause.task == robot_inverse_kinematics.TASK]
    explanations = [
        explanation for report in wrong for explanation in report.diagnosis.explanations[:1]
    ]
    return [key for explanation in explanations for key in explanation.faults] if wrong else None


def _builds_on(task: str, method: str, report: TaskReport) -> bool:
    """Return whether a task builds upon that of a report, which is wrong or may be."""
    is_earlier = report.task in BUILDS_ON.get(task, ()) and report.method in ("", method)
    is_assumed = bool(report.assumptions and report.diagnosis.explanations)
    return is_earlier and (report.verdict >= Verdict.WRONG or is_assumed)


def _with_cause(report: TaskReport, causes: Sequence[TaskReport]) -> TaskReport:
    """Return a report on unexplained answers that names the mistakes of the task it builds upon.

    Claims that wrong poses may lead to explain nothing.
    """
    if report.verdict < Verdict.WRONG or not causes:
        return report
    diagnosis, cause = report.diagnosis, causes[0]
    diagnosis = replace(
        diagnosis,
        explanations=tuple(e for e in diagnosis.explanations if not OF_WRONG_POSES & {*e.codes}),
        hints=tuple(hint for hint in diagnosis.hints if not OF_WRONG_POSES & {*codes_in(hint)}),
    )
    report = replace(report, diagnosis=diagnosis)
    if diagnosis.explained:
        return report
    codes = [code for explanation in cause.diagnosis.explanations[:1] for code in explanation.codes]
    words = sentence(
        "Its {task} is wrong as well ({codes}): correct that first, since this may build upon it."
        if codes
        else "Its {task} is wrong as well: correct that first, since this may build upon it."
    )
    hint = Sentence(words.template, {"task": cause.task, "codes": ", ".join(codes)})
    others = [other for other in diagnosis.hints if other != NO_NUMBERS]
    diagnosis = replace(diagnosis, explanations=(), hints=(hint, *others))
    return replace(report, diagnosis=diagnosis)


def _with_methods(
    contestant: Contestant, tasks: Sequence[str] | None, seed: int
) -> tuple[Greeting, tuple[Sentence, ...]]:
    """Return the greeting with the methods that answers show, and remarks on them."""
    greeting = contestant.greeting
    task = next((task for task in WITH_METHODS if task in (tasks or greeting.tasks)), None)
    if task is None or task not in greeting.tasks:
        return greeting, ()
    methods = methods_of(contestant, DISCIPLINES[task].cases(greeting, "", seed, False)[2:3])
    if methods == greeting.methods:
        return greeting, ()
    remark = sentence(
        'Judged by the methods that it answers: declare "methods": [{methods}].',
        methods=", ".join(f'"{method}"' for method in methods),
    )
    return msgspec.structs.replace(greeting, methods=methods), (remark,)


def judge_cases(
    contestant: Contestant,
    task: str,
    method: str,
    cases: Sequence[Case],
    notify: Notify = lambda task, count, total: None,
    declared: Greeting | None = None,
    known_faults: Sequence[SwitchFault | str] | None = None,
    budget: Budget | None = None,
) -> TaskReport:
    """Ask a solver some cases of a task and judge its answers; arguments as of `verify`.

    They are judged by what its greeting declares, or by another greeting. What the task builds upon
    is known to have some faults; None if it is right, or they are not known. The searches of a step
    share a budget.
    """
    budget = budget or Budget()
    exchanges = _ask(contestant, cases, partial(notify, task))
    judge: Callable[..., TaskReport] = DISCIPLINES[task].judge
    if known_faults is not None:
        judge = partial(judge, base=known_faults)
    if isinstance(discipline := DISCIPLINES[task], Stepping):
        discipline = discipline._replace(budget=budget)
        judge = partial(discipline.judge, notify=partial(notify, task))
    greeting, reason = precision.judging_greeting(exchanges, declared or contestant.greeting)
    report = judge(exchanges, greeting, method)
    places = precision.decimal_places(exchanges) if report.verdict is Verdict.WRONG else None
    if places is not None:
        words = sentence(
            "All numbers of its answers are rounded to {places} decimals. Return all digits.",
            places=places,
        )
        report = replace(report, diagnosis=Diagnosis(first_broken=words))
    diagnosis = report.diagnosis
    unexplained = report.verdict is Verdict.WRONG and not diagnosis.explained and places is None
    is_double = diagnosis.is_double or precision.is_exact(report)
    if unexplained and greeting.precision == "double" and not is_double:
        single = judge(exchanges, msgspec.structs.replace(greeting, precision="single"), method)
        is_right = single.verdict <= Verdict.RIGHT_EXCEPT
        if not is_right and single.diagnosis.explained and precision.has_double(report):
            report = replace(report, diagnosis=single.diagnosis)
        elif precision.is_off_by_single(report) if is_right else single.diagnosis.explained:
            report, reason = single, precision.INEXACT
    if unsent := len(cases) - len(exchanges):
        hints = (*report.diagnosis.hints, _unsent(unsent, len(cases)))
        report = replace(report, diagnosis=replace(report.diagnosis, hints=hints))
    return replace(report, assumptions=(reason,) if reason else ())


def _unsent(count: int, total: int) -> Sentence:
    return sentence(
        "{hangs} requests got no answer in time, so the last {count} of {total} cases were not "
        "sent. If your program is only slow, allow more time with --time-limit SECONDS; if "
        "not, look for an endless loop in the case below.",
        hangs=MAX_HANGS,
        count=count,
        total=total,
    )


def trials(greeting: Greeting, tasks: Sequence[str] | None = None) -> list[tuple[str, str]]:
    """Return the tasks to be tried, each with a method or ""."""
    for task in tasks or ():
        if task not in greeting.tasks:
            raise ValueError(
                f"task: expected one that the solver offers ({', '.join(greeting.tasks)}), "
                f"got {task!r}"
            )
    return [
        (task, method)
        for task in DISCIPLINES
        if task in (tasks or greeting.tasks)
        for method in (greeting.methods if task in WITH_METHODS else ("",))
    ]


def _ask(
    contestant: Contestant, cases: Sequence[Case], notify: Callable[[int, int], None]
) -> list[Exchange]:
    """Ask each case, then each answered case a second time.

    Forces and energies are asked again in reverse, so that what is left over from the request
    before shows.
    """
    answers, hangs = [], 0
    for i, case in enumerate(cases):
        notify(i, 2 * len(cases))
        answers.append(contestant.answer(case))
        hangs += is_hung(answers[-1])
        if hangs == MAX_HANGS:
            break
    exchanges, requests = [], list(zip(cases, answers, strict=False))
    order = -1 if cases and cases[0].task in (forces.TASK, energy.TASK) else 1
    for i, (case, answer) in enumerate(requests[::order]):
        notify(len(cases) + i, 2 * len(cases))
        is_last = isinstance(answer, Failure) or hangs >= 2 * MAX_HANGS
        repeat = answer if is_last else contestant.answer(case)
        hangs += not is_last and is_hung(repeat)
        exchanges.append(Exchange(case, with_lesser_time(answer, repeat), repeat))
    return exchanges[::order]
