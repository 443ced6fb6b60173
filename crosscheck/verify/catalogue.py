"""Renew the gettext catalogues from the sources: `make messages`.

A catalogue is a .po file, which people edit, and the .mo file that gettext reads. Renewing keeps
every translation that is still used, adds what has none yet with an empty one, and writes the .mo
file anew.
"""

import ast
import re
import string
import struct
from collections.abc import Iterator
from pathlib import Path

from .language import DOMAIN, LANGUAGES, LOCALES
from .task import TASKS

ROOT = Path(__file__).resolve().parents[2]
# Where sentences stand.
SOURCES = ("crosscheck/verify", "plumbob/commands/verify.py")
_ENTRY = re.compile(r'^msgid ((?:".*"\n)+)msgstr ((?:".*"\n?)+)', re.MULTILINE)
_UNIT = re.compile(r"\[[^\]]*\]")
_MAGIC, _HEAD = 0x950412DE, 28


def templates() -> dict[str, str]:
    """Return every template that can be shown, and the file in which it stands first."""
    found: dict[str, str] = {}
    for folder in SOURCES:
        for path in sorted((ROOT / folder).rglob("*.py")) or [ROOT / folder]:
            place = path.relative_to(ROOT).as_posix()
            for template in literal_templates(path.read_text(encoding="utf-8"), place):
                found.setdefault(template, place)
    for text in _of_tasks():
        found.setdefault(text, "crosscheck/verify/task.py")
    return {text: place for text, place in found.items() if has_words(text)}


def literal_templates(source: str, place: str) -> Iterator[str]:
    """Yield the first argument of every call of `sentence` in a source, both if it chooses one.

    Raises:
        ValueError: if one is no literal, so that nobody could translate it.
    """
    calls = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Call)]
    for node in sorted(calls, key=lambda node: (node.lineno, node.col_offset)):
        if getattr(node.func, "id", None) != "sentence":
            continue
        for literal in _choices(node.args[0] if node.args else None):
            if not isinstance(literal, ast.Constant) or not isinstance(literal.value, str):
                raise ValueError(f"{place}:{node.lineno}: expected a literal template")
            yield literal.value


def _choices(node: ast.expr | None) -> list[ast.expr | None]:
    if isinstance(node, ast.IfExp):
        return [*_choices(node.body), *_choices(node.orelse)]
    return [node]


def _of_tasks() -> Iterator[str]:
    for task in TASKS.values():
        yield task.about
        yield from (field.about for field in (*task.inputs, *task.outputs))


def has_words(template: str) -> bool:
    """Return whether a template has letters besides its fields and units such as [m]."""
    parts = string.Formatter().parse(_UNIT.sub("", template))
    return any(letter.isalpha() for text, *_ in parts for letter in text)


def fields(template: str) -> list[tuple[str, str, str]]:
    """Return the name, format and conversion of every field, sorted."""
    return sorted(
        (name, form or "", how or "")
        for _, name, form, how in string.Formatter().parse(template)
        if name is not None
    )


def path_of(language: str, suffix: str) -> Path:
    """Return where a language's catalogue stands, suffix ".po" or ".mo"."""
    return LOCALES / LANGUAGES[language] / "LC_MESSAGES" / f"{DOMAIN}{suffix}"


def read(text: str) -> dict[str, str]:
    """Return the translation of every template of a .po file, the head's template being ""."""
    return {_unquoted(one[1]): _unquoted(one[2]) for one in _ENTRY.finditer(text)}


def _unquoted(lines: str) -> str:
    return "".join(ast.literal_eval(line) for line in lines.splitlines())


def write(entries: dict[str, str], places: dict[str, str]) -> str:
    """Return a .po file of a head, entry "", and of the templates in order of their places."""
    blocks = [f'msgid ""\nmsgstr ""\n{_head(entries[""])}']
    for template, place in places.items():
        blocks.append(
            f"#: {place}\nmsgid {_quoted(template)}\nmsgstr {_quoted(entries.get(template, ''))}\n"
        )
    return "\n".join(blocks)


def _head(head: str) -> str:
    return "".join(f"{_quoted(line)}\n" for line in head.splitlines(keepends=True))


def _quoted(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return f'"{escaped}"'


def compiled(entries: dict[str, str]) -> bytes:
    """Return a .mo file: a head, two tables of lengths and offsets, and the texts, sorted."""
    pairs = sorted(
        (template.encode(), translation.encode())
        for template, translation in entries.items()
        if translation
    )
    count = len(pairs)
    start = _HEAD + 16 * count
    tables: list[bytes] = []
    texts: list[bytes] = []
    for side in zip(*pairs, strict=True):
        for text in side:
            tables.append(struct.pack("<II", len(text), start))
            texts.append(text + b"\0")
            start += len(text) + 1
    head = struct.pack("<7I", _MAGIC, 0, count, _HEAD, _HEAD + 8 * count, 0, _HEAD + 16 * count)
    return head + b"".join(tables) + b"".join(texts)


def renew() -> None:
    """Write both files of each language anew, and say what has no translation yet."""
    places = templates()
    for language in filter(LANGUAGES.get, LANGUAGES):
        source = path_of(language, ".po")
        entries = read(source.read_text(encoding="utf-8"))
        source.write_text(write(entries, places), encoding="utf-8")
        kept = {text: entries.get(text, "") for text in ("", *places)}
        path_of(language, ".mo").write_bytes(compiled(kept))
        missing = [template for template in places if not entries.get(template)]
        print(f"{language}: {len(places) - len(missing)} translated, {len(missing)} not yet")
        print("".join(f"  {template}\n" for template in missing), end="")


if __name__ == "__main__":
    renew()
