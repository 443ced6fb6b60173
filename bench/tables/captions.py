"""Titles and captions of tables and figures, from the file NAME.toml beside a module NAME.py."""

import tomllib
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from string import Formatter
from typing import Any

from ..measure.record import Record
from .layout import Layout, records_of
from .results import Results, settings
from .table import NO_SUMMARY, Summary, in_unit, words


class Captions:
    """The captions of an experiment's tables.

    Braces in a caption hold a number of the measurement, or a sentence of the part `[shared]`.
    """

    def __init__(self, module: str, **constants: str) -> None:
        """Read the file beside a module, given by its `__file__`."""
        path = Path(module).with_suffix(".toml")
        self._tables = tomllib.loads(path.read_text(encoding="utf-8"))
        self._figures = self._tables.pop("figures", {})
        shared: dict[str, str] = self._tables.pop("shared", {})
        self.shared = {key: _on_one_line(text, constants) for key, text in shared.items()}
        self._constants = {**constants, **self.shared}

    def layout(
        self,
        name: str,
        subjects: Callable[[Results], Iterable[Any]],
        summary: Callable[[Any], Summary] = lambda subjects: NO_SUMMARY,
        measured: Callable[[Any], Mapping[str, str]] | None = None,
        **fields: Any,
    ) -> Layout:
        """Return the layout of a table with its texts from the file.

        `measured` returns, from the subjects of the table, the words in braces of the sentence on
        the measurement. Other braces hold the settings of the subjects' records. The fields are the
        fields of `Layout` beside the texts.
        """
        texts = {**self._tables[name]}
        template = texts.pop("measured")
        captions: dict[str, Any] = {
            key: _on_one_line(text, self._constants) for key, text in texts.items()
        }
        names = {field for _, field, _, _ in Formatter().parse(template) if field}

        def sentence(rows: Any) -> str:
            numbers = measured(rows) if measured else {}
            missing = names - {*self._constants, *numbers}
            settings = {field: _setting(list(records_of(rows)), field) for field in missing}
            return _on_one_line(template, {**self._constants, **settings, **numbers})

        is_constant = measured is None and names <= self._constants.keys()
        captions |= {"measured": sentence([]) if is_constant else sentence, **fields}
        return Layout(name=name, subjects=subjects, summary=summary, **captions)

    def figure(self, name: str) -> dict[str, Any]:
        """Return the name, title, caption and axes of a chart, a sketch or a scene."""
        fields = {
            key: _on_one_line(field, self._constants) if isinstance(field, str) else field
            for key, field in self._figures[name].items()
        }
        return {"name": name, **fields}


def _setting(records: list[Record], name: str) -> str:
    """Return a setting of some records as words; `h_in_ms` is the length of their steps."""
    if name == "h_in_ms":
        lengths = sorted({record.settings["h"] for record in records if "h" in record.settings})
        return " or ".join(words(in_unit(h, "ms")) for h in lengths) or "–"
    return settings(records, name) or "–"


def _on_one_line(text: str, numbers: Mapping[str, str]) -> str:
    return " ".join(text.format(**numbers).split())
