"""Try the judge itself: every known fault is caught and named, and nobody right is accused.

A fault is *caught* by laws, which know nothing of faults, and *named* by the search that knows
them all. Honest solvers are the reference, its answers in single precision, engines, and models of
the step that are right as declared.
"""

import inspect
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any, Literal, NamedTuple

import numpy as np

from plumbob.reference import Skeleton, forward_kinematics, solve_ik
from plumbob.reference.explicit import symplectic_euler
from plumbob.reference.implicit_euler import ImplicitEuler

from ..engines import SKELETON_ENGINES, forward_kinematics_by
from ..engines.mujoco_mass_spring import MujocoMassSpring
from .case import Case
from .functions import FunctionContestant
from .greeting import PROTOCOL, Greeting, Method, Precision, Step, System
from .judgement import Verdict
from .kinematics.faults import FAULTS, switches
from .kinematics.predictions import predict_forward, predict_track, solve
from .kinematics.robot_inverse_kinematics import FAULTS as ROBOT_FAULTS
from .kinematics.robot_inverse_kinematics import TASK as ROBOTS
from .kinematics.robot_solver import solve_by_reference, solve_wrongly
from .kinematics.textbook import Switches
from .mass_spring.faults import FORCE_FAULTS, STEP_FAULTS, Option, apply
from .mass_spring.model import Integrator, StepModel, simulate
from .mass_spring.problem import all_forces, problem_of, state_of, system_of
from .sentence import sentence
from .verify import verify

_NOTHING = sentence("")
HONEST = "honest solvers"
# How models hold their pins, and how they declare it.
PINS: dict[str, Literal["overwritten", "penalty", "heavy"]] = {
    "overwritten": "overwritten",
    "penalty 1e10": "penalty",
    "heavy 1e8": "heavy",
}
PRECISIONS: dict[Precision, type] = {"double": np.float64, "single": np.float32}
FK, IK, STEP = "forward_kinematics", "inverse_kinematics", "mass_spring_step"
FAMILIES = {"forward": "forward kinematics", "ccd": "CCD", "fabrik": "FABRIK"}
EVERYTHING = System(external_forces=True, tension_only=True)


class Subject(NamedTuple):
    """A solver of which is known what is wrong with it."""

    name: str  # what it is
    family: str  # what it is one of: "CCD", "steps", "honest solvers"
    task: str  # what it solves
    function: Callable[..., Any]  # the solver
    greeting: Greeting  # what it says of itself
    fault: str = ""  # the key of what is wrong; "" if nothing is


class Trial(NamedTuple):
    """What the judge said of a subject."""

    subject: Subject
    verdict: Verdict
    laws: frozenset[str]  # those that were broken
    # whether the first explanation names the fault, or a class of faults that it is in and that no
    # answer tells apart; for an honest one, whether nothing is named
    named: bool

    @property
    def caught(self) -> bool:
        """Whether a law is broken."""
        return bool(self.laws)

    @property
    def passed(self) -> bool:
        """Whether the fault is caught and named, or the honest one is left in peace."""
        if self.subject.fault:
            return self.caught and self.named
        return self.verdict <= Verdict.RIGHT_BUT and self.named


def attempt(subject: Subject) -> Trial:
    """Judge a subject as `verify` judges anyone."""
    contestant = FunctionContestant({subject.task: subject.function}, subject.greeting)
    report = verify(contestant).tasks[0]
    least = Verdict.RIGHT_BUT if subject.fault else Verdict.WRONG
    laws = frozenset(
        finding.law
        for one in report.judgements
        for finding in one.findings
        if finding.verdict >= least and finding.law != "remarks"
    )
    explanations = report.diagnosis.explanations
    told = explanations[0].faults if explanations else ()
    named = subject.fault in told if subject.fault else not told
    return Trial(subject, report.verdict, laws, named)


def subjects() -> Iterator[Subject]:
    """Yield every fault on its own, then the honest solvers."""
    for make in (_kinematic_faults, _mass_spring_faults, _robots, _right_kinematics, _right_steps):
        yield from make()


def _subjects(
    family: str, task: str, functions: Mapping[str, Callable[..., Any]], **said: Any
) -> Iterator[Subject]:
    """Yield a subject for each function by its name, which is its fault if it is not honest."""
    greeting = Greeting(PROTOCOL, (task,), **said)
    for name, function in functions.items():
        yield Subject(name, family, task, function, greeting, "" if family == HONEST else name)


