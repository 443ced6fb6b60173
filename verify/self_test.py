"""Test the judge: laws catch every known fault, the search names it, honest solvers are right.

A fault is caught if a law calls an answer wrong, if the solver is judged by less than what it is
sent, or if it is named beside a reservation; a mere reservation (RIGHT EXCEPT) does not count.
"""

import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from functools import partial
from typing import Any, Literal, NamedTuple

import numpy as np

from plumbob.reference import Skeleton, forward_kinematics, solve_ik
from plumbob.reference.explicit import symplectic_euler
from plumbob.reference.implicit_euler import ImplicitEuler
from plumbob.reference.skeleton import Pose
from plumbob.text.sentence import codes_in, sentence

from .case import Case
from .fault_programs import PROGRAMS, CodedFault, coded_faults, connection_to, source_of
from .functions import FunctionConnection
from .greeting import PROTOCOL, Greeting, Method, Precision, Step, System
from .judgement import Report, Verdict
from .kinematics.honest import HONEST as HONEST_SWEEPS
from .kinematics.limits import solve_within
from .kinematics.predictions import predict_track
from .kinematics.robot_inverse_kinematics import TASK as ROBOTS
from .kinematics.robot_inverse_kinematics import solve_by_reference
from .kinematics.robot_jacobian import TASK as ROBOT_JACOBIAN
from .kinematics.robot_motions import TASK as ROBOT_TRACK
from .kinematics.robot_motions import followed
from .kinematics.robot_velocity import TASK as ROBOT_VELOCITY
from .mass_spring.model import Integrator, StepModel, simulate
from .mass_spring.problem import problem_of, state_of, system_of
from .one_line.right_programs import BY_LINES, is_of
from .verify import verify

HONEST = "honest solvers"
# The pins of models, and how they declare them.
PINS: dict[str, Literal["overwritten", "penalty", "heavy"]] = {
    "overwritten": "overwritten",
    "penalty 1e10": "penalty",
    "heavy 1e8": "heavy",
}
PRECISIONS: dict[Precision, type] = {"double": np.float64, "single": np.float32}
FK, IK, STEP = "forward_kinematics", "inverse_kinematics", "mass_spring_step"
# The families of faults of mass-spring systems, by task.
MASS_SPRING = {
    "mass_spring_forces": "forces", "energy": "energies", STEP: "steps",
    "mass_spring_motion": "steps",
}  # fmt: skip
# The headings of the families of faults of kinematics.
FAMILIES = {"FK": "forward kinematics", "QUAT": "quaternions", "CCD": "CCD", "FABRIK": "FABRIK"}
ALL_SYSTEMS = System(external_forces=True, tension_only=True)


class Subject(NamedTuple):
    """A solver with a known fault, or an honest one."""

    name: str
    family: str  # "CCD", "steps", "honest solvers"
    task: str
    function: Callable[..., Any]
    greeting: Greeting
    fault: str = ""  # its key; "" of an honest solver


class Trial(NamedTuple):
    """The judgement of a subject."""

    subject: Subject
    verdict: Verdict
    laws: frozenset[str]  # that were broken
    # whether the first explanation includes the fault; of an honest solver, whether there is none
    named: bool
    first_verdict: Verdict | None = None  # before any cause was sought

    @property
    def caught(self) -> bool:
        """Whether a law is broken, or the fault is named although no law is."""
        return bool(self.laws) or (self.named and self.verdict > Verdict.RIGHT)

    @property
    def passed(self) -> bool:
        """Whether the fault is caught and named, or the honest solver is not accused."""
        if self.subject.fault:
            return self.caught and self.named
        return self.verdict <= Verdict.RIGHT_EXCEPT and self.named


def attempt(subject: Subject) -> Trial:
    """Judge a subject as `verify` judges any solver."""
    connection = FunctionConnection({subject.task: subject.function}, subject.greeting)
    published: list[Report] = []
    report = verify(connection, publish=published.append).tasks[0]
    laws = frozenset(
        finding.law
        for judgement in report.judgements
        for finding in judgement.findings
        if finding.verdict >= Verdict.WRONG
    )
    if report.assumptions and (report.needs_declaration or report.verdict is Verdict.RIGHT_EXCEPT):
        laws |= {"takes what is sent"}
    explanations = report.diagnosis.explanations
    keys = explanations[0].faults if explanations else ()
    known = {*keys, *(NUMBER.sub("", key) for key in keys)}
    is_named = subject.fault in known if subject.fault else not keys
    return Trial(subject, report.verdict, laws, is_named, published[-1].verdict)


