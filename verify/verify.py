"""Ask a solver every case of its tasks, judge its answers, and explain wrong answers."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import msgspec

from plumbob.text.sentence import Sentence, codes_in, sentence

from .case import Case
from .cause_search import SECONDS, CauseSearch, JudgedAnswers
from .disciplines import DISCIPLINES
from .exchange import Connection, Exchange, Failure, NoGreetingError, is_hung
from .greeting import Greeting
from .judgement import Diagnosis, Report, TaskReport, Verdict
from .kinematics import inverse_kinematics
from .kinematics.claims import OF_WRONG_POSES
from .laws import NO_NUMBERS
from .mass_spring import energy, forces
from .observe import observations
from .one_line.search import with_changed_line
from .take import inference, kept_state, precision, zeros
from .take.examination import Examiner
from .task import BUILDS_ON
from .timing import with_lesser_time

# After so many timeouts in a task no more cases are asked, nor asked again.
MAX_HANGS = 2
# Tasks with a trial for every method of the greeting.
WITH_METHODS = ("inverse_kinematics", "track")
# Called with the present work, the number of sent requests, and of all requests (None if unknown).
Notify = Callable[[Sentence, int, int | None], None]


# What is found out about answers beside laws, in this order.
EXAMINERS: Sequence[Examiner] = (
    precision.examine, inference.examine, zeros.examine, kept_state.examine,
)  # fmt: skip


def verify(
    connection: Connection,
    tasks: Sequence[str] | None = None,
    seed: int = 0,
    thorough: bool = False,
    notify: Notify = lambda work, count, total: None,
    publish: Callable[[Report], None] = lambda report: None,
) -> Report:
    """Try a solver at its tasks, by default at all offered tasks, and return the report.

    The cases are random by the seed; there are more if `thorough`. All tasks are judged before the
    cause of any wrong answer is sought: after each, `publish` is called with the verdicts so far.
    `notify` is called before each request, judgement and search.

    Raises:
        ValueError: if a task is not offered.
    """
    greeting, remarks = _with_methods(connection, tasks, seed)
    attempts, reports, unjudged = list[Attempt](), list[TaskReport](), list[str]()
    pairs = trials(greeting, tasks)
    for task, method in pairs:
        attempt = Attempt(connection, task, method, seed, thorough, notify)
        try:
            reports.append(attempt.examine())
            attempts.append(attempt)
        except NoGreetingError:
            raise
        except Exception as error:
            unjudged.append(task)
            remarks += (sentence("{task}: {why}", task=task, why=failed(error)),)
        report = Report(connection.greeting, tuple(reports), seed, remarks, tuple(unjudged))
        publish(replace(report, remarks=(*remarks, _unfinished(len(reports), len(pairs)))))
    explained, is_interrupted = list[TaskReport](), False
    for attempt, verdict in zip(attempts, reports, strict=True):
        observation = CauseSearch(is_interrupted)
        observed = attempt.observe(verdict, observation)
        cause_search = CauseSearch(is_interrupted or observation.is_interrupted)
        explanation = attempt.explain(verdict, explained, cause_search)
        explained.append(_with_observations(explanation, observed))
        is_interrupted = cause_search.is_interrupted
    return Report(connection.greeting, explained, seed, remarks, tuple(unjudged))


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


@dataclass
class Attempt:
    """A solver at a task: requests and judgement, then the explanation of wrong answers."""

    connection: Connection
    task: str
    method: str
    seed: int
    thorough: bool
    notify: Notify
    answers: dict[str, Sequence[Exchange]] = field(default_factory=dict)  # by the cases' greeting
    unsent: Sentence | None = None  # that the last cases were not sent, if any

    def _ask(self, greeting: Greeting) -> Sequence[Exchange]:
        """Return the answers to suitable cases of a greeting; each case is asked once."""
        key = repr(greeting)
        if key not in self.answers:
            cases = DISCIPLINES[self.task].cases(greeting, self.method, self.seed, self.thorough)
            self.answers[key] = self.exchange(cases)
        return self.answers[key]

    def exchange(self, cases: Sequence[Case]) -> Sequence[Exchange]:
        """Return the answers to some cases."""
        exchanges = _ask(self.connection, cases, self.notify)
        if unsent := len(cases) - len(exchanges):
            self.unsent = _unsent(unsent, len(cases))
        return exchanges

    def judge(self, greeting: Greeting, exchanges: Sequence[Exchange] | None = None) -> TaskReport:
        """Judge the given answers by a greeting, or else answers to all suitable cases."""
        exchanges = self._ask(greeting) if exchanges is None else exchanges
        self.notify(sentence("judging {task}", task=self.task), 0, None)
        greeting, reason = precision.judging_greeting(exchanges, greeting)
        report = DISCIPLINES[self.task].judge(exchanges, greeting, self.method)
        reasons = (reason,) if reason else ()
        report = replace(report, assumptions=reasons, exchanges=exchanges, greeting=greeting)
        return self._with_unsent(report)

    def examine(self, exchanges: Sequence[Exchange] | None = None) -> TaskReport:
        """Return the report with the verdict, by laws, honest programs and examiners alone."""
        report = self.judge(self.connection.greeting, exchanges)
        for examiner in EXAMINERS if exchanges is None else (precision.examine,):
            report = examiner(self, report)
        return report

    def observe(self, verdict: TaskReport, search: CauseSearch) -> tuple[Sentence, ...]:
        """Return observations on wrong answers, or the reason for none; () for right answers."""
        silence: tuple[Sentence, ...] = ()
        observe = partial(observations.observe, self.connection, verdict, self.seed)
        observed = search.run_in_time(observe, silence)
        is_failed = search.end is not None and not search.is_interrupted
        return (search.end,) if is_failed and search.end else observed

    def explain(
        self, verdict: TaskReport, reports: Sequence[TaskReport], cause_search: CauseSearch
    ) -> TaskReport:
        """Return the report on a verdict with the cause of wrong answers, if found in time.

        `reports` are the reports on earlier tasks. The verdict stays.
        """
        if verdict.verdict is Verdict.RIGHT and self.task != inverse_kinematics.TASK:
            return verdict
        work = sentence(
            "{task}: searching for the cause (at most {seconds:.0f} CPU s)",
            task=self.task,
            seconds=SECONDS,
        )
        self.notify(work, 0, None)
        find_cause = partial(self._explained, verdict, reports, cause_search)
        report = self._with_unsent(cause_search.run_in_time(find_cause, verdict))
        if cause_search.end is None or report.verdict <= Verdict.RIGHT_EXCEPT:
            return report
        hints = (cause_search.end, *report.diagnosis.hints)
        return replace(report, diagnosis=replace(report.diagnosis, hints=hints))

    def _explained(
        self, verdict: TaskReport, reports: Sequence[TaskReport], search: CauseSearch
    ) -> TaskReport:
        causes = [report for report in reports if _builds_on(self.task, self.method, report)]
        order = BUILDS_ON.get(self.task, ())
        causes.sort(key=lambda r: (not r.diagnosis.explained, order.index(r.task)))
        is_placed = not (causes and causes[0].diagnosis.explained)
        diagnose = partial(self._diagnosis, search, is_placed)
        report = search.run(lambda: _with_diagnosis(verdict, diagnose), verdict)
        if not causes and report.greeting is not None:
            is_stuck = any(is_hung(exchange.answer) for exchange in report.exchanges)
            connection = None if is_stuck else self.connection  # a stuck solver is asked no more
            find_line = partial(with_changed_line, report, report.greeting, connection)
            report = search.run(find_line, report)
            original = report.original
            if original is not None and not report.diagnosis.explained:
                greeting = self.connection.greeting
                find_line = partial(
                    with_changed_line, original, greeting, self.connection, known_alone=True
                )
                report = _unless_meant(report, search.run(find_line, original))
        return _with_cause(report, causes)

    def _diagnosis(self, search: CauseSearch, is_placed: bool, report: TaskReport) -> Diagnosis:
        """Return the diagnosis before lines are changed."""
        greeting = report.greeting or self.connection.greeting
        answers = JudgedAnswers(report, greeting, search, is_placed)
        return DISCIPLINES[self.task].diagnose(answers)

    def _with_unsent(self, report: TaskReport) -> TaskReport:
        unsent, hints = self.unsent, report.diagnosis.hints
        if unsent is None or unsent in hints:
            return report
        return replace(report, diagnosis=replace(report.diagnosis, hints=(*hints, unsent)))


def _with_diagnosis(report: TaskReport, diagnose: Callable[[TaskReport], Diagnosis]) -> TaskReport:
    """Return a report with its diagnosis, after the explanations of examiners."""
    before = report.diagnosis
    if before.is_certain:
        return report
    diagnosis = diagnose(report)
    explanations = (*before.explanations, *diagnosis.explanations)
    return replace(report, diagnosis=replace(diagnosis, explanations=explanations))


def _unless_meant(report: TaskReport, original: TaskReport) -> TaskReport:
    """Return a report by restricted requests with the explanations of answers to all requests.

    A false claim is no explanation where the restriction is meant.
    """
    explanations = original.diagnosis.explanations
    if report.verdict <= Verdict.UNDECIDED:
        explanations = tuple(
            replace(e, sentence=sentence("If that is not meant: {what}", what=e.sentence))
            for e in explanations
            if not {code.split("-")[1] for code in e.codes} <= {"CLAIM"}
        )
    return replace(report, diagnosis=replace(report.diagnosis, explanations=explanations))


def _with_observations(report: TaskReport, observed: tuple[Sentence, ...]) -> TaskReport:
    """Return a report with its observations."""
    if not observed:
        return report
    return replace(report, diagnosis=replace(report.diagnosis, observations=observed))


def _builds_on(task: str, method: str, report: TaskReport) -> bool:
    """Return whether a task builds upon the task of a report with wrong or doubtful answers."""
    is_earlier = report.task in BUILDS_ON.get(task, ()) and report.method in ("", method)
    is_assumed = bool(report.assumptions and report.diagnosis.explanations)
    return is_earlier and (report.verdict >= Verdict.WRONG or is_assumed)


def _with_cause(report: TaskReport, causes: Sequence[TaskReport]) -> TaskReport:
    """Return a report on unexplained answers with the mistakes of the tasks below.

    False claims by wrong poses explain nothing.
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
    hints = [words for words in diagnosis.hints if words != NO_NUMBERS]
    diagnosis = replace(diagnosis, explanations=(), hints=(hint, *hints))
    return replace(report, diagnosis=diagnosis)


