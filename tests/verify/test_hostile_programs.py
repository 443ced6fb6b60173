"""Whatever a program does, there is a sentence for it, the next case works, and nothing stays."""

import os
import re
import signal
import sys
import time
import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from hostile_programs import LIMITS, LOOP, case, program, running

from plumbob.process import child as child_process
from plumbob.process.child import ChildProcess
from plumbob.verify.connections.program import ProgramConnection
from plumbob.verify.exchange import Answer, Failure, FailureKind, NoGreetingError
from plumbob.verify.judgement import Diagnosis, TaskReport
from plumbob.verify.verify import DISCIPLINES, verify

TABLE = tomllib.loads((Path(__file__).parents[1] / "hostile_programs.toml").read_text("utf-8"))
AT_THE_START = TABLE.pop("start")
HOSTILE = {name: row | {"kind": kind} for kind, rows in TABLE.items() for name, row in rows.items()}


def ask(folder, name):
    """What a program answers before, when and after it misbehaves, and what still runs then."""
    patience = LIMITS.request if HOSTILE[name]["kind"] == "hung" else LIMITS.first
    connection = program(folder, HOSTILE[name]["does"], LIMITS._replace(request=patience))
    try:
        before, failure = connection.answer(case(2)), connection.answer(case(3))
        if name == "closes its input":  # it has answered first, and cannot read the next
            assert isinstance(failure, Answer)
            failure = connection.answer(case(3))
        return before, failure, connection.answer(case(2)), connection
    finally:
        connection.close()


def greet(folder, name):
    """Why a program does not greet, twice."""
    row = AT_THE_START[name]
    limits = LIMITS._replace(first=1.5 if row["kind"] == "hung" else LIMITS.first)
    connection = program(folder, "pass", limits, loop=f"{row['does']}\nwhile True: tick()")
    failures = []
    for _ in range(2):
        with pytest.raises(NoGreetingError) as caught:
            _ = connection.greeting
        failures.append(caught.value.failure)
    return (*failures, connection.answer(case(2)), connection)


def waits_for_programs(item):
    return "outcomes" in getattr(item, "fixturenames", ()) and hasattr(item, "callspec")


@pytest.fixture(scope="module")
def outcomes(request, tmp_path_factory):
    """What becomes of the programs; most of them are waited for, so they run beside each other."""
    chosen = {
        one.callspec.params.get("name") for one in request.session.items if waits_for_programs(one)
    }
    with ThreadPoolExecutor(6) as pool:
        yield {
            (what, name): (folder, pool.submit(what, folder, name))
            for what, names in ((ask, HOSTILE), (greet, AT_THE_START))
            for name in names
            if name in chosen
            for folder in [tmp_path_factory.mktemp("hostile")]
        }


def check(folder, failures, row):
    for failure in failures:
        assert isinstance(failure, Failure)
        assert re.search(row["words"], str(failure.sentence)), str(failure.sentence)
        assert failure.kind == row["kind"]
    assert not running(folder)


@pytest.mark.sample(without=["a format", "closes all", "forks and ends"], every=3)
@pytest.mark.parametrize("name", HOSTILE)
def test_each_has_its_sentence_and_the_next_case_works(outcomes, name):
    folder, future = outcomes[ask, name]
    before, failure, after, connection = future.result()
    assert isinstance(before, Answer)
    assert isinstance(after, Answer)
    assert connection.remarks == ()
    check(folder, [failure], HOSTILE[name])


@pytest.mark.parametrize("name", AT_THE_START)
def test_what_does_not_greet_is_a_misuse_with_its_sentence(outcomes, name):
    folder, future = outcomes[greet, name]
    *failures, _ = future.result()
    check(folder, failures, AT_THE_START[name])


@pytest.fixture
def start(tmp_path):
    """Start a program in this test's folder; it leaves nothing running when the test is done."""
    connections = []

    def begin(misbehave, **options):
        connections.append(program(tmp_path, misbehave, **options))
        return connections[-1]

    yield begin
    for connection in connections:
        connection.close()
    assert not running(tmp_path)


def test_a_large_request_that_is_not_read_blocks_nothing(start):
    connection = start("while True: tick()")
    connection.answer(case(2))
    connection._ready().send(b'{"id": 1, "parents": [1, 2, 3]}\n' + b" " * (4 << 20))
    failure = connection.answer(case(3))
    assert failure.kind is FailureKind.HUNG
    assert "did not read the whole request" in str(failure.sentence)


