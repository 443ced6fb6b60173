"""Every paper that is cited stands in docs/references.md, once, with the folders that cite it."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
LIST = ROOT / "docs" / "references.md"
NAME = r"[A-ZÀ-Ž][A-Za-zÀ-ž'’]+(?:-[A-Z][a-z]+)?"
# Names, perhaps a title in quotation marks, and a year: "Wang & Chen 1991", "Liu et al. (2013)".
CITATION = re.compile(
    rf"\b((?:{NAME}(?:, and | and | & |, ))*{NAME})(?: et al\.)?,?"
    r'(?: "[^"]{5,90}")?,? \(?(1[89]\d\d|20[0-2]\d)\b(?!-)'
)
ENTRY = re.compile(r"^- \*\*(.+?) (\d{4})\.\*\* \*(.+?)\.\* (.+?)\. In (.+?)\.$")


def sources():
    for folder in ("reference", "crosscheck", "verify", "bench", "tests"):
        for ending in ("py", "toml"):
            yield from sorted((ROOT / folder).rglob(f"*.{ending}"))
    yield from [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


def citations():
    """Yield folder, surnames and year of every citation in code, tests and pages but the list."""
    for path in sources():
        if path not in (LIST, Path(__file__)):
            for names, year in cited(path.read_text(encoding="utf-8")):
                yield place(path), names, year


def cited(text):
    for names, year in CITATION.findall(re.sub(r"\s*\n\s*(?:# ?)?", " ", text)):
        yield re.split(r", and | and | & |, ", names), int(year)


def place(path):
    """The folder of a file that cites; below reference/ and crosscheck/ the one that holds it."""
    parts = path.relative_to(ROOT).parts
    if parts[0] in ("reference", "crosscheck"):
        return "/".join(parts[:2])
    return parts[0]


def entries():
    """Yield authors, year, title, venue and folders of every item of the list."""
    text = re.sub(r"\n  +", " ", LIST.read_text(encoding="utf-8"))
    for line in text.splitlines():
        if line.startswith("- "):
            authors, year, title, venue, places = ENTRY.match(line).groups()
            folders = re.findall(r"`([^`]+)`", places)
            yield authors.split(", "), int(year), title, venue, folders


def matches(names, year, authors, published):
    """Whether surnames and a year are those of a paper: the first author, or all."""
    return year == published and names in ([authors[0]], authors)


def test_every_citation_is_listed_once():
    listed = [(authors, year) for authors, year, *_ in entries()]
    for folder, names, year in citations():
        found = [one for one in listed if matches(names, year, *one)]
        assert len(found) == 1, (folder, names, year, found)


def test_every_paper_of_the_list_is_cited_where_it_says():
    found = list(citations())
    for authors, year, _, _, folders in entries():
        citing = {place for place, names, when in found if matches(names, when, authors, year)}
        assert citing == set(folders), (authors, year)


def test_the_list_is_in_order_and_holds_no_paper_twice():
    keys = [(authors, year) for authors, year, *_ in entries()]
    assert keys == sorted(keys)
    titles = [title.lower() for _, _, title, *_ in entries()]
    assert len(titles) == len(set(titles)) > 40


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("descent (Wang & Chen 1991).", (["Wang", "Chen"], 1991)),
        ("by Liu et al. (2013): g", (["Liu"], 2013)),
        ("# see Liu, Bargteil, O'Brien, Kavan\n# 2013: a cloth", (["Liu", "Bargteil", "O'Brien",
         "Kavan"], 2013)),
        ('Haviland and Corke, "Manipulator kinematics" (2022)', (["Haviland", "Corke"], 2022)),
        ("Dolan and Moré 2002", (["Dolan", "Moré"], 2002)),
        ("Bar-Itzhack 2000", (["Bar-Itzhack"], 2000)),
    ],
)  # fmt: skip
def test_a_citation_is_found_in_every_form(text, expected):
    assert list(cited(text)) == [expected]


@pytest.mark.parametrize("text", ["_SEED = 1986", "(FROM_Y, 2000)", "1999-01-01", "Fig. 2013a"])
def test_other_numbers_are_no_citations(text):
    assert list(cited(text)) == []
