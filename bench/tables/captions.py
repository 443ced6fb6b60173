"""Titles and captions of tables: prose in `tables.toml`, beside the module that makes them."""

import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any


class Captions:
    """The captions of an experiment's tables.

    Braces in a caption hold a number of the measurement, or a sentence of the part `[shared]`.
    """

    def __init__(self, module: str, **constants: str) -> None:
        """Read the file beside a module, given by its `__file__`."""
        path = Path(module).with_name("tables.toml")
        self._tables = tomllib.loads(path.read_text(encoding="utf-8"))
        shared: dict[str, str] = self._tables.pop("shared", {})
        self.shared = {key: _on_one_line(text, constants) for key, text in shared.items()}
        self._constants = {**constants, **self.shared}

    def of(
        self, name: str, measured: Callable[[Any], Mapping[str, str]] | None = None
    ) -> dict[str, Any]:
        """Return the name, question, title, shows and measured of a `Layout`.

        `measured` returns, from the subjects of the table, what stands in the braces of the
        sentence on how they were measured.
        """
        texts = {**self._tables[name]}
        how = texts.pop("measured")
        captions = {key: _on_one_line(text, self._constants) for key, text in texts.items()}
        if measured is None:
            return {"name": name, **captions, "measured": _on_one_line(how, self._constants)}

        def sentence(subjects: Any) -> str:
            return _on_one_line(how, {**self._constants, **measured(subjects)})

        return {"name": name, **captions, "measured": sentence}


def _on_one_line(text: str, numbers: Mapping[str, str]) -> str:
    return " ".join(text.format(**numbers).split())