def test_large_requests_and_answers_pass(start):
    connection = start("pass", limits=LIMITS._replace(request=20.0, line=1 << 24))
    assert isinstance(connection.answer(case(2)), Answer)
    assert connection.answer(case(20_000)).values["positions"].shape == (20_000, 3)


def finally_do(what):
    """The usual loop, and what the program does once its input has ended."""
    return f"try:{LOOP}".replace("\n", "\n    ") + f"\nfinally:\n    {what}"


LEAVES_A_CHILD = f"if os.fork() == 0:\n    while True: tick()\n{LOOP}"


@pytest.mark.parametrize(
    ("loop", "remark"),
    [
        (LOOP, None),
        (LOOP.replace("read()\n", "read()\n    print('joint 1')\n", 1), None),
        (finally_do("os._exit(7)"), "exit code 7"),
        (finally_do("os.abort()"), "it did not exit normally: it aborted"),
        (finally_do("while True: tick()"), "does not exit when its input ends"),
        (LEAVES_A_CHILD, r"left processes running that it had started \(1\)"),
    ],
    ids=["leaves", "prints", "code", "aborts", "stays", "leaves a child"],
)
def test_how_it_leaves_is_remarked(tmp_path, start, loop, remark):
    connection = start("pass", loop=loop, limits=LIMITS._replace(leave=3.0))
    if remark and "does not" in remark:
        connection._limits = LIMITS
    assert isinstance(connection.answer(case(2)), Answer)
    connection.close()
    assert len(connection.remarks) == (remark is not None)
    assert all(re.search(remark, str(one)) for one in connection.remarks)
    assert not running(tmp_path)
    assert isinstance(connection.answer(case(2)), Answer)  # a closed one starts anew


@pytest.mark.parametrize(
    "words",
    [
        "print('joint 1')",
        "print('joint 1\\n[1, 2]\\n\\n3')",
        "print('joint 1', end=' ')",  # on the answer's line
        "sys.stdout.buffer.write(b'joint 1 \\xff\\x00\\n')",
    ],
)
def test_prints_are_a_remark_on_the_answer(start, words):
    connection = start(f"{words}; right(request)")
    answers = [connection.answer(case(joints)) for joints in (2, 3, 2)]
    first, told, last = ([str(one) for one in answer.remarks] for answer in answers)
    assert (first, last) == ([], [])
    assert len(told) == 1
    assert "It prints to its standard output, for example: joint 1" in told[0]


def test_blank_lines_and_a_byte_order_mark_are_no_prints(start):
    connection = start("print('\\n\\r\\n\\ufeff', end=''); right(request)")
    assert connection.answer(case(3)).remarks == ()


def test_the_first_request_of_a_task_may_compile(start):
    connection = start("time.sleep(0.8); right(request)", limits=LIMITS._replace(request=0.4))
    assert isinstance(connection.answer(case(3)), Answer)
    assert connection.answer(case(3)).kind is FailureKind.HUNG
    assert isinstance(connection.answer(case(3)), Answer)


def test_a_late_answer_is_not_taken_for_the_next_one(start):
    connection = start("time.sleep(1.0); right(request)")
    connection.answer(case(2))
    assert connection.answer(case(3)).kind is FailureKind.HUNG
    assert connection.answer(case(2)).values["positions"][0, 0] == 1.0  # of a process anew


def test_a_hang_quotes_standard_error_of_its_own_request_only(start):
    """What follows a crash is read with the words before it: they may tell why."""
    before = "right(request); os.write(2, b'of an earlier request')"
    connection = start(
        "os.write(2, b'of this request\\n')\nwhile True: tick()",
        loop=LOOP.replace("right(request)", before),
    )
    assert isinstance(connection.answer(case(2)), Answer)
    time.sleep(0.2)
    words = str(connection.answer(case(3)).sentence)
    assert words.endswith("Its last lines on standard error: of this request")
    crash = start("os._exit(3)", loop=LOOP.replace("right(request)", before))
    assert isinstance(crash.answer(case(2)), Answer)
    assert "standard error: of an earlier request" in str(crash.answer(case(3)).sentence)


