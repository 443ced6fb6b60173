"""Renew the gettext catalogues (.po, .mo) from the sources, with `make messages`."""

import ast
import io
import re
import string
import tomllib
from collections.abc import Iterable, Iterator
from pathlib import Path

from babel.messages import Catalog
from babel.messages.mofile import write_mo
from babel.messages.pofile import read_po, write_po

from plumbob.text.language import DOMAIN, LANGUAGES, LOCALES

ROOT = Path(__file__).resolve().parents[1]
# The folders and files that call `sentence`.
SOURCES = ("verify", "plumbob/text", "plumbob/cli/verify.py")
_UNIT = re.compile(r"\[[^\]]*\]")


def templates() -> dict[str, str]:
    """Return every template that can be shown, and the first file that has it."""
    templates: dict[str, str] = {}
    for folder in SOURCES:
        for path in sorted((ROOT / folder).rglob("*.py")) or [ROOT / folder]:
            place = path.relative_to(ROOT).as_posix()
            for template in literal_templates(path.read_text(encoding="utf-8"), place):
                templates.setdefault(template, place)
    for path in sorted((ROOT / SOURCES[0]).rglob("*.toml")):
        for template in table_templates(tomllib.loads(path.read_text(encoding="utf-8"))):
            templates.setdefault(template, path.relative_to(ROOT).as_posix())
    return {template: place for template, place in templates.items() if has_words(template)}


def literal_templates(source: str, place: str) -> Iterator[str]:
    """Yield the templates of all `sentence` calls in a source; raise ValueError for others."""
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


def table_templates(entry: object) -> Iterator[str]:
    """Yield the texts of the keys `sentence` and `about` in the content of a TOML file."""
    if isinstance(entry, dict):
        texts = (entry.get("sentence"), entry.get("about"))
        yield from (text for text in texts if isinstance(text, str))
    for inner in entry.values() if isinstance(entry, dict) else ():
        yield from table_templates(inner)
    for inner in entry if isinstance(entry, list) else ():
        yield from table_templates(inner)


def has_words(template: str) -> bool:
    """Return whether a template has letters besides its fields and units such as [m]."""
    parts = string.Formatter().parse(_UNIT.sub("", template))
    return any(letter.isalpha() for text, *_ in parts for letter in text)


def fields(template: str) -> list[tuple[str, str, str]]:
    """Return the name, format and conversion of every field, sorted."""
    return sorted(
        (name, spec or "", conversion or "")
        for _, name, spec, conversion in string.Formatter().parse(template)
        if name is not None
    )


def path_of(language: str, suffix: str) -> Path:
    """Return the path of a language's catalogue, suffix ".po" or ".mo"."""
    return LOCALES / LANGUAGES[language] / "LC_MESSAGES" / f"{DOMAIN}{suffix}"


def read(path: Path) -> Catalog:
    """Return the catalogue in a .po file."""
    with path.open("rb") as file:
        return read_po(file)


def renewed(catalogue: Catalog, texts: Iterable[str]) -> Catalog:
    """Return a catalogue of templates in order, with the previous translations."""
    template = Catalog(creation_date=catalogue.creation_date)
    for text in texts:
        template.add(text)
    catalogue.update(template, no_fuzzy_matching=True)
    catalogue.obsolete.clear()
    return catalogue


def to_po(catalogue: Catalog) -> bytes:
    """Return the .po file of a catalogue, without the files that have a text: these move."""
    file = io.BytesIO()
    write_po(file, catalogue, width=0)
    return file.getvalue()


def renew() -> None:
    """Write both files of each language, and print the templates without translation."""
    for language in filter(LANGUAGES.get, LANGUAGES):
        source = path_of(language, ".po")
        catalogue = renewed(read(source), templates())
        source.write_bytes(to_po(catalogue))
        with path_of(language, ".mo").open("wb") as file:
            write_mo(file, catalogue)
        missing = [message.id for message in catalogue if message.id and not message.string]
        print(f"{language}: {len(catalogue) - len(missing)} translated, {len(missing)} not yet")
        print("".join(f"  {template}\n" for template in missing), end="")


if __name__ == "__main__":
    renew()
