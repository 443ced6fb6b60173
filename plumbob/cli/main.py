"""The command line. Commands import engines, the reference and matplotlib when they run."""

import importlib.metadata
import io
import os
import signal
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from plumbob.text.printable import visible

from .. import compile_notice
from . import bench, check, entry_point, records, report, show, which
from . import compare as comparison
from . import explain as explain
from . import verify as verify
from .help_text import Command, FittingGroup, epilog
from .options import INTERRUPTED, MISUSED, REPORT, SUCCESS, UNREAD, Fresh, flag, option

_UsageError: Any = typer.BadParameter.__base__

app = typer.Typer(
    cls=FittingGroup, add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and leave with its exit code.

    A reader that closes the pipe early, such as `head`, ends the program without a message. SIGPIPE
    stays ignored: a pipe to a worker that has ended would raise it too. Other signals that end the
    program become exceptions, so that commands clean up, unless they are ignored, as under nohup.
    """
    # Windows has no SIGHUP.
    for number in (signal.SIGTERM, getattr(signal, "SIGHUP", signal.SIGTERM)):
        if signal.getsignal(number) == signal.SIG_DFL:
            signal.signal(number, _leave)
    entry_point.open_closed_streams()
    if isinstance(sys.stdout, io.TextIOWrapper):  # a letter that it lacks loses no verdict
        sys.stdout.reconfigure(errors="backslashreplace")
    interrupts: list[int] = []

    def interrupt(number: int, _: object) -> None:
        interrupts.append(number)
        raise KeyboardInterrupt

    entry_point.handle_interrupt(interrupt)
    try:
        code = run_command(arguments)
        sys.stdout.flush()
    except BrokenPipeError:
        code = UNREAD
    except (Exception, KeyboardInterrupt):
        if not interrupts:
            raise
        code = _say_interrupted(arguments)  # a C extension may raise ImportError instead
    entry_point.leave_at_interrupt()
    if code == UNREAD:  # the rest of the output has no reader
        for stream in (sys.stdout, sys.stderr):
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
    sys.exit(code)


def run_command(arguments: Sequence[str] | None = None) -> int:
    """Return the exit code.

    0 success, 1 a check failed, 2 bad usage or input, 130 interrupted, 141 output without a reader.
    """
    try:
        code = app(arguments, prog_name="plumbob", standalone_mode=False)
        if code == INTERRUPTED:  # typer's own answer to Ctrl-C
            raise KeyboardInterrupt
        return code if isinstance(code, int) else SUCCESS
    except (KeyboardInterrupt, typer.Abort):
        return _say_interrupted(arguments)
    except _UsageError as error:
        return _complain(error.format_message())
    except SystemExit as error:
        if isinstance(error.__context__, BrokenPipeError):  # typer's own answer to that
            return UNREAD
        raise
    except BrokenPipeError:
        return UNREAD
    except OSError as error:
        return _complain(f"{error.filename or ''}: {error.strerror or error}".lstrip(": "))
    except ValueError as error:
        return _complain(str(error))


@app.callback(invoke_without_command=True, epilog=epilog("plumbob"))
def plumbob(
    context: typer.Context,
    output: Annotated[
        Path | None, option("DIR", "Folder to write to.  [default: report]", "--output", "-o")
    ] = None,
    fresh: Fresh = False,
    version: Annotated[bool, flag("Print the version.", "--version")] = False,
) -> int:
    """Validate, measure and report: skeleton kinematics and implicit mass-spring dynamics.

    Without a command: check the reference against Pinocchio and MuJoCo, run the quick bench, and
    write report/index.html, in a few minutes.
    """
    if version:
        print(f"plumbob {importlib.metadata.version('plumbob')}")
        raise typer.Exit
    if sys.stderr.isatty():
        compile_notice.install()
    if context.invoked_subcommand is not None:
        if output or fresh:
            raise ValueError(f"write options behind the command: {context.invoked_subcommand}")
        return SUCCESS
    return bench.main_job(output or REPORT, fresh)


for run, kind in (
    (verify.verify, verify.SolverCommand),
    (explain.explain, Command),
    (check.check, Command),
    (bench.bench, verify.SolverCommand),
    (which.which, Command),
    (report.report, Command),
    (show.show, verify.SolverCommand),
    (comparison.compare, Command),
):
    app.command(cls=kind, epilog=epilog(run.__name__))(run)
app.add_typer(records.app, name="records")


def _leave(number: int, _: object) -> None:
    """Leave by an exception, which the same signal again, as from a shell, does not interrupt."""
    signal.signal(number, signal.SIG_IGN)
    sys.exit(128 + number)


def _say_interrupted(arguments: Sequence[str] | None) -> int:
    words = sys.argv[1:] if arguments is None else arguments
    return _say(entry_point.interruption(words), INTERRUPTED)


def _complain(message: str) -> int:
    return _say(f"plumbob: {visible(message)}", MISUSED)


def _say(line: str, code: int) -> int:
    try:
        print(line, file=sys.stderr)
    except OSError as error:
        if isinstance(error, BrokenPipeError):
            raise
    return code  # on a full disk the code is the only message