@pytest.mark.parametrize(
    ("content", "mode", "words"),
    [
        (None, 0, "There is no command"),
        ("#!/bin/sh\n", 0o644, "cannot be executed: chmod"),
        ("no program", 0o755, "cannot be started .*: is it built for this machine"),
        ("#!/nowhere/python\n", 0o755, "cannot be started"),
        ("\x7fELF", 0o755, "cannot be started"),
    ],
)
def test_what_cannot_be_started_says_why(tmp_path, content, mode, words):
    file = tmp_path / "solver"
    if content is not None:
        file.write_text(content)
        file.chmod(mode)
    with pytest.raises(NoGreetingError, match=words):
        _ = ProgramConnection([str(file)]).greeting


def test_a_program_here_needs_its_dot(tmp_path, monkeypatch):
    (tmp_path / "my_solver").write_text("")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(NoGreetingError, match=r"for the file here write \./my_solver"):
        _ = ProgramConnection(["my_solver"]).greeting


def test_a_program_without_a_command_is_a_misuse():
    with pytest.raises(ValueError, match="command: expected a program"):
        ProgramConnection([])


def test_a_program_that_dies_kills_nobody_by_a_broken_pipe(start):
    """Even where SIGPIPE has its default, which ends a process."""
    default = signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    try:
        connection = start("os.close(0); right(request); os._exit(0)")
        connection.answer(case(3))
        time.sleep(0.2)
        assert connection.answer(case(3)).kind is FailureKind.CRASHED
    finally:
        signal.signal(signal.SIGPIPE, default)


def test_an_answer_counts_though_the_program_ends_right_after_it(start, monkeypatch):
    """It is read by the look that finds the program ended, before the end of its output is."""
    connection = start("right(request); os._exit(0)")
    assert connection.greeting
    ended = ChildProcess._has_ended

    def wait(process):
        deadline = time.monotonic() + 5.0
        while not ended(process) and time.monotonic() < deadline:
            time.sleep(0.01)
        return ended(process)

    exchange = ChildProcess._exchange
    monkeypatch.setattr(child_process, "TICK", 0.0)
    monkeypatch.setattr(ChildProcess, "_has_ended", wait)
    process = connection._ready()
    send = process.send
    monkeypatch.setattr(process, "send", lambda line: (send(line), exchange(process, 1.0)))
    answer = connection.answer(case(3))
    assert isinstance(answer, Answer), str(answer.sentence)
    monkeypatch.undo()


def test_an_answer_too_many_is_told_at_the_next_case(start):
    connection = start("right(request); right(request)")
    assert isinstance(connection.answer(case(3)), Answer)
    assert "answered request 2 with the id 1" in str(connection.answer(case(2)).sentence)
    assert isinstance(connection.answer(case(2)), Answer)


def test_the_rest_of_the_cases_goes_on(start, monkeypatch):
    judged = []

    class Discipline:
        @staticmethod
        def cases(*_):
            return [case(joints) for joints in (2, 3, 2, 3, 2)]

        @staticmethod
        def judge(asked, *_, **__):
            judged.extend(asked)
            return TaskReport("forward_kinematics", "", (), Diagnosis())

        @staticmethod
        def diagnose(_):
            return Diagnosis()

    monkeypatch.setitem(DISCIPLINES, "forward_kinematics", Discipline)
    connection = start("os.abort()", loop=finally_do("while True: tick()"))
    verify(connection, ["forward_kinematics"])
    connection.close()
    kinds = [type(question.answer) for question in judged]
    assert kinds[:5] == [Answer, Failure, Answer, Failure, Answer]
    assert [type(question.repeat) for question in judged] == kinds
    assert [str(one) for one in connection.remarks] == ["It does not exit when its input ends."]


def test_a_program_that_is_dropped_leaves_nothing(tmp_path):
    connection = program(tmp_path, "pass")
    connection.answer(case(2))
    del connection
    assert not running(tmp_path)


def test_descriptors_do_not_leak(tmp_path):
    def opened():
        return len(os.listdir("/dev/fd"))

    connection = program(tmp_path, "os._exit(1)")
    connection.answer(case(3))
    before = opened()
    for _ in range(5):
        connection.answer(case(3))
    connection.close()
    assert opened() <= before


def test_a_program_knows_no_interpreter_but_its_own(tmp_path):
    """The command is taken word by word: no shell sees it."""
    connection = ProgramConnection(
        [sys.executable, "-c", "import sys; sys.exit(sys.argv[1])", "$HOME"]
    )
    with pytest.raises(NoGreetingError, match=r"\$HOME"):
        _ = connection.greeting
