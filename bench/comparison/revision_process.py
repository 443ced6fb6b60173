"""Measure blocks of the revision in a folder, for each line of standard input.

A program of its own, run by path: it imports the bench of any revision, and uses only what the
bench has had since its first records.
"""

import importlib
import json
import os
import sys
from pathlib import Path


def main(folder: str, scale: str, *suites: str) -> None:
    """Write the keys of all blocks, and then a record for each key that is read."""
    output = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # what an engine prints is no record
    bench = "plumbob.bench" if Path(folder, "plumbob", "bench").exists() else "bench"
    experiments = importlib.import_module(f"{bench}.experiments")
    record = importlib.import_module(f"{bench}.harness.record")
    run = importlib.import_module(f"{bench}.harness.run")
    if not Path(str(run.__file__)).resolve().is_relative_to(Path(folder).resolve()):
        sys.exit(f"expected the bench of {folder}, got {run.__file__}")
    blocks = {
        run.block_key(block): block
        for suite in suites if suite in experiments.SUITES
        for block in experiments.blocks(suite, experiments.SCALES[scale])
    }  # fmt: skip
    print(json.dumps(list(blocks)), file=output, flush=True)
    for line in sys.stdin:
        block = blocks[tuple(json.loads(line))]
        print(record.encode(run.measure(block)), file=output, flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
