"""Compute the dictionaries of mistakes in `verify/dictionary` anew: some CPU minutes."""

from concurrent.futures import ProcessPoolExecutor
from functools import partial

from plumbob.verify.dictionary.build import classes_of, digest, joined, program_groups
from plumbob.verify.dictionary.entry import file_of, read
from plumbob.verify.dictionary.requests import TASKS


def is_current(task, method):
    """Return whether the dictionary of a task and a method is up to date."""
    path = file_of(task, method)
    return path.exists() and read(path).digest == digest(task, method)


def main():
    keys = [key for key in TASKS if not is_current(*key)]
    with ProcessPoolExecutor() as pool:
        start = partial(pool.submit, classes_of, notify=partial(print, flush=True))
        jobs = {key: [start(*key, names) for names in program_groups(*key)] for key in keys}
        for key, parts in jobs.items():
            dictionary = joined(*key, [job.result() for job in parts])
            dictionary.write(file_of(*key))
            print(f"{file_of(*key).name}: {len(dictionary.entries)} entries", flush=True)


if __name__ == "__main__":
    main()
