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
from .kinematics.faults import FAULTS, Switches, switches
from .kinematics.predictions import predict_forward, predict_track, solve
from .kinematics.robot_inverse_kinematics import FAULTS as ROBOT_FAULTS
from .kinematics.robot_inverse_kinematics import TASK as ROBOTS
from .kinematics.robot_solver import solve_by_reference, solve_wrongly
from .mass_spring.faults import FORCE_FAULTS, STEP_FAULTS, Option, apply
from .mass_spring.model import Integrator, Model, simulate
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
FAMILIES = {"forward": "forward kinematics", "ccd": "CCD", "fabrik": "FABRIK"}
EVERYTHING = System(external_forces=True, tension_only=True)


class Subject(NamedTuple):
    """A solver of which is known what is wrong with it.

    Attributes:
        name: what it is.
        family: what it is one of: "CCD", "steps", "honest solvers".
        task: what it solves.
        function: the solver.
        greeting: what it says of itself.
        fault: the key of what is wrong; "" if nothing is.
    """

    name: str
    family: str
    task: str
    function: Callable[..., Any]
    greeting: Greeting
    fault: str = ""


class Trial(NamedTuple):
    """What the judge said of a subject.

    Attributes:
        laws: those that were broken.
        named: whether the first explanation names the fault, or a class of faults that it is in
            and that no answer tells apart; for an honest one, whether nothing is named.
    """

    subject: Subject
    verdict: Verdict
    laws: frozenset[str]
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
    yield from _kinematic_faults()
    yield from _mass_spring_faults()
    yield from _robot_faults()
    yield from _right_kinematics()
    yield from _right_robots()
    yield from _right_steps()


def _kinematic_faults() -> Iterator[Subject]:
    for kind, task, method in (
        ("forward", "forward_kinematics", ""),
        ("ccd", "inverse_kinematics", "ccd"),
        ("fabrik", "inverse_kinematics", "fabrik"),
    ):
        greeting = Greeting(PROTOCOL, (task,), methods=(method,))
        for fault in FAULTS[kind]:
            if not fault.honest:
                function = partial(_textbook, method, switches([fault]))
                yield Subject(fault.key, FAMILIES[kind], task, function, greeting, fault.key)


def _robot_faults() -> Iterator[Subject]:
    greeting = Greeting(PROTOCOL, (ROBOTS,))
    for key, fault in ROBOT_FAULTS.items():
        yield Subject(key, "robots", ROBOTS, partial(solve_wrongly, fault), greeting, key)


def _right_robots() -> Iterator[Subject]:
    greeting = Greeting(PROTOCOL, (ROBOTS,))
    for name, function in (
        ("damped least squares, robots", partial(solve_wrongly, None)),
        ("reference, robots", solve_by_reference),
    ):
        yield Subject(name, HONEST, ROBOTS, function, greeting)


def _textbook(method: str, switched: Switches, /, **inputs: Any) -> Mapping[str, Any]:
    if not method:
        return predict_forward(switched, Case("", "", inputs, "", _NOTHING))
    local, positions, _ = solve(method, inputs, switched)
    return {"local_rotations": local, "positions": positions}


def _followed(method: str, /, **inputs: Any) -> Mapping[str, Any]:
    return predict_track(method, switches([]), Case("", "", inputs, "", _NOTHING))


# Models of the step, and how they declare themselves.
LINEARISED = Model(Integrator("newton", "x_n", 1), damper="explicit")
CONVERGED = Model(Integrator("converged", "y"))
LOCAL_GLOBAL = Model(Integrator("local_global", "y", 10))
SYMPLECTIC = Model(Integrator("symplectic"), 10, "explicit", velocity="separate")


def _declared(model: Model, method: Method, iterations: int | None = None) -> Step:
    said: Any = {"start": model.integrator.start, "damper": model.damper}
    if method == "symplectic":
        del said["start"]
    return Step(
        method,
        iterations=iterations,
        substeps=model.substeps,
        pins="eliminated",
        velocity="separate" if model.velocity == "separate" else "displacement",
        **said,
    )


DECLARED: dict[str, tuple[Model, Step]] = {
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
        self, model: Model, faults: Sequence[Option] = (), precision: type = np.float64
    ) -> None:
        self.model, self.faults, self.precision = model, tuple(faults), precision
        self.first_h: dict[tuple[bytes, bytes], float] = {}
        self.__signature__ = inspect.Signature(
            [inspect.Parameter("inputs", inspect.Parameter.VAR_KEYWORD)]
        )

    def __call__(self, **inputs: Any) -> dict[str, Any]:
        """Return positions and velocities, rounded to the precision."""
        rounded = {name: self._rounded(value) for name, value in inputs.items()}
        system = inputs["masses"].tobytes(), inputs["stiffnesses"].tobytes()
        p = problem_of(rounded, self.first_h.setdefault(system, inputs["h"]))
        p, model = apply(self.faults, p, self.model)
        with np.errstate(all="ignore"):
            found = simulate(p, model)
        return {name: self._rounded(value) for name, value in found.items()}

    def _rounded(self, value: Any) -> Any:
        if isinstance(value, np.ndarray) and value.dtype.kind == "f":
            return value.astype(self.precision).astype(float)
        return value


