"""Whatever a program does, there is a sentence for it, the next case works, and nothing stays."""

import os
import re
import signal
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import pytest
from hostile_programs import LIMITS, LOOP, case, program, running

from plumbob.crosscheck.verify.contestant import Answer, Failure, FailureKind, NoGreetingError
from plumbob.crosscheck.verify.judgement import Diagnosis, TaskReport
from plumbob.crosscheck.verify.solvers import line_process
from plumbob.crosscheck.verify.solvers.line_process import LineProcess
from plumbob.crosscheck.verify.solvers.program import ProgramContestant
from plumbob.crosscheck.verify.verify import DISCIPLINES, verify

FORK = "if os.fork() == 0:\n    {before}\n    os.close(1)\n    while True: tick()\n"
HOSTILE = {
    "hangs and waits": ("while True: tick()", "hung", "was not computing: does it .* flush"),
    "hangs and computes": ("while True: pass", "hung", "It computed for 0.5 s without an answer"),
    "answers nothing and reads on": ("pass", "hung", "no answer within 0.5 s"),
    "answers without an end of line": (
        "sys.stdout.write('{\"id\": 2'); sys.stdout.flush()\nwhile True: tick()",
        "hung",
        'printed 8 bytes, but no end of line within 0.5 s: {"id": 2',
    ),
    "crashes": (
        "os.kill(os.getpid(), signal.SIGSEGV)",
        "crashed",
        "instead of answering: it used memory that is not its own",
    ),
    "aborts with words": (
        "sys.stderr.write('one\\ntwo\\nthree\\n\\x1b[31massert x > 0\\n'); os.abort()",
        "crashed",
        r"aborted, .*Its last words on standard error: two / three / \[31massert x > 0$",
    ),
    "ends": ("os._exit(3)", "crashed", "It ended instead of answering: exit code 3."),
    "ends well": ("sys.exit()", "crashed", "It ended instead of answering: exit code 0."),
    "raises": ("{}['offsets']", "crashed", "exit code 1. Its last words .* KeyError: 'offsets'"),
    "a signal without a story": (
        "signal.signal(signal.SIGUSR1, signal.SIG_DFL); os.kill(os.getpid(), signal.SIGUSR1)",
        "crashed",
        "ended by signal SIGUSR1",
    ),
    "half a line": (
        'sys.stdout.write(\'{"id": 2, "posi\'); sys.stdout.flush(); os._exit(0)',
        "crashed",
        r'ended in the middle of a line \({"id": 2, "posi\): exit code 0',
    ),
    "prints garbage without end": (
        "while True: print('garbage')",
        "garbage",
        "printed more than 100 lines that are no answers, for example: garbage",
    ),
    "prints bytes": (
        "sys.stdout.buffer.write(b'\\xff\\x00\\xfe\\n'); sys.stdout.flush()\nwhile True: tick()",
        "hung",
        "Before it had printed lines that are no answers",
    ),
    "a gigabyte without an end of line": (
        "while True: os.write(1, b'x' * 65536)",
        "garbage",
        "more than 1048576 bytes without an end of line, beginning with: xxx",
    ),
    "the wrong id": (
        "request['id'] += 7; right(request)",
        "garbage",
        "answered request 2 with the id 9",
    ),
    "no id": ("say(positions=[])", "garbage", "answered request 2 without an id"),
    "true as id": ("say(id=True)", "garbage", "with the id True"),
    "a list as id": ("say(id=[1])", "garbage", r"with the id \[1\]"),
    "broken JSON": ("print('{\"id\": 2, positions}', flush=True)", "garbage", "a broken line: exp"),
    "lists in lists": ("print('{\"id\":' + '[' * 10**6, flush=True)", "garbage", "nested too deep"),
    "the wrong shape": (
        "say(id=request['id'], positions=[[1, 2, 3]])",
        "garbage",
        r"positions: expected shape \(3, 3\), got \(1, 3\)",
    ),
    "texts": ("say(id=request['id'], positions=[['1'] * 3] * 3)", "garbage", "expected numbers"),
    "huge integers": ("say(id=2, positions=[[10**400] * 3] * 3)", "garbage", "expected numbers"),
    "longer integers": (
        "print('{\"id\": 2, \"a\": ' + '9' * 10**5 + '}', flush=True)",
        "garbage",
        "expected JSON",
    ),
    "a format instead of an error": (
        "say(id=2, error='{0.__class__} {why} %s <b>')",
        "refused",
        r"cannot: {0.__class__} {why} %s <b>$",
    ),
    "closes its input": (
        "os.close(0)\nright(request)\nwhile True: tick()",
        "hung",
        "closed its standard input",
    ),
    "closes its output": (
        "os.close(1)\nwhile True: tick()",
        "crashed",
        "closed its standard output, but runs on",
    ),
    "closes all and sleeps": (
        "os.closerange(0, 99)\nwhile True: tick()",
        "crashed",
        "closed its standard output, but runs on",
    ),
    "allocates without end": (
        "kept = []\nwhile True: kept.append(b'x' * (8 << 20)); tick()",
        "memory",
        "took more than 0.262 GB of memory",
    ),
    "lets a child allocate": (
        "kept = []\nif os.fork() == 0:\n"
        "    while True: kept.append(b'x' * (8 << 20)); tick()\nwhile True: tick()",
        "memory",
        "took more than 0.262 GB",
    ),
    "forks and ends": (FORK.format(before="pass") + "os._exit(4)", "crashed", "exit code 4"),
    "leaves its output to a child and ends": (
        "if os.fork() == 0:\n    while True: tick()\nos._exit(4)",
        "crashed",
        "ended instead of answering: exit code 4",
    ),
    "forks into another session and ends": (
        FORK.format(before="os.setsid()") + "os._exit(4)",
        "crashed",
        "exit code 4",
    ),
    "forks twice into another session and hangs": (
        FORK.format(before="os.setsid(); os.fork() and os._exit(0)") + "while True: tick()",
        "hung",
        "no answer",
    ),
    "forks and ends, on and on": (
        "end = time.time() + 5\nwhile time.time() < end:\n    if os.fork(): os._exit(0)",
        "crashed",
        "exit code 0",
    ),
    "forks and forks": (
        "for _ in range(4): os.fork()\nwhile True: tick()",
        "hung",
        "no answer",
    ),
    "ignores all signals": (
        "for one in (1, 2, 3, 13, 15): signal.signal(one, signal.SIG_IGN)\nwhile True: tick()",
        "hung",
        "no answer",
    ),
    "stops itself": ("os.kill(os.getpid(), signal.SIGSTOP)", "hung", "no answer"),
    "floods standard error": ("while True: os.write(2, b'e' * 65536)", "hung", " 0.5 s"),
    "fills standard error": (
        "for _ in range(20): os.write(2, b'e' * 65536)\nsys.exit(5)",
        "crashed",
        r"exit code 5. Its last words on standard error: e{197}\.\.\.$",
    ),
}


