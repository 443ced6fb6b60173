"""Any program as a connection: JSON lines on its standard input and output."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from plumbob.process.child import ChildProcess, LostError
from plumbob.text.printable import one_line
from plumbob.text.sentence import Sentence, sentence

from .. import message
from ..case import Case
from ..exchange import Answer, Failure, FailureKind, NoGreetingError
from ..greeting import Greeting
from ..task import TASKS
from .claimed_time import ClaimedTimes
from .losses import LIMITS, FailureError, ProcessLimits, departure, failure_of, garbage, not_started


class ProgramConnection:
    """A program, started for its first request, and anew after a loss."""

    def __init__(
        self, command: Sequence[str], folder: Path | None = None, limits: ProcessLimits = LIMITS
    ) -> None:
        if not command:
            raise ValueError("command: expected a program and its arguments, got nothing")
        self.remarks: tuple[Sentence, ...] = ()
        self._command = tuple(map(str, command))
        self._folder = folder
        self._limits = limits
        self._process: ChildProcess | None = None
        self._greeting: Greeting | None = None
        self._number = 0  # of the request
        self._warm: set[object] = set()  # tasks and methods that were requested before
        self._print: bytes | None = None  # the first line that is no answer
        self._times: ClaimedTimes
        self._untimed: Sentence | None = None  # why claimed times are not believed

    @property
    def greeting(self) -> Greeting:
        """Its description of itself; raise NoGreetingError without a start or a greeting."""
        if self._greeting is None:
            try:
                self._ready()
            except FailureError as error:
                self._lose()
                raise NoGreetingError(error.failure) from None
        assert self._greeting is not None
        return self._greeting

    def answer(self, case: Case) -> Answer | Failure:
        """Send a request; a lost program is started again for the next case."""
        try:
            return self._answer(self._ready(), case)
        except FailureError as error:
            self._lose()
            return error.failure

    def close(self) -> None:
        """End the program's input, then the program with all its processes."""
        process, self._process = self._process, None
        if process is not None:
            remarks = departure(process, self._limits.leave)
            self.remarks += tuple(remark for remark in remarks if remark not in self.remarks)

    def _lose(self) -> None:
        process, self._process = self._process, None
        if process is not None:
            process.end()

    def _ready(self) -> ChildProcess:
        """Return the process, started and greeted if there was none."""
        if self._process is None:
            self._number, self._warm, self._print = 0, set(), None
            memory, line = self._limits.memory, self._limits.line
            try:
                self._process = ChildProcess(
                    self._command, folder=self._folder, memory=memory, longest=line
                )
            except (OSError, ValueError) as error:
                raise not_started(self._command[0], error) from None
            self._greet(self._process)
            self._times = ClaimedTimes(self._process.pid)
        return self._process

    def _greet(self, process: ChildProcess) -> None:
        fields, *_ = self._exchange(process, message.encode_greeting(), self._limits.first)
        if fields.get("error") is not None:
            failure = message.decode_error(fields)
            raise FailureError(failure.kind, failure.sentence)
        try:
            greeting = message.decode_greeting(fields)
        except ValueError as error:
            raise FailureError(FailureKind.GARBAGE, sentence("{why}", why=str(error))) from None
        if isinstance(fields.get("printed"), str):
            self._print = fields["printed"].encode()
        self._greeting = self._greeting or greeting

    def _answer(self, process: ChildProcess, case: Case) -> Answer | Failure:
        kind = (case.task, case.inputs.get("method"))
        patience = self._limits.request if kind in self._warm else self._limits.first
        self._number += 1
        line = message.encode_case(self._number, case)
        self._times.begin()
        fields, seconds, size = self._exchange(process, line, patience)
        answer = message.decode_answer(fields, TASKS[case.task], case.inputs, seconds)
        if isinstance(answer, Answer) and answer.untimed is None and answer.seconds:
            self._untimed = self._untimed or self._times.end(answer.seconds, len(line) + size)
            if self._untimed is not None:
                answer = replace(answer, seconds=seconds, untimed=self._untimed)
        if kind not in self._warm:  # it may have compiled, and started what will compute
            self._times = ClaimedTimes(process.pid)
            self._warm.add(kind)
        printed, self._print = self._print, None
        if isinstance(answer, Answer) and printed is not None and "printed" not in fields:
            return replace(answer, remarks=(*answer.remarks, message.prints(printed)))
        return answer

    def _exchange(
        self, process: ChildProcess, line: bytes, patience: float
    ) -> tuple[Mapping[str, Any], float, int]:
        """Send a request; return its answer, the round trip [s], and the received bytes."""
        start, size = time.monotonic(), 0
        process.send(line)
        for _ in range(self._limits.prints + 1):
            try:
                received = process.receive(start + patience - time.monotonic())
            except LostError as error:
                failure = failure_of(error.loss, process, self._limits, patience)
                raise self._with_prints(failure) from None
            seconds = time.monotonic() - start
            size += len(received)
            fields = self._decode(received)
            if fields is not None:
                return fields, seconds, size
        example = one_line(self._print or b"", 80)
        raise garbage("prints", count=self._limits.prints, line=example)

    def _decode(self, line: bytes) -> Mapping[str, Any] | None:
        """Return the answer of a line, or None for a print."""
        try:
            fields = message.decode_object(line)
        except ValueError as error:
            raise garbage("broken line", why=str(error)) from None
        if fields is None or not line.lstrip(b"\xef\xbb\xbf \t").startswith(b"{"):
            self._print = self._print or line.strip() or None
        number = fields.get("id") if fields is not None else self._number
        if number == self._number and not isinstance(number, bool):
            return fields
        key = "no id" if number is None else "another id"
        raise garbage(key, number=self._number, id=one_line(repr(number), 40))

    def _with_prints(self, error: FailureError) -> FailureError:
        """Return a loss with an example of the program's earlier prints, if there are any."""
        if self._print is None:
            return error
        words = sentence(
            "{what} Before it had printed lines that are no answers, for example: {line}",
            what=error.failure.sentence,
            line=one_line(self._print, 80),
        )
        return FailureError(error.failure.kind, words)
