"""The command `check`: compare the reference with Pinocchio and MuJoCo, or read files by all."""

import sys
from collections.abc import Sequence
from typing import Annotated

from .options import FAILED, SUCCESS, Texts, argument, flag, valid_name
from .terminal import print_aligned, print_verdicts, progress


def check(
    claims: Annotated[
        Texts, argument("CLAIM", "Claims to check (see --list), or paths with --files.")
    ] = None,
    names: Annotated[bool, flag("List the claims and stop.", "--list")] = False,
    files: Annotated[bool, flag("Compare how both engines read robot files.", "--files")] = False,
) -> int:
    """Compare the reference with Pinocchio and MuJoCo, claim by claim; exit 1 if one fails."""
    if files:
        return check_files(claims or [])
    from plumbob.crosscheck.claims import CLAIMS, run_claims
    from plumbob.crosscheck.robots.models import left_out

    if names:
        for claim in CLAIMS.values():
            print(f"{claim.name}: {claim.quantity}, against {claim.counterpart}")
        return SUCCESS
    selection = [valid_name("claim", name, CLAIMS) for name in claims or CLAIMS]
    with progress() as bar:
        task = bar.add_task("", total=len(selection))
        verdicts = run_claims(
            selection, lambda claim: bar.update(task, description=claim.name, advance=1)
        )
    print_verdicts(verdicts)
    if missing := left_out():
        print(missing)
    return FAILED if any(verdict.failure for verdict in verdicts) else SUCCESS


def check_files(paths: Sequence[str]) -> int:
    """Compare how each engine reads the files at some paths; return 1 if two disagree."""
    if not paths:
        raise ValueError("--files: expected folders or files, got none")
    from plumbob.crosscheck.engines import ABSENT
    from plumbob.crosscheck.robots.files import check, find

    from .file_readings import lines_on, summary

    search = find(paths)
    readings, output = [], sys.stdout
    with progress() as bar:
        stream = None if output.isatty() else output  # a bar takes what is printed, above itself
        task = bar.add_task("", total=len(search.files))
        for reading in check(search.files):
            readings.append(reading)
            bar.update(task, description=reading.file.path.name, advance=1)
            for line in lines_on(reading):
                print(line, file=stream, flush=True)
    table, disagreements = summary(search, readings)
    print_aligned(table)
    for engine, obstacle in ABSENT.items():
        print(f"{engine}: not checked: {obstacle}")
    return FAILED if disagreements else SUCCESS