def ask(folder, name):
    """What a program answers before, when and after it misbehaves, and what still runs then."""
    misbehave, kind, _ = HOSTILE[name]
    patience = LIMITS.request if kind == "hung" else LIMITS.first
    contestant = program(folder, misbehave, LIMITS._replace(request=patience))
    try:
        before, failure = contestant.answer(case(2)), contestant.answer(case(3))
        if name == "closes its input":  # it has answered first, and cannot read the next
            assert isinstance(failure, Answer)
            failure = contestant.answer(case(3))
        return before, failure, contestant.answer(case(2)), contestant
    finally:
        contestant.close()


def greet(folder, name):
    """Why a program does not greet, twice."""
    start, kind, _ = AT_THE_START[name]
    limits = LIMITS._replace(first=0.5 if kind == "hung" else LIMITS.first)
    contestant = program(folder, "pass", limits, loop=f"{start}\nwhile True: tick()")
    failures = []
    for _ in range(2):
        with pytest.raises(NoGreetingError) as caught:
            _ = contestant.greeting
        failures.append(caught.value.failure)
    return (*failures, contestant.answer(case(2)), contestant)


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


@pytest.mark.parametrize("name", HOSTILE)
def test_each_has_its_sentence_and_the_next_case_works(outcomes, name):
    folder, future = outcomes[ask, name]
    before, failure, after, contestant = future.result()
    _, kind, words = HOSTILE[name]
    assert isinstance(before, Answer)
    assert isinstance(failure, Failure)
    assert re.search(words, str(failure.sentence)), str(failure.sentence)
    assert failure.kind == kind
    assert isinstance(after, Answer)
    assert contestant.remarks == ()
    assert not running(folder)


AT_THE_START = {
    "hangs": ("while True: tick()", "hung", "no answer within 0.5 s"),
    "ends before it reads": ("sys.exit(9)", "crashed", "exit code 9"),
    "closes its input before it reads": ("os.close(0)\nwhile True: tick()", "hung", "."),
    "prints what it can do": ("print('usage: solver FILE')\nsys.exit(2)", "crashed", "usage"),
    "cannot greet": (
        "say(id=read()['id'], error='unknown task greeting')",
        "refused",
        "It says that it cannot: unknown task greeting",
    ),
    "greets with another protocol": ("greet(protocol=2)", "garbage", "protocol: expected 1, got 2"),
    "greets with an unknown task": (
        "greet(tasks=['forwardKinematics'])",
        "garbage",
        "did you mean forward_kinematics?",
    ),
    "greets with an unknown field": ("greet(nmae='x')", "garbage", "did you mean name?"),
    "greets with garbage": ("print('{]', flush=True)", "garbage", "broken line"),
    "greets without end": ("while True: os.write(1, b'x' * 65536)", "garbage", "1048576 bytes"),
}