def _with_methods(
    connection: Connection, tasks: Sequence[str] | None, seed: int
) -> tuple[Greeting, tuple[Sentence, ...]]:
    """Return the greeting with the methods of its answers, and remarks on these methods."""
    greeting = connection.greeting
    task = next((task for task in WITH_METHODS if task in (tasks or greeting.tasks)), None)
    if task is None or task not in greeting.tasks:
        return greeting, ()
    methods = inference.methods_of(
        connection, DISCIPLINES[task].cases(greeting, "", seed, False)[2:3]
    )
    if methods == greeting.methods:
        return greeting, ()
    remark = sentence(
        'Judged by the methods that it answers: declare "methods": [{methods}].',
        methods=", ".join(f'"{method}"' for method in methods),
    )
    return msgspec.structs.replace(greeting, methods=methods), (remark,)


def judge_cases(
    connection: Connection,
    task: str,
    method: str,
    cases: Sequence[Case],
    notify: Notify = lambda work, count, total: None,
) -> TaskReport:
    """Ask a solver some cases of a task, judge its answers and explain wrong answers.

    The arguments are as of `verify`.
    """
    attempt = Attempt(connection, task, method, 0, False, notify)
    verdict = attempt.examine(attempt.exchange(cases))
    return attempt.explain(verdict, (), CauseSearch())


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


def _ask(connection: Connection, cases: Sequence[Case], notify: Notify) -> list[Exchange]:
    """Ask each case, then each answered case a second time.

    Forces and energies are asked again in reverse, to show remains of the last request.
    """
    answers, hangs, work = [], 0, sentence("asking {task}", task=cases[0].task if cases else "")
    for i, case in enumerate(cases):
        notify(work, i, 2 * len(cases))
        answers.append(connection.answer(case))
        hangs += is_hung(answers[-1])
        if hangs == MAX_HANGS:
            break
    exchanges, requests = [], list(zip(cases, answers, strict=False))
    order = -1 if cases and cases[0].task in (forces.TASK, energy.TASK) else 1
    for i, (case, answer) in enumerate(requests[::order]):
        notify(work, len(cases) + i, 2 * len(cases))
        is_last = isinstance(answer, Failure) or hangs >= 2 * MAX_HANGS
        repeat = answer if is_last else connection.answer(case)
        hangs += not is_last and is_hung(repeat)
        exchanges.append(Exchange(case, with_lesser_time(answer, repeat), repeat))
    return exchanges[::order]
