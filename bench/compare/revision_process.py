"""Measure blocks of a revision, for each line of standard input.

A program of its own, run by path. From a revision of Plumbob the program imports the bench, and
uses only names as old as the first records. From the user's project it measures the solvers.
"""

import importlib.util
import json
import os
import sys
from pathlib import Path
from typing import Any


def main(folder: str, scale: str, suites: str, solvers: str = "") -> None:
    """Write the keys of all blocks, then a record for each key read.

    `folder` holds the sources of the revision, or is the base of the addresses of the user's
    solvers. Addresses and suites are lists in JSON.
    """
    output = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # what an engine prints is no record
    is_own = not solvers
    bench = "bench" if is_own and not Path(folder, "plumbob", "bench").exists() else "plumbob.bench"
    experiments = importlib.import_module(f"{bench}.experiments")
    is_older = importlib.util.find_spec(f"{bench}.measure") is None  # the folder's first name
    folder_name = f"{bench}.harness" if is_older else f"{bench}.measure"
    record, run = (importlib.import_module(f"{folder_name}.{name}") for name in ("record", "run"))
    if is_own and not Path(str(run.__file__)).resolve().is_relative_to(Path(folder).resolve()):
        sys.exit(f"expected the bench of {folder}, got {run.__file__}")
    size = experiments.SCALES[scale]
    if solvers:
        os.chdir(folder)
        size = _with_solvers(size, json.loads(solvers), json.loads(suites))
    blocks = {
        run.block_key(block): block
        for suite in json.loads(suites) if suite in experiments.SUITES
        for block in experiments.blocks(suite, size)
        if is_own or block.facts.get("entrant")
    }  # fmt: skip
    print(json.dumps(list(blocks)), file=output, flush=True)
    for line in sys.stdin:
        block = blocks[tuple(json.loads(line))]
        print(record.encode(run.measure(block)), file=output, flush=True)


def _with_solvers(scale: Any, solvers: list[str], suites: list[str]) -> Any:
    """Return a scale with solvers of the user's."""
    from dataclasses import replace

    from plumbob.bench.peers import opening

    try:
        return replace(
            scale, user_solvers=tuple(opening.open_solvers(opening.addresses(solvers), suites))
        )
    except ValueError as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main(*sys.argv[1:])
