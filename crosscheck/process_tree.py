"""What a program has started: found, measured and ended.

A program's tree is its process group and session, all that descend from it and, on Linux, all that
carry its marker: those that fork twice and leave the session are found by it. The marker is a limit
of real-time computing: processes inherit limits through every fork, setsid and exec, and one of
tens of thousands of years limits nothing.
"""

import contextlib
import os
import resource
import secrets
import signal
import subprocess
import time
from collections.abc import Callable
from typing import NamedTuple

import psutil

# What forks while it is being ended is looked for again, so often and after so long [s].
ROUNDS, PAUSE = 200, 0.005
LIMIT = getattr(resource, "RLIMIT_RTTIME", None)
# Until the input ends; then the group, and thrice, for those that fork meanwhile, what carries $2.
_GUARD = (
    'read line || { kill -KILL "-$1"; [ "$2" = 0 ] || for again in 1 2 3; do '
    'for file in $(grep -ls " $2 " /proc/[0-9]*/limits); do '
    'file=${file%/limits}; kill -KILL "${file#/proc/}"; done; done; }'
)


class Process(NamedTuple):
    """A process that runs.

    Attributes:
        memory: what it holds of the machine's memory [B].
        seconds: of a processor that it has used [s].
        runs: whether it is on a processor, or waits for one.
    """

    pid: int
    memory: int
    seconds: float
    runs: bool


def new_marker() -> int:
    """Return a number that no other program carries, at most a limit that this process has."""
    hard = resource.getrlimit(LIMIT)[1] if LIMIT is not None else 0
    return (hard if hard >= 1 << 60 else 1 << 61) - secrets.randbits(48)


def carry(marker: int) -> None:
    """Let this process and all that it starts carry a marker, and leave no core where they crash.

    A child calls this between fork and exec, where other threads' locks stay locked: so it does
    nothing else.
    """
    with contextlib.suppress(OSError, ValueError):
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        if LIMIT is not None:
            resource.setrlimit(LIMIT, (marker, marker))


def family(leader: int, marker: int = 0) -> list[Process]:
    """Return the running processes that a program has started, itself among them.

    Args:
        leader: the program's process, leader of its group and session.
        marker: what the program carries, 0 if nothing.
    """
    members: set[int] = set()
    for pid in [leader, *filter(lambda pid: _belongs(pid, leader, marker), psutil.pids())]:
        if pid not in members:
            members |= {pid, *_descendants(pid)}
    measured = map(_measured, sorted(members - {os.getpid()}))
    return [process for process in measured if process is not None]


def _belongs(pid: int, leader: int, marker: int) -> bool:
    """Return whether a process is of the leader's group or session, or carries the marker."""
    with contextlib.suppress(OSError):
        if leader in (os.getpgid(pid), os.getsid(pid)):
            return True
        if marker and LIMIT is not None:
            return bool(resource.prlimit(pid, LIMIT)[1] == marker)
    return False


def _descendants(pid: int) -> list[int]:
    with contextlib.suppress(psutil.Error):
        return [child.pid for child in psutil.Process(pid).children(recursive=True)]
    return []


def _measured(pid: int) -> Process | None:
    """Return a process, None if it has ended."""
    with contextlib.suppress(psutil.Error):
        process = psutil.Process(pid)
        with process.oneshot():
            status, used = process.status(), process.cpu_times()
            if status not in (psutil.STATUS_ZOMBIE, psutil.STATUS_DEAD):
                memory, runs = process.memory_info().rss, status == psutil.STATUS_RUNNING
                return Process(pid, memory, used.user + used.system, runs)
    return None


def main_thread_seconds(process: int) -> float:
    """Return how long the first thread of a process has computed, to the nanosecond [s].

    It is 0 where the process has ended, or the system does not tell. psutil counts ticks of 10 ms.
    """
    with contextlib.suppress(OSError), open(f"/proc/{process}/schedstat", "rb") as file:
        return 1e-9 * int(file.read().split()[0])
    return 0.0


def end_group(leader: int, marker: int = 0) -> None:
    """Kill a program's group and, if it carries a marker, all that it has started.

    The leader must not have been waited for, so that its number is still its own.
    """
    for again in range(ROUNDS if marker else 1):
        pids = [process.pid for process in family(leader, marker)] if marker else []
        _kill(os.killpg, leader)  # at once, for those that fork while they are listed
        for pid in pids:
            _kill(os.kill, pid)
        if again and not pids:
            break
        time.sleep(PAUSE if marker else 0.0)


def _kill(kill: Callable[[int, int], None], target: int) -> None:
    with contextlib.suppress(ProcessLookupError, PermissionError):
        kill(target, signal.SIGKILL)


def guard(leader: int, marker: int) -> subprocess.Popen[bytes]:
    """Start a process that ends the same, should this process die by whatever means."""
    return subprocess.Popen(
        ["/bin/sh", "-c", _GUARD, "sh", str(leader), str(marker)],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
