"""Compute the dictionaries of mistakes in `verify/dictionary` anew: some CPU minutes."""

from concurrent.futures import ProcessPoolExecutor, as_completed
from functools import partial

from plumbob.verify.dictionary.build import build, digest
from plumbob.verify.dictionary.entry import file_of, read
from plumbob.verify.dictionary.requests import TASKS


def write(task, method):
    """Write the dictionary of a task and a method unless it is up to date, and return a line."""
    path = file_of(task, method)
    if path.exists() and read(path).digest == digest(task, method):
        return f"{path.name}: up to date"
    dictionary = build(task, method, partial(print, flush=True))
    dictionary.write(path)
    return f"{path.name}: {len(dictionary.entries)} entries, {path.stat().st_size} bytes"


def main():
    with ProcessPoolExecutor() as pool:
        for future in as_completed(pool.submit(write, *key) for key in TASKS):
            print(future.result(), flush=True)


if __name__ == "__main__":
    main()
