"""A process of one's own: it answers, stays silent or ends, and its losses have names."""

import sys

import pytest

from plumbob.crosscheck.child_process import ChildProcess, Loss, LostError, pickled, python_process

ECHO = (
    "import plumbob.crosscheck.child_process as c\nrequests, answers = c.connect()\n"
    "print('noise'); answers.send((requests.recv(), None)); requests.recv()"
)


@pytest.fixture
def start():
    children = []

    def begin(statement, **limits):
        if limits:
            children.append(ChildProcess([sys.executable, "-c", statement], **limits))
        else:
            children.append(python_process(statement))
        return children[-1]

    yield begin
    for child in children:
        child.end()


def test_a_message_comes_back_and_silence_is_none(start):
    child = start(ECHO)
    child.send(pickled(bytes(2**20)))
    assert child.receive(60.0) == (bytes(2**20), None)
    with pytest.raises(LostError) as caught:
        child.receive(0.05)
    assert caught.value.loss is Loss.WAITING


@pytest.mark.parametrize(
    ("statement", "loss", "ending"),
    [
        ("raise SystemExit(3)", Loss.ENDED, "with code 3"),
        ("import os; os.kill(os.getpid(), 9)", Loss.ENDED, "by SIGKILL"),
        ("import os; os.write(1, b'abc'); os._exit(0)", Loss.CUT, "with code 0"),
        ("import os, time; os.close(1); time.sleep(99)", Loss.CLOSED, "by SIGKILL"),
        ("import os, time; os.write(1, bytes(4) * 9); time.sleep(99)", Loss.GARBLED, None),
    ],
)
def test_a_process_that_sends_nothing_any_more_has_a_loss_and_an_ending(
    start, statement, loss, ending
):
    child = start(statement)
    child.send(b"anything")
    with pytest.raises(LostError) as caught:
        child.receive(60.0)
    assert caught.value.loss is loss
    assert ending is None or child.ending == ending


@pytest.mark.parametrize(
    ("statement", "limits", "loss"),
    [
        ("kept = b'x' * (200 << 20)\nwhile True: pass", {"memory": 100 << 20}, Loss.MEMORY),
        ("while True: print('x', end='')", {"longest": 1000}, Loss.TOO_LONG),
    ],
)
def test_what_takes_too_much_is_lost(start, statement, limits, loss):
    with pytest.raises(LostError) as caught:
        start(statement, **limits).receive(60.0)
    assert caught.value.loss is loss


def test_processor_time_of_all_that_it_starts_is_limited(start):
    child = start("import os\nos.fork()\nwhile True: pass", memory=1 << 40)
    with pytest.raises(LostError) as caught:
        child.receive(60.0, processor=0.5)
    assert caught.value.loss is Loss.PROCESSOR
