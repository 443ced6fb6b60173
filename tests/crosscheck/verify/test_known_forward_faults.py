"""Known faults of forward kinematics are applied where a solver's CCD and FABRIK are judged."""

import pytest
from kinematics_solvers import FORWARD, INVERSE, METHODS, named, textbook

from plumbob.crosscheck.verify.functions import FunctionContestant
from plumbob.crosscheck.verify.greeting import Greeting
from plumbob.crosscheck.verify.kinematics.faults import by_key
from plumbob.crosscheck.verify.verify import verify

# Faults of forward kinematics: one, two, and one that is never tried together with others.
BASES = [
    ["offset not rotated"],
    ["product reversed", "root rotation dropped"],
    ["offset rotated backwards", "positions from the root"],
    ["Euler angles XYZ as ZYX"],
]
OWN = {"ccd": ["global rotation stored as local", "target from the origin"],
       "fabrik": ["global directions as local rotations", "no backward pass"]}  # fmt: skip


def reports(base, own, method, declared=True):
    """Return the reports on a solver's forward kinematics and on its inverse kinematics."""
    faults = [by_key(method)[key] for key in base]
    extra = [by_key(method)[key] for key in own]
    functions = {
        FORWARD: textbook(FORWARD, faults),
        INVERSE: textbook(INVERSE, [*faults, *extra], method),
    }
    methods = (method if declared else "",)
    return verify(
        FunctionContestant(functions, Greeting(1, (FORWARD, INVERSE), methods=methods))
    ).tasks


@pytest.mark.parametrize("declared", [True, False])
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("base", BASES)
def test_solver_that_only_stands_on_wrong_forward_kinematics_is_said_to(base, method, declared):
    forward, inverse = reports(base, [], method, declared)
    assert set(base) <= set(" + ".join(named(forward)[0]).split(" + "))
    first = inverse.diagnosis.explanations[0]
    assert first.share == 1.0
    assert "Its own steps are right" in str(first.sentence)
    assert set(base) <= set(first.faults[0].split(" + "))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("base", BASES[1:])
def test_fault_on_top_of_wrong_forward_kinematics_is_named(base, method):
    for own in OWN[method]:
        _, inverse = reports(base, [own], method)
        assert any({*base, own} <= set(key.split(" + ")) for key in named(inverse)[0])