def _kinematic_faults() -> Iterator[Subject]:
    for kind, family in FAMILIES.items():
        task, method = (FK, "") if kind == "forward" else (IK, kind)
        faults = {fault.key: switches([fault]) for fault in FAULTS[kind] if not fault.honest}
        functions = {key: partial(_textbook, method, one) for key, one in faults.items()}
        yield from _subjects(family, task, functions, methods=(method,))


def _robots() -> Iterator[Subject]:
    faults = {key: partial(solve_wrongly, fault) for key, fault in ROBOT_FAULTS.items()}
    yield from _subjects("robots", ROBOTS, faults)
    yield from _subjects(HONEST, ROBOTS, {
        "damped least squares, robots": partial(solve_wrongly, None),
        "reference, robots": solve_by_reference,
    })  # fmt: skip


def _textbook(method: str, switched: Switches, /, **inputs: Any) -> Mapping[str, Any]:
    if not method:
        return predict_forward(switched, Case("", "", inputs, "", _NOTHING))
    local, positions, _ = solve(method, inputs, switched)
    return {"local_rotations": local, "positions": positions}


def _followed(method: str, /, **inputs: Any) -> Mapping[str, Any]:
    return predict_track(method, switches([]), Case("", "", inputs, "", _NOTHING))


# Models of the step, and how they declare themselves.
LINEARISED = StepModel(Integrator("newton", "x_n", 1), damper="explicit")
CONVERGED = StepModel(Integrator("converged", "y"))
LOCAL_GLOBAL = StepModel(Integrator("local_global", "y", 10))
SYMPLECTIC = StepModel(Integrator("symplectic"), 10, "explicit", velocity="separate")


def _declared(model: StepModel, method: Method, iterations: int | None = None) -> Step:
    velocity: Any = "separate" if model.velocity == "separate" else "displacement"
    said: Any = {"start": model.integrator.start} if method != "symplectic" else {}
    said |= {"damper": model.damper, "substeps": model.substeps, "iterations": iterations}
    return Step(method, pins="eliminated", velocity=velocity, **said)


DECLARED: dict[str, tuple[StepModel, Step]] = {
    "linearised": (LINEARISED, _declared(LINEARISED, "linearised", 1)),
    "converged": (CONVERGED, _declared(CONVERGED, "converged")),
    "local/global": (LOCAL_GLOBAL, _declared(LOCAL_GLOBAL, "local_global", 10)),
    "symplectic": (SYMPLECTIC, _declared(SYMPLECTIC, "symplectic")),
}
# A fault that a request for forces does not let one have: it marks no tension-only springs.
NO_FORCES = ("tension only ignored",)
# Faults that only some models can have; the others are tried on a linearised step.
_BASES = {
    "h not divided": "symplectic",
    "pins free until the end": "symplectic",
    "velocity over the whole h": "symplectic",
    "moved in place": "symplectic",
    "pins at the origin": "local/global",
}


class Stepper:
    """A step with faults; it remembers the first h of each system, for factors that are kept."""

    def __init__(
        self, model: StepModel, faults: Sequence[Option] = (), precision: type = np.float64
    ) -> None:
        self.model, self.faults, self.precision = model, tuple(faults), precision
        self.first_h: dict[tuple[bytes, bytes], float] = {}
        every = inspect.Parameter("inputs", inspect.Parameter.VAR_KEYWORD)
        self.__signature__ = inspect.Signature([every])

    def __call__(self, **inputs: Any) -> dict[str, Any]:
        """Return positions and velocities, rounded to the precision."""
        system = inputs["masses"].tobytes(), inputs["stiffnesses"].tobytes()
        p = problem_of(self._rounded(inputs), self.first_h.setdefault(system, inputs["h"]))
        p, model = apply(self.faults, p, self.model)
        with np.errstate(all="ignore"):
            return self._rounded(simulate(p, model))

    def _rounded(self, values: Mapping[str, Any]) -> dict[str, Any]:
        return {
            name: value.astype(self.precision).astype(float)
            if isinstance(value, np.ndarray) and value.dtype.kind == "f"
            else value
            for name, value in values.items()
        }


def _mass_spring_faults() -> Iterator[Subject]:
    options = _by_key([one for one in FORCE_FAULTS if one.key not in NO_FORCES])
    functions = {key: partial(_evaluated, option) for key, option in options.items()}
    yield from _subjects("forces", "mass_spring_forces", functions, system=EVERYTHING)
    for key, option in _by_key(STEP_FAULTS).items():
        model, step = DECLARED[_BASES.get(key, "linearised")]
        stepper = {key: Stepper(model, [option])}
        yield from _subjects("steps", STEP, stepper, system=EVERYTHING, step=step)


