"""What a program has started: found, measured and ended.

A program's family is its process group and session, all that descend from it, and all that carry
its marker: those that fork twice and leave the session are found by it. The marker is a number. It
stands in the environment and, on Linux, is the limit of real-time computing: processes inherit
limits through every fork, setsid and exec, and one of tens of thousands of years limits nothing.
Where /proc is missing (macOS), `ps` is asked and the marker is not seen.
"""

import contextlib
import os
import resource
import secrets
import signal
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

MARKER = "PLUMBOB_CONTESTANT"
# What forks while it is being ended is looked for again, so often and after so long [s].
ROUNDS, PAUSE = 200, 0.005
_PROC = Path("/proc")
_LIMIT = getattr(resource, "RLIMIT_RTTIME", None)
_TICKS = os.sysconf("SC_CLK_TCK")
_PAGE = os.sysconf("SC_PAGE_SIZE")
HAS_PROC = (_PROC / "self" / "stat").exists()
# Until the input ends; then the group, and thrice, for those that fork meanwhile, what carries $2.
_GUARD = (
    'read line || { kill -KILL "-$1"; for again in 1 2 3; do '
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
    parent: int
    group: int
    session: int
    memory: int
    seconds: float
    runs: bool


def new_marker() -> int:
    """Return a number that no other program carries, at most a limit that this process has."""
    hard = resource.getrlimit(_LIMIT)[1] if _LIMIT is not None else 0
    return (hard if hard >= 1 << 60 else 1 << 61) - secrets.randbits(48)


def carry(marker: int) -> None:
    """Let this process and all that it starts carry a marker, where the system allows it.

    A child calls this between fork and exec, where other threads' locks stay locked: so it does
    nothing else.
    """
    if _LIMIT is not None:
        with contextlib.suppress(OSError, ValueError):
            resource.setrlimit(_LIMIT, (marker, marker))


def family(leader: int, marker: int = 0) -> list[Process]:
    """Return the running processes that a program has started, itself among them.

    Args:
        leader: the program's process, leader of its group and session.
        marker: what the program carries; 0 saves the search for it.
    """
    running = {one.pid: one for one in _running()}
    found = {
        pid for pid, one in running.items() if leader in (pid, one.parent, one.group, one.session)
    }
    if marker and HAS_PROC:
        found |= {pid for pid in running if _carries(pid, marker)}
    grown = True
    while grown:
        below = {pid for pid, one in running.items() if one.parent in found}
        grown = not below <= found
        found |= below
    return [running[pid] for pid in sorted(found - {os.getpid()})]


def main_thread_seconds(process: int) -> float:
    """Return how long the first thread of a process has computed, to the nanosecond [s].

    It is 0 where the process has ended, or the system does not tell.
    """
    with contextlib.suppress(OSError):
        return 1e-9 * int((_PROC / str(process) / "schedstat").read_bytes().split()[0])
    return 0.0


def end_group(leader: int, marker: int = 0) -> None:
    """Kill a program and all that it has started.

    The leader must not have been waited for, so that its number is still its own.
    """
    for again in range(ROUNDS):
        members = family(leader, marker)
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(leader, signal.SIGKILL)  # at once, for those that fork while they are listed
        if again and not members:
            break
        for one in members:
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.kill(one.pid, signal.SIGKILL)
        time.sleep(PAUSE)


def guard(leader: int, marker: int) -> subprocess.Popen[bytes]:
    """Start a process that kills a program's family should this one die, by whatever means."""
    return subprocess.Popen(
        ["/bin/sh", "-c", _GUARD, "sh", str(leader), str(marker)],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )


def dismiss(guard: subprocess.Popen[bytes]) -> None:
    """End a guard."""
    guard.kill()
    guard.communicate()


def _running() -> Iterator[Process]:
    return _running_by_proc() if HAS_PROC else _running_by_ps()


def _running_by_proc() -> Iterator[Process]:
    for name in os.listdir(_PROC):
        if name.isdecimal():
            with contextlib.suppress(OSError):  # it has just ended
                words = (_PROC / name / "stat").read_bytes().rpartition(b")")[2].split()
                if words[0] not in (b"Z", b"X"):
                    parent, group, session = map(int, words[1:4])
                    seconds = (int(words[11]) + int(words[12])) / _TICKS
                    memory = int(words[21]) * _PAGE
                    yield Process(
                        int(name), parent, group, session, memory, seconds, words[0] == b"R"
                    )


def _running_by_ps() -> Iterator[Process]:
    columns = [f"-o{name}=" for name in ("pid", "ppid", "pgid", "rss", "time", "stat")]
    listed = subprocess.run(["ps", "-A", *columns], capture_output=True, text=True, check=False)
    for line in listed.stdout.splitlines():
        *numbers, used, state = line.split()
        if not state.startswith("Z"):
            pid, parent, group, kilobytes = map(int, numbers)
            used_seconds, runs = _seconds(used), state.startswith("R")
            yield Process(pid, parent, group, group, kilobytes * 1024, used_seconds, runs)


def _seconds(used: str) -> float:
    """Return the seconds of [[days-]hours:]minutes:seconds."""
    days, _, clock = used.rpartition("-")
    seconds = 0.0
    for part in clock.split(":"):
        seconds = 60.0 * seconds + float(part)
    return 86400.0 * int(days or 0) + seconds


def _carries(pid: int, marker: int) -> bool:
    with contextlib.suppress(OSError):
        if _LIMIT is not None and resource.prlimit(pid, _LIMIT)[1] == marker:
            return True
        return f"{MARKER}={marker}".encode() in (_PROC / str(pid) / "environ").read_bytes()
    return False
