"""Find, measure and kill the processes started by a program.

A program's tree is its process group and session, its descendants and, on Linux, the processes with
its marker. The marker stays after forking twice and leaving the session. It is a limit of real-time
computing: processes inherit limits through every fork, setsid and exec. A limit of tens of
thousands of years has no effect.
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

# Searches for processes forked during the killing, and the pause between searches [s].
ROUNDS, PAUSE = 200, 0.005
LIMIT = getattr(resource, "RLIMIT_RTTIME", None)
# Wait for the end of the input; then kill the group and, thrice, the processes with marker $2.
_GUARD = (
    'read line || { kill -KILL "-$1"; [ "$2" = 0 ] || for again in 1 2 3; do '
    'for file in $(grep -ls " $2 " /proc/[0-9]*/limits); do '
    'file=${file%/limits}; kill -KILL "${file#/proc/}"; done; done; }'
)


class Process(NamedTuple):
    """A running process."""

    pid: int
    memory: int  # its resident memory [B]
    seconds: float  # the processor time that it has used [s]
    runs: bool  # whether it uses a processor, or waits for one


def new_marker() -> int:
    """Return a unique number, at most the limit of this process."""
    hard = resource.getrlimit(LIMIT)[1] if LIMIT is not None else 0
    return (hard if hard >= 1 << 60 else 1 << 61) - secrets.randbits(48)


def carry(marker: int) -> None:
    """Mark this process and all of its later descendants; switch core dumps off.

    A child calls this between fork and exec, where locks of other threads stay locked: nothing else
    is allowed there.
    """
    with contextlib.suppress(OSError, ValueError):
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        if LIMIT is not None:
            resource.setrlimit(LIMIT, (marker, marker))


def family(leader: int, marker: int = 0) -> list[Process]:
    """Return the running processes of a program: its group's leader and all descendants.

    `marker` is the program's marker, 0 if none.
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
    """Return a process, None after its end."""
    with contextlib.suppress(psutil.Error):
        process = psutil.Process(pid)
        with process.oneshot():
            status, used = process.status(), process.cpu_times()
            if status not in (psutil.STATUS_ZOMBIE, psutil.STATUS_DEAD):
                memory, runs = process.memory_info().rss, status == psutil.STATUS_RUNNING
                return Process(pid, memory, used.user + used.system, runs)
    return None


def main_thread_seconds(process: int) -> float:
    """Return the processor time of the first thread of a process, to the nanosecond [s].

    The time is 0 after the end of the process, or where unknown. psutil counts ticks of 10 ms.
    """
    with contextlib.suppress(OSError), open(f"/proc/{process}/schedstat", "rb") as file:
        return 1e-9 * int(file.read().split()[0])
    return 0.0


def end_group(leader: int, marker: int = 0) -> None:
    """Kill a program's group and, with a marker, all descendants.

    The leader must not have been waited for, lest its process number be reused.
    """
    for attempt in range(ROUNDS if marker else 1):
        pids = [process.pid for process in family(leader, marker)] if marker else []
        _kill(os.killpg, leader)  # at once, as they may fork while they are listed
        for pid in pids:
            _kill(os.kill, pid)
        if attempt and not pids:
            break
        time.sleep(PAUSE if marker else 0.0)


def _kill(kill: Callable[[int, int], None], target: int) -> None:
    with contextlib.suppress(ProcessLookupError, PermissionError):
        kill(target, signal.SIGKILL)


def guard(leader: int, marker: int) -> subprocess.Popen[bytes]:
    """Start a guard that kills the same group and descendants as soon as this process ends."""
    return subprocess.Popen(
        ["/bin/sh", "-c", _GUARD, "sh", str(leader), str(marker)],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
