"""The claims about mass-spring systems, from `claims.toml`."""

import tomllib
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

from ..tolerances import TOLERANCES
from ..verdict import Claim, each_case
from . import equilibria, forces, integrators, orders, steps

MODULES: dict[str, ModuleType] = {
    "equilibria": equilibria,
    "forces": forces,
    "integrators": integrators,
    "orders": orders,
    "steps": steps,
}


def _claim(name: str, entry: dict[str, Any]) -> Claim:
    module, _, function = entry["compare"].partition(".")
    compare = partial(getattr(MODULES[module], function), *entry.get("arguments", ()))
    return Claim(
        name,
        entry["quantity"],
        entry["counterpart"],
        each_case(compare),
        TOLERANCES[entry["tolerance"]],
        entry["cases"],
    )


_TABLE = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
MASS_SPRING_CLAIMS = [_claim(name, entry) for name, entry in _TABLE.items()]