def _mass_spring_faults() -> Iterator[Subject]:
    greeting = Greeting(PROTOCOL, ("mass_spring_forces",), system=EVERYTHING)
    for option in _once(FORCE_FAULTS):
        if option.key in NO_FORCES:
            continue
        function = partial(_evaluated, option)
        yield Subject(option.key, "forces", greeting.tasks[0], function, greeting, option.key)
    for option in _once(STEP_FAULTS):
        model, step = DECLARED[_BASES.get(option.key, "linearised")]
        greeting = Greeting(PROTOCOL, ("mass_spring_step",), system=EVERYTHING, step=step)
        stepper = Stepper(model, [option])
        yield Subject(option.key, "steps", greeting.tasks[0], stepper, greeting, option.key)


def _once(options: Sequence[Option]) -> list[Option]:
    return list({option.key: option for option in reversed(options)}.values())[::-1]


def _evaluated(option: Option, /, **inputs: Any) -> Mapping[str, Any]:
    p, _ = apply((option,), problem_of(inputs), CONVERGED)
    return {"forces": all_forces(p)}


def _right_kinematics() -> Iterator[Subject]:
    task = "forward_kinematics"
    for precision in ("double", "single"):
        greeting = Greeting(PROTOCOL, (task,), precision=precision)
        yield Subject(
            f"reference, {precision}", HONEST, task, partial(_placed, precision), greeting
        )
    for engine in SKELETON_ENGINES:
        greeting = Greeting(PROTOCOL, (task,))
        yield Subject(engine, HONEST, task, partial(_placed_by, engine), greeting)
    task = "inverse_kinematics"
    for solver in ("ccd", "fabrik", "levenberg_marquardt"):
        greeting = Greeting(PROTOCOL, (task,), methods=(solver,))
        yield Subject(f"reference, {solver}", HONEST, task, partial(_solved, solver), greeting)
    for method in ("ccd", "fabrik"):
        greeting = Greeting(PROTOCOL, ("track",), methods=(method,))
        yield Subject(f"textbook, {method}", HONEST, "track", partial(_followed, method), greeting)


def _placed(precision: Precision, parents: Any, offsets: Any, local_rotations: Any) -> Any:
    pose = forward_kinematics(Skeleton(parents, offsets), local_rotations)
    kind = PRECISIONS[precision]
    return pose.positions.astype(kind), pose.rotations.astype(kind)


def _placed_by(engine: str, parents: Any, offsets: Any, local_rotations: Any) -> Any:
    made = SKELETON_ENGINES[engine](Skeleton(parents, offsets))
    return tuple(forward_kinematics_by(made, local_rotations))


def _solved(
    solver: str, parents: Any, offsets: Any, local_rotations: Any, target: Any, effector: int,
    tolerance: float, max_iterations: int,
) -> Any:  # fmt: skip
    found = solve_ik(
        Skeleton(parents, offsets), local_rotations, target, solver, effector=effector,
        tolerance=tolerance, max_iterations=max_iterations,
    )  # fmt: skip
    return {"local_rotations": found.local_rotations, "positions": found.positions}


# Steps of the reference and of MuJoCo, and what they declare to be. The reference's damper is
# part of the energy, MuJoCo's discrete step likewise; see docs/verify.md.
_REFERENCE: dict[str, tuple[Callable[..., Any], Step]] = {
    "implicit Euler by Newton": (
        lambda s, state, h: ImplicitEuler(s, h=h, solver="newton", tolerance=0.0).step(state).state,
        Step("converged", damper="length_rate"),
    ),
    "ten local/global iterations": (
        lambda s, state, h: ImplicitEuler(
            s, h=h, solver="local_global", tolerance=0.0, max_iterations=10
        ).step(state).state,
        Step("local_global", "y", 10, damper="length_rate"),
    ),
    "symplectic Euler": (
        symplectic_euler, Step("symplectic", damper="explicit", velocity="separate"),
    ),
    "MuJoCo Euler": (
        lambda s, state, h: MujocoMassSpring(s, h=h, integrator="Euler").step(state),
        Step("symplectic"),
    ),
    "MuJoCo discrete": (
        lambda s, state, h: MujocoMassSpring(s, h=h, integrator="discrete").step(state),
        Step("linearised"),
    ),
}  # fmt: skip


def _right_steps() -> Iterator[Subject]:
    task = "mass_spring_step"
    silent = Greeting(PROTOCOL, (task,))
    for name, (model, step) in DECLARED.items():
        for precision, kind in PRECISIONS.items():
            declared = Greeting(PROTOCOL, (task,), step=step, precision=precision)
            yield Subject(f"{name}, {precision}", HONEST, task, Stepper(model, (), kind), declared)
        yield Subject(f"{name}, undeclared", HONEST, task, Stepper(model), silent)
    for pins, said in PINS.items():
        greeting = Greeting(PROTOCOL, (task,), step=Step(pins=said))
        stepper = Stepper(LINEARISED._replace(pins=pins))
        yield Subject(f"linearised, pins {pins}", HONEST, task, stepper, greeting)
    for name, (function, step) in _REFERENCE.items():
        greeting = Greeting(PROTOCOL, (task,), step=step)
        yield Subject(name, HONEST, task, partial(_stepped, function), greeting)


def _stepped(function: Callable[..., Any], /, **inputs: Any) -> dict[str, Any]:
    p = problem_of(inputs)
    state = function(system_of(p), state_of(p), p.h)
    return {"positions": state.positions, "velocities": state.velocities}