# The number of one of several rules of a robot's fault, at the end of its key.
NUMBER = re.compile(r" \d+$")


def subjects() -> Iterator[Subject]:
    """Yield every fault on its own, then the honest solvers."""
    families = (_kinematic_faults, _mass_spring_faults, _robots, _right_kinematics, _right_steps)
    for make in (*families, _limits):
        yield from make()


def _subjects(
    family: str, task: str, functions: Mapping[str, Callable[..., Any]], **declared: Any
) -> Iterator[Subject]:
    """Yield a subject for each function; the name of a faulty function is its fault."""
    greeting = Greeting(PROTOCOL, (task,), **declared)
    for name, function in functions.items():
        yield Subject(name, family, task, function, greeting, "" if family == HONEST else name)


def _kinematic_faults() -> Iterator[Subject]:
    honest = {code for choices in HONEST_SWEEPS.values() for choice in choices
              for code in codes_in(choice.sentence)}  # fmt: skip
    for fault in coded_faults().values():
        if fault.family in FAMILIES and fault.code not in honest:
            method = "" if fault.task == FK else "fabrik" if fault.family == "FABRIK" else "ccd"
            function = {fault.name: _function(fault.task, _in_another_form(fault, method), method)}
            yield from _subjects(FAMILIES[fault.family], fault.task, function, methods=(method,))


def _in_another_form(fault: CodedFault, method: str) -> str:
    """Return a program with a fault, not the fault's own one if another has its lines."""
    for name in PROGRAMS:
        if name != fault.program and is_of(name, fault.task, method):
            with suppress(ValueError):
                return fault.planted_in(source_of(name))
    return fault.wrong_program


def _limits() -> Iterator[Subject]:
    programs = [fault for fault in coded_faults().values() if fault.family == "LIMIT"]
    wrong = {fault.name: _function(IK, fault.wrong_program, "ccd") for fault in programs}
    yield from _subjects("limits", IK, wrong, methods=("ccd",), limits=True)
    right = {"program, limits": _function(IK, programs[0].right_program, "ccd")}
    yield from _subjects(HONEST, IK, right, methods=("ccd",), limits=True)
    for solver in ("ccd", "fabrik"):
        function = {f"reference, {solver}, limits": partial(_solved, solver)}
        yield from _subjects(HONEST, IK, function, methods=(solver,), limits=True)


def _robots() -> Iterator[Subject]:
    for task in (ROBOTS, ROBOT_TRACK, ROBOT_JACOBIAN, ROBOT_VELOCITY):
        faults = [fault for fault in coded_faults().values() if fault.task == task]
        programs = [fault for fault in faults if fault.name not in BY_LINES]
        for fault in programs:
            function = _function(task, fault.wrong_program)
            greeting = connection_to(fault.wrong_program).greeting
            yield Subject(fault.name, "robots", task, function, greeting, fault.name)
        right = {f"program, {task}": _function(task, programs[0].right_program)}
        yield from _subjects(HONEST, task, right)
    yield from _subjects(HONEST, ROBOT_TRACK, {"reference, tracking": _followed})
    solvers = ("levenberg_marquardt", "damped_least_squares")
    robots = {f"reference, {solver}, robots": partial(solve_by_reference, solver)
              for solver in solvers}  # fmt: skip
    yield from _subjects(HONEST, ROBOTS, robots)


def _function(task: str, program: str, method: str = "") -> Callable[..., Any]:
    """Return the function of a program: of a method, or else of the task."""
    names: dict[str, Any] = {}
    exec(compile(program, "program", "exec"), names)
    return names.get(method) or names[task]


def _followed(**inputs: Any) -> Mapping[str, Any]:
    tool = Pose(inputs["target_positions"], inputs["target_rotations"])
    return {"q": followed(inputs, inputs["start"], tool)}


def _track(method: str, /, **inputs: Any) -> Mapping[str, Any]:
    outputs = predict_track(method, Case("", "", inputs, "", sentence("")))
    answer = {"positions": outputs["all_positions"]}
    return answer | {name: outputs[name] for name in outputs if name == "local_rotations"}


# Models of the step, and their declarations.
LINEARISED = StepModel(Integrator("newton", "x_n", 1), damper="explicit")
DAMPED = LINEARISED._replace(damper="end_velocity")
CONVERGED = StepModel(Integrator("converged", "y"))
LOCAL_GLOBAL = StepModel(Integrator("local_global", "y", 10))
SYMPLECTIC = StepModel(Integrator("symplectic"), 10, "explicit", velocity="separate")


