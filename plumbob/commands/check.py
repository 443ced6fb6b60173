"""The command `check`: hold the reference against Pinocchio and MuJoCo, or read files with both."""

from collections.abc import Sequence
from typing import Annotated

import typer

from ..help_text import block
from ..terminal import print_aligned, print_verdicts, progress
from .options import MISSED, SUCCESS, known

EXAMPLES = block(
    "Examples",
    "plumbob check",
    'plumbob check "spring forces" "Gauss-Newton step"',
    "plumbob check --files robots/  your URDF, MJCF and BVH files: who reads them, who agrees",
)


def check(
    claims: Annotated[
        list[str] | None,
        typer.Argument(metavar="CLAIM", help="Only these; see --list. With --files, paths."),
    ] = None,
    names: Annotated[bool, typer.Option("--list", help="List the claims and stop.")] = False,
    files: Annotated[
        bool, typer.Option("--files", help="Read files and folders of files with both engines.")
    ] = False,
) -> int:
    """Hold the reference against Pinocchio and MuJoCo: a verdict table, exit 1 on a miss."""
    if files:
        return check_files(claims or [])
    from plumbob.crosscheck.claims import CLAIMS, run_claims
    from plumbob.crosscheck.robots.models import left_out

    if names:
        for claim in CLAIMS.values():
            print(f"{claim.name}: {claim.quantity}, against {claim.counterpart}")
        return SUCCESS
    chosen = [known("claim", name, CLAIMS) for name in claims or CLAIMS]
    with progress() as bar:
        task = bar.add_task("", total=len(chosen))
        verdicts = run_claims(
            chosen, lambda claim: bar.update(task, description=claim.name, advance=1)
        )
    print_verdicts(verdicts)
    if missing := left_out():
        print(missing)
    return SUCCESS if all(verdict.holds for verdict in verdicts) else MISSED


def check_files(paths: Sequence[str]) -> int:
    """Compare every URDF, MJCF and BVH file at some paths; return 1 if a reading disagrees."""
    if not paths:
        raise ValueError("--files: expected folders or files, got none")
    from plumbob.bench.experiments.check.files import report
    from plumbob.crosscheck.robots.files import check, find

    found = find(paths)
    checked = []
    with progress() as bar:
        task = bar.add_task("", total=len(found.files))
        for one in check(found.files):
            checked.append(one)
            bar.update(task, description=one.file.path.name, advance=1)
    files, summary, disagreements = report(found, checked)
    for table in (files, summary):
        print_aligned(table)
    return MISSED if disagreements else SUCCESS
