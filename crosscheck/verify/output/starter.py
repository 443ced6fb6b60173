"""What `plumbob verify --template` does: write a starter into a folder, and say what comes next."""

from collections.abc import Iterator
from pathlib import Path

from ..sentence import sentence
from .terminal import WIDTH, wrapped
from .words import Say


def written(language: str, folder: Path, say: Say) -> Iterator[str]:
    """Write the files of a starter and yield what to do next; nothing is overwritten.

    Raises:
        ValueError: if there is none in this language, or one of its files is there already.
    """
    from ..templates import LANGUAGES, template

    texts = template(language)
    for name in texts:
        if (folder / name).exists():
            raise ValueError(say(sentence(
                "template: {name} is here already and stays as it is; go to an empty folder",
                name=name,
            )))  # fmt: skip
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    known = LANGUAGES[language]
    steps = [
        sentence("Written: {files}", files=", ".join(texts)),
        sentence("Put your code into {file}; delete what you do not have.", file=known.files[0]),
    ]
    if known.build:
        steps.append(sentence("Build: {command}", command=known.build))
    run = known.files[0] if language == "python" else f"-- {known.run}"
    steps.append(sentence("Then: {command}", command=f"plumbob verify {run}"))
    for step in steps:
        yield from wrapped(say(step), WIDTH)
