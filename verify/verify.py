"""Ask a solver every case of its tasks, judge its answers, and explain wrong answers."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple, Protocol

import msgspec

from plumbob.text.sentence import Sentence, codes_in, sentence

from . import precision
from .case import Case
from .cause_search import SECONDS, CauseSearch, NoSearch
from .contestant import Contestant, Exchange, Failure, NoGreetingError, is_hung
from .greeting import Greeting
from .inference import Inference, infer, inferred, methods_of
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
from .mass_spring.stepping import Stepping
from .one_line.search import with_changed_line
from .task import BUILDS_ON
from .timing import with_lesser_time

# After so many timeouts in a task its other cases are not asked, nor are they asked again.
MAX_HANGS = 2
# Tasks that are tried once for every method that the greeting names.
WITH_METHODS = ("inverse_kinematics", "track")
# Called with what is done, and the number of requests sent, and of all; None if they are not known.
Notify = Callable[[Sentence, int, int | None], None]


class Discipline(Protocol):
    """A module that tries one task."""

    def cases(self, greeting: Greeting, method: str, seed: int, thorough: bool) -> list[Case]:
        """Return cases that suit the solver, from trivial to hostile, the smallest first."""

    def judge(
        self,
        exchanges: Sequence[Exchange],
        greeting: Greeting,
        method: str,
        *,
        cause_search: CauseSearch | None = None,
    ) -> TaskReport:
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
    notify: Notify = lambda work, count, total: None,
    publish: Callable[[Report], None] = lambda report: None,
) -> Report:
    """Try a solver at its tasks, by default all that it offers, and return the report.

    The cases are random by the seed; there are more if `thorough`. All tasks are judged before the
    cause of any wrong answer is sought: after each, `publish` is called with the verdicts so far.
    `notify` is called before each request, judgement and search.

    Raises:
        ValueError: if a task is not offered.
    """
    greeting, remarks = _with_methods(contestant, tasks, seed)
    attempts, reports, unjudged = list[Attempt](), list[TaskReport](), list[str]()
    pairs = trials(greeting, tasks)
    for task, method in pairs:
        attempt = Attempt(contestant, task, method, seed, thorough, notify)
        try:
            reports.append(attempt.judge(reports))
            attempts.append(attempt)
        except NoGreetingError:
            raise
        except Exception as error:
            unjudged.append(task)
            remarks += (sentence("{task}: {why}", task=task, why=failed(error)),)
        report = Report(contestant.greeting, tuple(reports), seed, remarks, tuple(unjudged))
        publish(replace(report, remarks=(*remarks, _unfinished(len(reports), len(pairs)))))
    explained, is_interrupted = list[TaskReport](), False
    for attempt, verdict in zip(attempts, reports, strict=True):
        cause_search = CauseSearch(is_interrupted)
        explained.append(attempt.explain(verdict, explained, cause_search))
        is_interrupted |= cause_search.is_interrupted
    return Report(contestant.greeting, explained, seed, remarks, tuple(unjudged))


def failed(error: Exception) -> Sentence:
    """Return why there is no verdict."""
    return sentence(
        "No verdict: the judge itself failed ({error}). Please report this as a mistake of "
        "Plumbob.",
        error=f"{type(error).__name__}: {error}",
    )


def _unfinished(count: int, total: int) -> Sentence:
    return sentence(
        "This was written before the end: {count} of {total} tasks are judged, and no cause of "
        "wrong answers has been sought.",
        count=count,
        total=total,
    )


class Answers(NamedTuple):
    """The exchanges of a solver with the judge, and the cases that they are of."""

    cases: Sequence[Case]
    exchanges: Sequence[Exchange]  # fewer than the cases if too many hang


class Attempt:
    """A solver at a task: it is asked and judged, then its wrong answers are explained."""

    def __init__(
        self,
        contestant: Contestant,
        task: str,
        method: str,
        seed: int,
        thorough: bool,
        notify: Notify,
    ) -> None:
        self.task, self._contestant, self._method = task, contestant, method
        self._seed, self._thorough, self._notify = seed, thorough, notify
        self._answers: dict[str, Answers] = {}  # by the greeting that the cases suit
        self._inference = Inference(())

    def _answers_to(self, greeting: Greeting) -> Answers:
        """Return the answers to the cases that suit a greeting, which are asked once."""
        key = repr(greeting)
        if key not in self._answers:
            discipline = DISCIPLINES[self.task]
            cases = discipline.cases(greeting, self._method, self._seed, self._thorough)
            exchanges = _ask(self._contestant, cases, self._notify)
            self._answers[key] = Answers(cases, exchanges)
        return self._answers[key]

    def judge(self, reports: Sequence[TaskReport]) -> TaskReport:
        """Return the report with the verdict by laws and honest methods alone.

        `reports` are those on earlier tasks.
        """
        greeting, causes = self._contestant.greeting, self._causes(reports)
        judge = partial(self._judged, NoSearch(), _known_faults(self.task, reports, causes))
        report = judge(greeting)
        self._inference = infer(self._contestant, report, judge)
        return inferred(report, greeting, self._inference, judge)

    def explain(
        self, verdict: TaskReport, reports: Sequence[TaskReport], cause_search: CauseSearch
    ) -> TaskReport:
        """Return the report on a verdict with the cause of wrong answers, if one is found in time.

        `reports` are those on earlier tasks.
        """
        if verdict.verdict is Verdict.RIGHT and self.task != inverse_kinematics.TASK:
            return verdict
        work = sentence(
            "{task}: searching for the cause (at most {seconds:.0f} CPU s)",
            task=self.task,
            seconds=SECONDS,
        )
        self._notify(work, 0, None)
        return _explained(partial(self._explain, reports, cause_search), verdict, cause_search)

    def _explain(self, reports: Sequence[TaskReport], cause_search: CauseSearch) -> TaskReport:
        causes, greeting = self._causes(reports), self._contestant.greeting
        judge = partial(self._judged, cause_search, _known_faults(self.task, reports, causes))
        report = inferred(judge(greeting), greeting, self._inference, judge)
        find_state = partial(with_kept_state, self._contestant, report)
        report = cause_search.run(find_state, report)
        if not causes:
            find_line = partial(with_changed_line, report, greeting)
            report = cause_search.run(find_line, report)
        return _with_cause(report, causes)

    def _causes(self, reports: Sequence[TaskReport]) -> list[TaskReport]:
        """Return the reports on wrong answers of what the task builds upon, explained first."""
        causes = [report for report in reports if _builds_on(self.task, self._method, report)]
        order = BUILDS_ON.get(self.task, ())
        return sorted(causes, key=lambda r: (not r.diagnosis.explained, order.index(r.task)))

    def _judged(
        self,
        cause_search: CauseSearch,
        known_faults: Sequence[SwitchFault | str] | None,
        greeting: Greeting,
    ) -> TaskReport:
        answers = self._answers_to(greeting)
        if not cause_search.is_on:
            self._notify(sentence("judging {task}", task=self.task), 0, None)
        return _judge_answers(
            answers, self.task, self._method, greeting, known_faults, cause_search
        )


def _explained(
    find: Callable[[], TaskReport], verdict: TaskReport, cause_search: CauseSearch
) -> TaskReport:
    """Return the report with a cause, or that on the verdict and why the search ended early."""

    def find_in_time() -> TaskReport:
        with cause_search.limited():
            return find()

    report = cause_search.run(find_in_time, verdict)
    if cause_search.end is None or report.verdict <= Verdict.RIGHT_EXCEPT:
        return report
    hints = (cause_search.end, *report.diagnosis.hints)
    return replace(report, diagnosis=replace(report.diagnosis, hints=hints))


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
    notify: Notify = lambda work, count, total: None,
) -> TaskReport:
    """Ask a solver some cases of a task, judge its answers and explain wrong answers.

    The arguments are those of `verify`.
    """
    answers = Answers(cases, _ask(contestant, cases, notify))
    judge = partial(_judge_answers, answers, task, method, contestant.greeting, None)
    cause_search = CauseSearch()
    return _explained(partial(judge, cause_search), judge(NoSearch()), cause_search)


def _judge_answers(
    answers: Answers,
    task: str,
    method: str,
    greeting: Greeting,
    known_faults: Sequence[SwitchFault | str] | None,
    cause_search: CauseSearch,
) -> TaskReport:
    """Judge answers by what a greeting declares.

    What the task builds upon is known to have some faults; None if it is right, or they are not
    known.
    """
    exchanges, total = answers.exchanges, len(answers.cases)
    judge: Callable[..., TaskReport] = partial(DISCIPLINES[task].judge, cause_search=cause_search)
    if known_faults is not None:
        judge = partial(judge, base=known_faults)
    greeting, reason = precision.judging_greeting(exchanges, greeting)
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
    if unsent := total - len(exchanges):
        hints = (*report.diagnosis.hints, _unsent(unsent, total))
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


def _ask(contestant: Contestant, cases: Sequence[Case], notify: Notify) -> list[Exchange]:
    """Ask each case, then each answered case a second time.

    Forces and energies are asked again in reverse, so that what is left over from the request
    before shows.
    """
    answers, hangs, work = [], 0, sentence("asking {task}", task=cases[0].task if cases else "")
    for i, case in enumerate(cases):
        notify(work, i, 2 * len(cases))
        answers.append(contestant.answer(case))
        hangs += is_hung(answers[-1])
        if hangs == MAX_HANGS:
            break
    exchanges, requests = [], list(zip(cases, answers, strict=False))
    order = -1 if cases and cases[0].task in (forces.TASK, energy.TASK) else 1
    for i, (case, answer) in enumerate(requests[::order]):
        notify(work, len(cases) + i, 2 * len(cases))
        is_last = isinstance(answer, Failure) or hangs >= 2 * MAX_HANGS
        repeat = answer if is_last else contestant.answer(case)
        hangs += not is_last and is_hung(repeat)
        exchanges.append(Exchange(case, with_lesser_time(answer, repeat), repeat))
    return exchanges[::order]
