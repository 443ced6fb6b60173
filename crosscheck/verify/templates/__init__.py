"""Starters in five languages that speak the protocol and lack only the user's code."""

import re
from collections.abc import Mapping
from importlib import resources
from typing import NamedTuple


class Language(NamedTuple):
    """What a starter consists of."""

    files: tuple[str, ...]  # their names; the first is the user's to fill in
    build: str  # the command that compiles it, or ""
    run: str  # the command to be judged


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
# What stands above the greeting of every starter.
GREETING_FIELDS = """
The greeting: what it leaves out is the first value named, or seen in your answers.
protocol, tasks: 1, and those that you offer; name, version, language: as they are shown
precision: "double", or "single" if you compute in float; print 17 digits, or 9 of a float
methods: of inverse kinematics, each asked for by its name; "ccd", "fabrik" are known
chains_only: false, or true if you take no branches; max_joints: the most that you take
system: what you take. masses, stiffnesses, dampings: of "each", or "one" for all;
  rest_lengths: "given", or "measured" in rest_positions; gravity: "vector", or "number"
  along -y; pinned: true; external_forces, tension_only: false; state: "velocities", or
  "previous_positions"; continues: false, or true if you go on from your last answer
step: what you make. method: explicit, symplectic, linearised, local_global, newton or
  converged; start: where iterations begin, "x_n" or "y" = x_n + h v_n; iterations,
  substeps: how many; damper: none, explicit, length_rate, end_velocity, or global_factor
  that multiplies velocities by damping_factor; pins: eliminated, overwritten after the
  solve, penalty or heavy; velocity: "displacement" over h, or "separate"
"""


def template(language: str) -> dict[str, str]:
    """Return the text of each file of a starter by name; ValueError for other languages."""
    if language not in LANGUAGES:
        raise ValueError(f"template: expected one of {', '.join(LANGUAGES)}, got {language!r}")
    folder = resources.files(__name__)
    fields = GREETING_FIELDS.strip().replace("\n", r"\n\1")
    texts = {name: folder.joinpath(name).read_text("utf-8") for name in LANGUAGES[language].files}
    marker = re.compile("( *(?://|#) )GREETING_FIELDS")
    return {name: marker.sub(rf"\1{fields}", text) for name, text in texts.items()}
