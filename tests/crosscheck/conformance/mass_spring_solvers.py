"""Solvers of the mass-spring tasks for the tests: the dense model with chosen faults."""

import inspect

import numpy as np

from crosscheck.conformance.functions import FunctionContestant
from crosscheck.conformance.greeting import PROTOCOL, Greeting, Step
from crosscheck.conformance.mass_spring.faults import apply
from crosscheck.conformance.mass_spring.model import Integrator, Model, simulate
from crosscheck.conformance.mass_spring.problem import problem_of
from crosscheck.conformance.verify import verify

LINEARISED = Model(Integrator("newton", "x_n", 1), damper="explicit")
CONVERGED = Model(Integrator("converged", "y"))
LOCAL_GLOBAL = Model(Integrator("local_global", "y", 10))
SYMPLECTIC = Model(Integrator("symplectic"), 10, "explicit", velocity="separate")
DECLARED = {
    "linearised": (LINEARISED, Step("linearised", "x_n", 1, 1, "explicit", None, "eliminated",
                                    "displacement")),
    "converged": (CONVERGED, Step("converged", "y", None, 1, "length_rate", None, "eliminated",
                                  "displacement")),
    "local/global": (LOCAL_GLOBAL, Step("local_global", "y", 10, 1, "length_rate", None,
                                        "eliminated", "displacement")),
    "symplectic": (SYMPLECTIC, Step("symplectic", None, None, 10, "explicit", None, "eliminated",
                                    "separate")),
}  # fmt: skip


class Stepper:
    """A step with faults; it remembers the first h of each system, for factors that are kept."""

    def __init__(self, model, faults=(), precision=np.float64):
        self.model, self.faults, self.precision = model, faults, precision
        self.first_h = {}
        self.__signature__ = inspect.Signature(
            [inspect.Parameter("inputs", inspect.Parameter.VAR_KEYWORD)]
        )

    def __call__(self, **inputs):
        rounded = {name: self.rounded(value) for name, value in inputs.items()}
        system = inputs["masses"].tobytes(), inputs["stiffnesses"].tobytes()
        p = problem_of(rounded, self.first_h.setdefault(system, inputs["h"]))
        p, model = apply(tuple(self.faults), p, self.model)
        with np.errstate(all="ignore"):
            found = simulate(p, model)
        return {name: self.rounded(value) for name, value in found.items()}

    def rounded(self, value):
        if isinstance(value, np.ndarray) and value.dtype.kind == "f":
            return value.astype(self.precision).astype(float)
        return value


def report(function, task="mass_spring_step", step=None, **greeting):
    """Return the report on a function."""
    hello = Greeting(PROTOCOL, (task,), step=step or Step(), **greeting)
    return verify(FunctionContestant({task: function}, hello)).tasks[0]


def named(found):
    """Return the faults that the diagnosis names, all classes together."""
    return {key for one in found.diagnosis.explanations for key in one.faults}