def _declared(model: StepModel, method: Method, iterations: int | None = None) -> Step:
    velocity: Any = "separate" if model.velocity == "separate" else "displacement"
    fields: Any = {"start": model.integrator.start} if method != "symplectic" else {}
    fields |= {"damper": model.damper, "substeps": model.substeps, "iterations": iterations}
    return Step(method, pins="eliminated", velocity=velocity, **fields)


DECLARED: dict[str, tuple[StepModel, Step]] = {
    "linearised": (LINEARISED, _declared(LINEARISED, "linearised", 1)),
    "linearised, implicit damping": (DAMPED, _declared(DAMPED, "linearised", 1)),
    "converged": (CONVERGED, _declared(CONVERGED, "converged")),
    "local/global": (LOCAL_GLOBAL, _declared(LOCAL_GLOBAL, "local_global", 10)),
    "symplectic": (SYMPLECTIC, _declared(SYMPLECTIC, "symplectic")),
}


class Stepper:
    """An honest step."""

    def __init__(self, model: StepModel, precision: type = np.float64) -> None:
        self.model, self.precision = model, precision

    def __call__(self, **inputs: Any) -> dict[str, Any]:
        """Return positions and velocities, rounded to the precision."""
        with np.errstate(all="ignore"):
            return self._rounded(simulate(problem_of(self._rounded(inputs)), self.model))

    def _rounded(self, values: Mapping[str, Any]) -> dict[str, Any]:
        return {
            name: value.astype(self.precision).astype(float)
            if isinstance(value, np.ndarray) and value.dtype.kind == "f"
            else value
            for name, value in values.items()
        }


def _mass_spring_faults() -> Iterator[Subject]:
    for fault in coded_faults().values():
        if fault.task in MASS_SPRING:
            function = _function(fault.task, fault.wrong_program)
            greeting = connection_to(fault.wrong_program).greeting
            family = MASS_SPRING[fault.task]
            yield Subject(fault.name, family, fault.task, function, greeting, fault.name)


def _right_kinematics() -> Iterator[Subject]:
    for precision, kind in PRECISIONS.items():
        function = {f"reference, {precision}": partial(_placed, kind)}
        yield from _subjects(HONEST, FK, function, precision=precision)
    for solver in ("ccd", "fabrik", "levenberg_marquardt"):
        function = {f"reference, {solver}": partial(_solved, solver)}
        yield from _subjects(HONEST, IK, function, methods=(solver,))
    for method in ("ccd", "fabrik"):
        function = {f"textbook, {method}": partial(_track, method)}
        yield from _subjects(HONEST, "track", function, methods=(method,))


def _placed(kind: type, /, parents: Any, offsets: Any, local_rotations: Any) -> Any:
    pose = forward_kinematics(Skeleton(parents, offsets), local_rotations)
    return pose.positions.astype(kind), pose.rotations.astype(kind)


def _solved(solver: str, /, parents: Any, offsets: Any, method: str, **inputs: Any) -> Any:
    if "cones" in inputs:
        return {
            "local_rotations": solve_within(
                solver, inputs | {"parents": parents, "offsets": offsets}
            )
        }
    solution = solve_ik(Skeleton(parents, offsets), solver=solver, **inputs)
    return {"local_rotations": solution.local_rotations, "positions": solution.positions}


# Steps of the reference, and their declarations. Its damper is part of the energy; see
# docs/verify.md.
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
}  # fmt: skip


def _right_steps() -> Iterator[Subject]:
    for name, (model, step) in DECLARED.items():
        for precision, kind in PRECISIONS.items():
            stepper = {f"{name}, {precision}": Stepper(model, kind)}
            yield from _subjects(HONEST, STEP, stepper, step=step, precision=precision)
        yield from _subjects(HONEST, STEP, {f"{name}, undeclared": Stepper(model)})
    for pins, declared in PINS.items():
        stepper = {f"linearised, pins {pins}": Stepper(LINEARISED._replace(pins=pins))}
        yield from _subjects(HONEST, STEP, stepper, step=Step(pins=declared))
    for name, (function, step) in _REFERENCE.items():
        yield from _subjects(HONEST, STEP, {name: partial(stepped, function)}, step=step)


def stepped(function: Callable[..., Any], /, **inputs: Any) -> dict[str, Any]:
    """Answer a request by a function of system, state and h."""
    p = problem_of(inputs)
    state = function(system_of(p), state_of(p), p.h)
    return {"positions": state.positions, "velocities": state.velocities}
