"""Write a page for each family of faults into docs/faults, from the catalogues of `verify`.

    python tools/write_faults.py

`make docs` does so before it builds the site.
"""

import re
from itertools import groupby
from pathlib import Path

from plumbob.verify.fault_programs import FAMILIES, coded_faults
from plumbob.verify.screen.fault_text import cause_and_remedy, changed_lines

FOLDER = Path(__file__).parents[1] / "docs" / "faults"


def escaped(text):
    """A text in which Markdown finds no marks."""
    return re.sub(r"([\\`*_<|\[\]])", r"\\\1", text)


def page(family, faults):
    """The page of a family, a section for each fault."""
    lines = [f"# {FAMILIES[family]['about']}", ""]
    for fault in faults:
        cause, remedy = map(escaped, cause_and_remedy(fault, str))
        lines += [f"## {fault.code}", "", f"**Cause.** {cause}", ""]
        lines += [f"**Remedy.** {remedy}", ""] if remedy else []
        lines += ["```diff", *changed_lines(fault), "```", ""] if fault.lines else []
    for program in dict.fromkeys(fault.right_program for fault in faults):
        lines += ["## A right program", "", "```python", program.strip(), "```", ""]
    return "\n".join(lines)


def write():
    """Write all pages."""
    numbered = enumerate(groupby(coded_faults().values(), key=lambda fault: fault.family), 1)
    for number, (family, faults) in numbered:
        path = FOLDER / f"pb-{number:02}-{family.lower()}.md"
        path.write_text(page(family, list(faults)), encoding="utf-8")


if __name__ == "__main__":
    write()
