"""Starters in five languages that speak the protocol and lack only the user's code."""

from collections.abc import Mapping
from importlib import resources
from typing import NamedTuple


class Language(NamedTuple):
    """What a starter consists of.

    Attributes:
        files: their names; the first is the user's to fill in.
        build: the command that compiles it, or "".
        run: the command to be judged.
    """

    files: tuple[str, ...]
    build: str
    run: str


LANGUAGES: Mapping[str, Language] = {
    "cpp": Language(
        ("solver.cpp", "plumbob.hpp"), "g++ -std=c++17 -O2 solver.cpp -o solver", "./solver"
    ),
    "rust": Language(("solver.rs", "plumbob.rs"), "rustc -O solver.rs", "./solver"),
    "javascript": Language(("solver.js",), "", "node solver.js"),
    "csharp": Language(
        ("Solver.cs", "Solver.csproj"), "dotnet build -o out Solver.csproj", "dotnet out/Solver.dll"
    ),
    "python": Language(("solver.py",), "", "python3 solver.py"),
}


def template(language: str) -> dict[str, str]:
    """Return the text of each file of a starter, by its name.

    Raises:
        ValueError: if there is none in this language.
    """
    if language not in LANGUAGES:
        raise ValueError(f"template: expected one of {', '.join(LANGUAGES)}, got {language!r}")
    folder = resources.files(__name__)
    return {
        name: folder.joinpath(name).read_text(encoding="utf-8")
        for name in LANGUAGES[language].files
    }
