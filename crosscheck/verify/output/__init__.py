"""The command `plumbob verify`: its terminal, its files, its page."""

from pathlib import Path

# Colours, in the light and in the dark, fonts and headings, which the bench's page shares.
BASE_STYLE = Path(__file__).with_name("base.css").read_text(encoding="utf-8")
