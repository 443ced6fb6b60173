"""The style of the pages of `verify` and of the bench, and the escaping of their texts."""

from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined

# Colours, in the light and in the dark, fonts and headings.
BASE_STYLE = Path(__file__).with_name("base.css").read_text(encoding="utf-8")


def environment(folder: Path) -> Environment:
    """Return the environment of the templates in a folder, which escapes texts."""
    return Environment(
        loader=FileSystemLoader(folder), autoescape=True, undefined=StrictUndefined,
        trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
