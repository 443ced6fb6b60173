"""Compute the dictionaries of mistakes in `verify/dictionary` anew: some CPU minutes."""

from plumbob.verify.dictionary.build import build, digest
from plumbob.verify.dictionary.entry import file_of, read
from plumbob.verify.dictionary.requests import TASKS


def main():
    for task, method in TASKS:
        path = file_of(task, method)
        if path.exists() and read(path).digest == digest(task, method):
            print(f"{path.name}: up to date")
            continue
        dictionary = build(task, method, print)
        dictionary.write(path)
        print(f"{path.name}: {len(dictionary.entries)} entries, {path.stat().st_size} bytes")


if __name__ == "__main__":
    main()