def _by_key(options: Sequence[Option]) -> dict[str, Option]:
    """Return the first option of each key."""
    first: dict[str, Option] = {}
    for option in options:
        first.setdefault(option.key, option)
    return first


def _evaluated(option: Option, /, **inputs: Any) -> Mapping[str, Any]:
    p, _ = apply((option,), problem_of(inputs), CONVERGED)
    return {"forces": all_forces(p)}


def _right_kinematics() -> Iterator[Subject]:
    for precision, kind in PRECISIONS.items():
        function = {f"reference, {precision}": partial(_placed, kind)}
        yield from _subjects(HONEST, FK, function, precision=precision)
    engines = {engine: partial(_placed_by, engine) for engine in SKELETON_ENGINES}
    yield from _subjects(HONEST, FK, engines)
    for solver in ("ccd", "fabrik", "levenberg_marquardt"):
        function = {f"reference, {solver}": partial(_solved, solver)}
        yield from _subjects(HONEST, IK, function, methods=(solver,))
    for method in ("ccd", "fabrik"):
        function = {f"textbook, {method}": partial(_followed, method)}
        yield from _subjects(HONEST, "track", function, methods=(method,))


def _placed(kind: type, /, parents: Any, offsets: Any, local_rotations: Any) -> Any:
    pose = forward_kinematics(Skeleton(parents, offsets), local_rotations)
    return pose.positions.astype(kind), pose.rotations.astype(kind)


def _placed_by(engine: str, /, parents: Any, offsets: Any, local_rotations: Any) -> Any:
    skeleton = SKELETON_ENGINES[engine](Skeleton(parents, offsets))
    return tuple(forward_kinematics_by(skeleton, local_rotations))


def _solved(solver: str, /, parents: Any, offsets: Any, method: str, **inputs: Any) -> Any:
    solution = solve_ik(Skeleton(parents, offsets), solver=solver, **inputs)
    return {"local_rotations": solution.local_rotations, "positions": solution.positions}


# Steps of the reference and of MuJoCo, and what they declare to be. The reference's damper is
# part of the energy, MuJoCo's discrete step likewise; see docs/verify.md.
_REFERENCE: dict[str, tuple[Callable[..., Any], Step]] = {
    "implicit Euler by Newton": (
        lambda s, state, h: ImplicitEuler(s, h=h, solver="newton", tolerance=0.0).step(state).state,
        Step("converged", damper="length_rate")),
    "ten local/global iterations": (
        lambda s, state, h: ImplicitEuler(
            s, h=h, solver="local_global", tolerance=0.0, max_iterations=10).step(state).state,
        Step("local_global", "y", 10, damper="length_rate")),
    "symplectic Euler": (
        symplectic_euler, Step("symplectic", damper="explicit", velocity="separate")),
    "MuJoCo Euler": (
        lambda s, state, h: MujocoMassSpring(s, h=h, integrator="Euler").step(state),
        Step("symplectic")),
    "MuJoCo discrete": (
        lambda s, state, h: MujocoMassSpring(s, h=h, integrator="discrete").step(state),
        Step("linearised")),
}  # fmt: skip


def _right_steps() -> Iterator[Subject]:
    for name, (model, step) in DECLARED.items():
        for precision, kind in PRECISIONS.items():
            stepper = {f"{name}, {precision}": Stepper(model, (), kind)}
            yield from _subjects(HONEST, STEP, stepper, step=step, precision=precision)
        yield from _subjects(HONEST, STEP, {f"{name}, undeclared": Stepper(model)})
    for pins, said in PINS.items():
        stepper = {f"linearised, pins {pins}": Stepper(LINEARISED._replace(pins=pins))}
        yield from _subjects(HONEST, STEP, stepper, step=Step(pins=said))
    for name, (function, step) in _REFERENCE.items():
        yield from _subjects(HONEST, STEP, {name: partial(_stepped, function)}, step=step)


def _stepped(function: Callable[..., Any], /, **inputs: Any) -> dict[str, Any]:
    p = problem_of(inputs)
    state = function(system_of(p), state_of(p), p.h)
    return {"positions": state.positions, "velocities": state.velocities}
