"""A process of one's own: it answers or stays silent, and all that it starts counts.

How it may end, and what it may send, is tested by hostile programs and by dying workers.
"""

import sys

import pytest

from plumbob.crosscheck.child_process import ChildProcess, Loss, LostError, pickled, python_process

ECHO = (
    "import plumbob.crosscheck.child_process as c\nrequests, answers = c.connect()\n"
    "print('noise'); answers.send((requests.recv(), None)); requests.recv()"
)
SPIN = "import os\nos.fork()\nwhile True: pass"


def loss(child, seconds, **limits):
    with pytest.raises(LostError) as caught:
        child.receive(seconds, **limits)
    return caught.value.loss


def test_a_message_comes_back_and_silence_is_none():
    child = python_process(ECHO)
    child.send(pickled(bytes(2**20)))
    assert child.receive(60.0) == (bytes(2**20), None)
    assert loss(child, 0.05) is Loss.WAITING
    child.end()


def test_processor_time_of_all_that_it_starts_is_limited():
    child = ChildProcess([sys.executable, "-c", SPIN], memory=1 << 40)
    assert loss(child, 60.0, processor=0.5) is Loss.PROCESSOR
    child.end()


def test_a_signal_without_a_name_is_a_number():
    child = python_process("import os; os.kill(os.getpid(), 40)")
    assert loss(child, 60.0) is Loss.ENDED
    assert child.ending == "by signal 40"
