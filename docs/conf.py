"""Settings of the documentation, which `make docs` builds with Sphinx into build/docs."""

import re
import sys
from importlib.metadata import version as installed_version
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tools"))
import write_faults

project = "Plumbob"
author = copyright = "The Plumbob authors"
version = release = installed_version("plumbob")

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
exclude_patterns = ["sample", "gate"]
source_suffix = {".md": "markdown"}
myst_heading_anchors = 3
default_role = "code"  # docstrings write names in single backticks
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_preserve_defaults = True
napoleon_google_docstring = True

html_theme = "furo"
html_title = f"Plumbob {version}"
html_show_sourcelink = False


def escape_marks(app, what, name, object_, options, lines):
    """Keep the bars and stars of formulas, such as |grad g|, from being read as markup."""
    for number, line in enumerate(lines):
        parts = re.split(r"(`+[^`]*`+)", line)
        parts[::2] = [re.sub(r"(?<!\\)([|*])", r"\\\1", part) for part in parts[::2]]
        lines[number] = "".join(parts)


def shorten_types(app, what, name, object_, options, signature, returns):
    """Write `ArrayLike` for NumPy's long union of that name."""
    union = re.compile(r"_Buffer \| .*?complex \| bytes \| str\]")
    return signature and union.sub("ArrayLike", signature), returns


def setup(app):
    """Connect the hooks; napoleon turns sections into markup at priority 500."""
    app.connect("builder-inited", lambda app: write_faults.write())
    app.connect("autodoc-process-docstring", escape_marks, priority=400)
    app.connect("autodoc-process-signature", shorten_types)