@pytest.mark.parametrize("name", AT_THE_START)
def test_what_does_not_greet_is_a_misuse_with_its_sentence(outcomes, name):
    folder, future = outcomes[greet, name]
    *failures, _ = future.result()
    _, kind, words = AT_THE_START[name]
    assert len(failures) == 3
    for failure in failures:
        assert re.search(words, str(failure.sentence)), str(failure.sentence)
        assert failure.kind == kind
    assert not running(folder)


def test_a_large_request_that_is_not_read_blocks_nothing(tmp_path):
    contestant = program(tmp_path, "while True: tick()")
    contestant.answer(case(2))
    contestant._ready().send(b'{"id": 1, "parents": [1, 2, 3]}\n' + b" " * (4 << 20))
    start = time.monotonic()
    failure = contestant.answer(case(3))
    assert failure.kind is FailureKind.HUNG
    assert "did not read the whole request" in str(failure.sentence)
    assert time.monotonic() - start < 3.0
    contestant.close()
    assert not running(tmp_path)


def test_large_requests_and_answers_pass(tmp_path):
    contestant = program(tmp_path, "pass", LIMITS._replace(request=20.0, line=1 << 24))
    big = case(20_000)
    assert isinstance(contestant.answer(case(2)), Answer)
    assert contestant.answer(big).values["positions"].shape == (20_000, 3)
    contestant.close()


@pytest.mark.parametrize(
    ("loop", "remark"),
    [
        (LOOP, None),
        (LOOP.replace("read()\n", "read()\n    print('joint 1')\n", 1), None),
        (LOOP + "\n", None),
        (f"try:{LOOP}".replace("\n", "\n    ") + "\nfinally:\n    os._exit(7)", "exit code 7"),
        (
            f"try:{LOOP}".replace("\n", "\n    ") + "\nfinally:\n    os.abort()",
            "it did not just leave: it aborted",
        ),
        (
            f"try:{LOOP}".replace("\n", "\n    ") + "\nfinally:\n    while True: tick()",
            "does not leave when its input ends",
        ),
        (
            f"os.setsid if os.fork() else 0\nif os.getppid() != {os.getpid()}:\n"
            f"    while True: tick()\n{LOOP}",
            r"left processes running that it had started \(1\)",
        ),
    ],
    ids=["leaves", "prints", "leaves again", "code", "aborts", "stays", "leaves a child"],
)
def test_how_it_leaves_is_remarked(tmp_path, loop, remark):
    contestant = program(tmp_path, "pass", loop=loop, limits=LIMITS._replace(leave=3.0))
    if remark and "does not" in remark:
        contestant._limits = LIMITS
    assert isinstance(contestant.answer(case(2)), Answer)
    contestant.close()
    assert len(contestant.remarks) == (remark is not None)
    assert all(re.search(remark, str(one)) for one in contestant.remarks)
    assert not running(tmp_path)
    assert isinstance(contestant.answer(case(2)), Answer)  # a closed one starts anew
    contestant.close()
    assert not running(tmp_path)


PRINTS = {
    "a line": "print('joint 1'); right(request)",
    "lines": "print('joint 1\\n[1, 2]\\n\\n3'); right(request)",
    "on the answer's line": "print('joint 1', end=' '); right(request)",
    "bytes": "sys.stdout.buffer.write(b'joint 1 \\xff\\x00\\n'); right(request)",
}


@pytest.mark.parametrize("name", PRINTS)
def test_prints_are_a_remark_on_the_answer(tmp_path, name):
    contestant = program(tmp_path, PRINTS[name])
    answers = [contestant.answer(case(joints)) for joints in (2, 3, 2)]
    contestant.close()
    first, told, last = ([str(one) for one in answer.remarks] for answer in answers)
    assert (first, last) == ([], [])
    assert len(told) == 1
    assert "It prints to its standard output, for example: joint 1" in told[0]


def test_blank_lines_and_a_byte_order_mark_are_no_prints(tmp_path):
    contestant = program(tmp_path, "print('\\n\\r\\n\\ufeff', end=''); right(request)")
    assert contestant.answer(case(3)).remarks == ()
    contestant.close()


def test_the_first_request_of_a_task_may_compile(tmp_path):
    contestant = program(tmp_path, "time.sleep(0.8); right(request)", LIMITS._replace(request=0.4))
    assert isinstance(contestant.answer(case(3)), Answer)
    assert contestant.answer(case(3)).kind is FailureKind.HUNG
    assert isinstance(contestant.answer(case(3)), Answer)
    contestant.close()


