"""Honest solvers: models of the step with their declarations, and solvers of the reference."""

from functools import partial

import numpy as np

from plumbob.reference import Outcome, Skeleton, forward_kinematics, solve_ik
from plumbob.reference.explicit import symplectic_euler
from plumbob.reference.formats import urdf
from plumbob.reference.implicit_euler import ImplicitEuler
from plumbob.reference.skeleton import Pose
from plumbob.verify.functions import FunctionConnection
from plumbob.verify.greeting import PROTOCOL, Greeting, Step
from plumbob.verify.kinematics.limits import solve_within
from plumbob.verify.kinematics.robot_models import target_of
from plumbob.verify.kinematics.robot_motions import followed
from plumbob.verify.mass_spring.model import Integrator, StepModel, simulate
from plumbob.verify.mass_spring.problem import problem_of, state_of, system_of
from plumbob.verify.self_test import HONEST, Subject

FK, IK, STEP = "forward_kinematics", "inverse_kinematics", "mass_spring_step"
PRECISIONS = {"double": np.float64, "single": np.float32}
LINEARISED = StepModel(Integrator("newton", "x_n", 1), damper="explicit")
CONVERGED = StepModel(Integrator("converged", "y"))


def declared(model, method, iterations=None):
    velocity = "separate" if model.velocity == "separate" else "displacement"
    start = {"start": model.integrator.start} if method != "symplectic" else {}
    return Step(method, pins="eliminated", velocity=velocity, damper=model.damper,
                substeps=model.substeps, iterations=iterations, **start)  # fmt: skip


# Models of the step, their methods and iterations.
MODELS = {
    "linearised": (LINEARISED, "linearised", 1),
    "linearised, implicit damping": (LINEARISED._replace(damper="end_velocity"), "linearised", 1),
    "converged": (CONVERGED, "converged"),
    "local/global": (StepModel(Integrator("local_global", "y", 10)), "local_global", 10),
    "symplectic": (
        StepModel(Integrator("symplectic"), 10, "explicit", velocity="separate"), "symplectic",
    ),
}  # fmt: skip
DECLARED = {name: (entry[0], declared(*entry)) for name, entry in MODELS.items()}


class Stepper:
    """A step of a model, computed in double precision and rounded to another."""

    def __init__(self, model, precision=np.float64):
        self.model, self.precision = model, precision

    def __call__(self, **inputs):
        with np.errstate(all="ignore"):
            return self._rounded(simulate(problem_of(self._rounded(inputs)), self.model))

    def _rounded(self, values):
        return {
            name: value.astype(self.precision).astype(float)
            if isinstance(value, np.ndarray) and value.dtype.kind == "f"
            else value
            for name, value in values.items()
        }


def stepped(function, /, **inputs):
    """Answer a request by a function of system, state and h."""
    p = problem_of(inputs)
    state = function(system_of(p), state_of(p), p.h)
    return {"positions": state.positions, "velocities": state.velocities}


def implicit(solver, **settings):
    """A step of the reference, whose damper is part of the energy, see docs/verify.md."""
    return lambda system, state, h: ImplicitEuler(
        system, h=h, solver=solver, tolerance=0.0, **settings).step(state).state  # fmt: skip


def placed(kind, /, parents, offsets, local_rotations):
    pose = forward_kinematics(Skeleton(parents, offsets), local_rotations)
    return pose.positions.astype(kind), pose.rotations.astype(kind)


def solved(solver, /, parents, offsets, method, **inputs):
    if "cones" in inputs:
        request = inputs | {"parents": parents, "offsets": offsets}
        return {"local_rotations": solve_within(solver, request)}
    solution = solve_ik(Skeleton(parents, offsets), solver=solver, **inputs)
    return {"local_rotations": solution.local_rotations, "positions": solution.positions}


def solve_by_reference(solver, /, **inputs):
    """Return the result of a solver of the reference on the request's URDF."""
    robot = urdf.parse(inputs["urdf"]).articulation
    links = [robot.names.index(f"link_{joint}") for joint in range(len(inputs["start"]))]
    coordinates = [robot.coordinates_of(link).start for link in links]
    start = np.empty(robot.coordinate_count)
    start[coordinates] = inputs["start"]
    target = target_of(inputs)._replace(effector="tool")
    options = {name: inputs[name] for name in ("tolerance", "tolerance_rotation", "max_iterations")}
    solution = solve_ik(robot, start, target, solver, restarts=0, **options)
    converged = bool(solution.outcome == Outcome.CONVERGED)
    return {"q": solution.coordinates[coordinates], "converged": converged}


def tracked(**inputs):
    tool = Pose(inputs["target_positions"], inputs["target_rotations"])
    return {"q": followed(inputs, inputs["start"], tool)}


def subject(name, task, function, **fields):
    connection = FunctionConnection({task: function}, Greeting(PROTOCOL, (task,), **fields))
    return Subject(name, HONEST, task, connection)


def honest_solvers():
    """Yield the solvers of the reference, and models of the step in both precisions."""
    for precision, kind in PRECISIONS.items():
        yield subject(f"reference, {precision}", FK, partial(placed, kind), precision=precision)
    for method in ("ccd", "fabrik", "levenberg_marquardt"):
        yield subject(f"reference, {method}", IK, partial(solved, method), methods=(method,))
    for method in ("ccd", "fabrik"):
        yield subject(f"reference, {method}, limits", IK, partial(solved, method),
                      methods=(method,), limits=True)  # fmt: skip
    for method in ("levenberg_marquardt", "damped_least_squares"):
        function = partial(solve_by_reference, method)
        yield subject(f"reference, {method}, robots", "robot_inverse_kinematics", function)
    yield subject("reference, tracking", "robot_track", tracked)
    for name, (model, step) in DECLARED.items():
        for precision, kind in PRECISIONS.items():
            stepper = Stepper(model, kind)
            yield subject(f"{name}, {precision}", STEP, stepper, step=step, precision=precision)
        yield subject(f"{name}, undeclared", STEP, Stepper(model))
    for pins in ("overwritten", "penalty 1e10", "heavy 1e8"):
        stepper = Stepper(LINEARISED._replace(pins=pins))
        yield subject(f"linearised, pins {pins}", STEP, stepper, step=Step(pins=pins.split()[0]))
    for name, function, step in (
        ("Newton", implicit("newton"), Step("converged", damper="length_rate")),
        ("local/global", implicit("local_global", max_iterations=10),
         Step("local_global", "y", 10, damper="length_rate")),
        ("symplectic", symplectic_euler,
         Step("symplectic", damper="explicit", velocity="separate")),
    ):  # fmt: skip
        yield subject(f"reference, {name}", STEP, partial(stepped, function), step=step)
