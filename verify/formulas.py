"""Formulas in catalogues of faults: expressions of NumPy."""

from collections.abc import Mapping
from functools import cache
from types import CodeType
from typing import Any


@cache
def compiled(formula: str) -> CodeType:
    """Return the code of a formula, for `eval`."""
    return compile(formula, "faults.toml", "eval")


def value_of(formula: str, names: Mapping[str, Any]) -> Any:
    """Return the value of a formula, given the values of its names."""
    return eval(compiled(formula), {**names})