def test_a_late_answer_is_not_taken_for_the_next_one(tmp_path):
    contestant = program(tmp_path, "time.sleep(1.0); right(request)")
    contestant.answer(case(2))
    assert contestant.answer(case(3)).kind is FailureKind.HUNG
    assert contestant.answer(case(2)).values["positions"][0, 0] == 1.0  # of a process anew
    contestant.close()


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
        _ = ProgramContestant([str(file)]).greeting


def test_a_program_here_needs_its_dot(tmp_path, monkeypatch):
    (tmp_path / "my_solver").write_text("")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(NoGreetingError, match=r"for the file here write \./my_solver"):
        _ = ProgramContestant(["my_solver"]).greeting


def test_a_contestant_without_a_command_is_a_misuse():
    with pytest.raises(ValueError, match="command: expected a program"):
        ProgramContestant([])


def test_a_program_that_dies_kills_nobody_by_a_broken_pipe(tmp_path):
    """Even where SIGPIPE has its default, which ends a process."""
    default = signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    try:
        contestant = program(tmp_path, "os.close(0); right(request); os._exit(0)")
        contestant.answer(case(3))
        time.sleep(0.2)
        assert contestant.answer(case(3)).kind is FailureKind.CRASHED
    finally:
        signal.signal(signal.SIGPIPE, default)


def test_an_answer_counts_though_the_program_ends_right_after_it(tmp_path, monkeypatch):
    """It is read by the look that finds the program ended, before the end of its output is."""
    contestant = program(tmp_path, "right(request); os._exit(0)")
    assert contestant.greeting
    ended = LineProcess._has_ended

    def wait(process):
        deadline = time.monotonic() + 5.0
        while not ended(process) and time.monotonic() < deadline:
            time.sleep(0.01)
        return ended(process)

    exchange = LineProcess._exchange
    monkeypatch.setattr(line_process, "TICK", 0.0)
    monkeypatch.setattr(LineProcess, "_has_ended", wait)
    process = contestant._ready()
    send = process.send
    monkeypatch.setattr(process, "send", lambda line: (send(line), exchange(process, 1.0)))
    answer = contestant.answer(case(3))
    assert isinstance(answer, Answer), str(answer.sentence)
    monkeypatch.undo()
    contestant.close()


def test_an_answer_too_many_is_told_at_the_next_case(tmp_path):
    contestant = program(tmp_path, "right(request); right(request)")
    assert isinstance(contestant.answer(case(3)), Answer)
    assert "answered request 2 with the id 1" in str(contestant.answer(case(2)).sentence)
    assert isinstance(contestant.answer(case(2)), Answer)
    contestant.close()


def test_the_rest_of_the_cases_goes_on(tmp_path, monkeypatch):
    judged = []

    class Discipline:
        @staticmethod
        def cases(*_):
            return [case(joints) for joints in (2, 3, 2, 3, 2)]

        @staticmethod
        def judge(asked, *_):
            judged.extend(asked)
            return TaskReport("forward_kinematics", "", (), Diagnosis())

    monkeypatch.setitem(DISCIPLINES, "forward_kinematics", Discipline)
    stays = f"try:{LOOP}".replace("\n", "\n    ") + "\nfinally:\n    while True: tick()"
    contestant = program(tmp_path, "os.abort()", loop=stays)
    verify(contestant, ["forward_kinematics"])
    contestant.close()
    kinds = [type(question.answer) for question in judged]
    assert kinds == [Answer, Failure, Answer, Failure, Answer]
    assert [type(question.again) for question in judged] == kinds
    assert [str(one) for one in contestant.remarks] == ["It does not leave when its input ends."]
    assert not running(tmp_path)


def test_a_contestant_that_is_dropped_leaves_nothing(tmp_path):
    contestant = program(tmp_path, "pass")
    contestant.answer(case(2))
    del contestant
    assert not running(tmp_path)


def test_descriptors_do_not_leak(tmp_path):
    def opened():
        return len(os.listdir("/dev/fd"))

    contestant = program(tmp_path, "os._exit(1)")
    contestant.answer(case(3))
    before = opened()
    for _ in range(5):
        contestant.answer(case(3))
    contestant.close()
    assert opened() <= before


def test_a_contestant_knows_no_interpreter_but_its_own(tmp_path):
    """The command is taken word by word: no shell sees it."""
    contestant = ProgramContestant(
        [sys.executable, "-c", "import sys; sys.exit(sys.argv[1])", "$HOME"]
    )
    with pytest.raises(NoGreetingError, match=r"\$HOME"):
        _ = contestant.greeting
