"""Every public function of the reference with a call that is right, for the laws of its borders."""

import functools
import inspect
import itertools
import tempfile
from collections.abc import Callable
from enum import Enum
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import scipy

from plumbob import reference
from plumbob.crosscheck import samples, verdict
from plumbob.crosscheck.tolerances import POSITION
from plumbob.reference import (
    Articulation,
    ImplicitEuler,
    MassSpring,
    Mimic,
    Skeleton,
    State,
    Target,
    articulation,
    curve,
    explicit,
    formats,
    implicit_euler,
    inverse_kinematics,
    kinematics,
    mass_spring,
    rotation,
    scenes,
    skeleton,
    tracking,
    wind,
)
from plumbob.reference import jacobians as differential
from plumbob.reference import sparse as cholesky
from plumbob.reference.backend import compiled
from plumbob.reference.backend import threads as parallel
from plumbob.reference.formats import bvh, mjcf, obj, urdf
from plumbob.reference.implicit_euler import certificate, objective
from plumbob.reference.sparse import linear_solver

# The modules that a user meets, the package itself first.
MODULES = [
    reference, rotation, curve, skeleton, articulation, kinematics, differential,
    inverse_kinematics, tracking, mass_spring, explicit, wind, implicit_euler, objective,
    certificate, scenes, formats, bvh, mjcf, obj, urdf, linear_solver, cholesky, compiled, parallel,
    samples, verdict,
]  # fmt: skip

# What stands in these modules for other modules of ours, and why no user calls it.
INTERNAL = {
    "reference.articulation.one_batch": "reshapes what is checked already",
    "reference.articulation.rotated_by_pi": "of joints that are checked already",
    "reference.articulation.number_coordinates": "of joints that are checked already",
    "reference.mass_spring.MassSpring.replaced": "unchecked twin of the constructor",
    "reference.mass_spring.State.of": "unchecked twin of the constructor",
    "reference.rotation.check_unit": "of lengths that the caller has computed",
    "reference.skeleton.checked_skeleton": "is a border itself",
    "reference.skeleton.Skeleton.path_array": "of an index that is checked already",
    "reference.articulation.Articulation.checked": "is a border itself",
    "reference.mass_spring.checked_state": "is a border itself",
    "reference.mass_spring.pin_targets": "is a border itself",
    "reference.mass_spring.constant_forces": "is a border itself",
    "reference.implicit_euler.objective.Objective.iterate_at": "unchecked twin of evaluate",
    "reference.implicit_euler.objective.Objective.hessian_at": "unchecked twin of hessian",
    "reference.implicit_euler.objective.Objective.pin_gradient_at": "unchecked twin",
    "reference.implicit_euler.objective.Iterate": "made only by an Objective",
    "crosscheck.verdict.each_case": "of a comparison in our own sources",
    "reference.implicit_euler.objective.Iterate.within": "of a share in our own sources",
    "reference.judging.step.StepJudgement": "made only by judge_step",
    "reference.judging.pose.PoseJudgement": "made only by judge_pose",
    "reference.implicit_euler.objective.Iterate.is_above": "compares what an Objective has made",
    "reference.implicit_euler.objective.global_matrix": "of a system that is checked already",
    "reference.implicit_euler.objective.effective_stiffnesses": "likewise",
    "reference.implicit_euler.StepMethod.iterates": "a protocol",
    "reference.implicit_euler.StepResult": "made only by a step",
    "reference.implicit_euler.certificate.Certificate": "made only by certify",
    "reference.implicit_euler.certificate.Certificate.shares_minimiser_within": "unchecked twin",
    "reference.implicit_euler.certificate.kantorovich_distance": "a part of the proof",
    "reference.implicit_euler.certificate.least_curvature": "a part of the proof",
    "reference.implicit_euler.certificate.newton_length": "a part of the proof",
    "reference.implicit_euler.certificate.hessian_change": "a part of the proof",
    "reference.implicit_euler.certificate.laplacian_norm": "a part of the proof",
    "reference.implicit_euler.certificate.rounding_errors": "a part of the proof",
    "reference.sparse.linear_solver.Factor.solve": "a protocol",
    "reference.sparse.linear_solver.Factor.refactorize": "a protocol",
    "reference.backend.compiled.Kernel": "for kernels",
    "reference.backend.compiled.compile_kernel": "for kernels",
    "reference.backend.compiled.bind": "for kernels",
    "reference.backend.compiled.compiled_in": "for kernels",
    "reference.backend.threads.in_slices": "for kernels",
    "crosscheck.verdict.ClaimVerdict": "made only by check_claim",
    "crosscheck.verdict.Claim": "made by claims",
    "crosscheck.samples.generator": "of names in the sources",
    "crosscheck.samples.particles": "of a case that is checked already",
}


class Call(NamedTuple):
    """A call that is right, and what may be changed about it.

    Attributes:
        function: what is called, with its arguments by name.
        arguments: all of them.
        free: those whose leading axes may have any length, or be none.
        single: those of which one value may serve all.
        infinite: those that may be infinite.
        passed_on: those whose NaN and infinity show in the answer: right-hand sides.
        names: what an error may name besides the arguments.
        raises: documented errors besides ValueError.
    """

    function: Callable[..., Any]
    arguments: dict[str, Any]
    free: str = ""
    single: str = ""
    infinite: str = ""
    passed_on: str = ""
    names: str = ""
    raises: tuple[type[Exception], ...] = ()


def public_names(modules=None):
    """Yield the name of each public function, class and method once, and the thing itself.

    Kernels have no annotations.
    """
    seen = set()
    for module in modules or MODULES:
        for name in getattr(module, "__all__", [n for n in vars(module) if n[0] != "_"]):
            thing = getattr(module, name)
            home = (getattr(thing, "__module__", None) or "").removeprefix("plumbob.")
            if not home.startswith(("reference", "crosscheck")):
                continue
            if not hasattr(module, "__all__") and f"plumbob.{home}" != module.__name__:
                continue
            for path, part in _parts(f"{home}.{name}", thing):
                if path not in seen:
                    seen.add(path)
                    yield path, part


def _parts(path, thing):
    if inspect.isfunction(thing) and (thing.__annotations__ or not thing.__code__.co_argcount):
        yield path, thing
    if inspect.isclass(thing) and not issubclass(thing, Enum | Exception):
        if "__init__" in vars(thing) and not getattr(thing, "_is_protocol", False):
            yield path, thing
        for name, member in vars(thing).items():
            method = getattr(member, "__func__", member)
            if name[0] != "_" and inspect.isfunction(method):
                yield f"{path}.{name}", method


@functools.cache
def calls():
    """Return the valid calls by the names of the functions; what follows a comma is a variant."""
    table = {}
    for part in (
        _rotations(), _curves(), _skeletons(), _articulations(), _derivatives(), _solves(),
        _systems(), _steps(), _scenes(), _files(), _matrices(), _settings(), _samples(),
        _trees_of_numbers(), _systems_of_numbers(),
    ):  # fmt: skip
        assert not table.keys() & part.keys()
        table |= part
    return table


RNG = functools.partial(np.random.default_rng, 9)


def tree():
    """Return six joints, two of them siblings."""
    offsets = RNG().uniform(-0.5, 0.5, (6, 3))
    return Skeleton([-1, 0, 1, 1, 3, 4], offsets, ["a", "b", "c", "d", "e", "f"])


def robot():
    """Return a joint of each kind, with limits and one that follows another."""
    kinds = ["fixed", "hinge", "slide", "ball", "hinge", "free"]
    return Articulation(tree(), kinds, [1.0, 0.0, 0.0], lower=-1.0, upper=1.5, cones=2.0,
                        mimics={4: Mimic(1, 0.5, 0.1)})  # fmt: skip


def system():
    """Return five particles, one of them pinned, and how they move."""
    springs = [[0, 1], [1, 2], [2, 3], [3, 4], [0, 2], [1, 3], [2, 4]]
    x = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 1], [2, 1, 1]], float)
    model = MassSpring([1.0, 2.0, 1.0, 1.5, 1.0], springs, 0.9, 50.0, 0.5, [0],
                       tension_only=[True, *[False] * 6])  # fmt: skip
    return model, State(x, RNG().uniform(-1.0, 1.0, (5, 3)))


def _rotations():
    q, p = rotation.random(RNG(), 6), rotation.random(np.random.default_rng(1), 6)
    v, w = RNG().uniform(-1.0, 1.0, (2, 6, 3))
    r = "reference.rotation."
    table = {
        "identity": Call(lambda shape: rotation.identity(2, shape), {"shape": 3}),
        "random": Call(lambda rng, shape: rotation.random(rng, 2, shape),
                       {"rng": np.random.default_rng(0), "shape": 3}),
        "unit": Call(lambda q: rotation.unit("q", q), {"q": q}, free="q"),
        "multiply": Call(rotation.multiply, {"a": q, "b": p}, free="a b"),
        "conjugate": Call(rotation.conjugate, {"q": q}, free="q"),
        "rotate": Call(rotation.rotate, {"q": q, "v": v}, free="q v"),
        "between": Call(rotation.between, {"a": v, "b": w}, free="a b"),
        "exponential": Call(rotation.exponential, {"v": v}, free="v"),
        "logarithm": Call(rotation.logarithm, {"q": q}, free="q"),
        "angle": Call(rotation.angle, {"a": q, "b": p}, free="a b"),
        "to_matrix": Call(rotation.to_matrix, {"q": q}, free="q"),
        "from_matrix": Call(rotation.from_matrix, {"matrix": rotation.to_matrix(q)}, free="matrix"),
    }  # fmt: skip
    table["normalise"] = Call(rotation.normalise, {"quaternions": q}, free="quaternions")
    return {r + name: call for name, call in table.items()}


def _curves():
    c = "reference.curve."
    table = {
        c + name: Call(getattr(curve, name), {"count": 12})
        for name in ("circle", "square", "heart", "triangle", "star", "plumb_bob")
    }
    spacing = {"min_spacing": 0.01, "max_spacing": 0.05, "closed": True}
    return table | {
        c + "resample": Call(curve.resample, {"curve": curve.circle(30), **spacing}, free="curve")
    }


def _skeletons():
    model, local = tree(), rotation.random(RNG(), 5, 6)
    turned = kinematics.forward_kinematics(model, local).rotations
    s, k = "reference.skeleton.Skeleton", "reference.kinematics."
    built = {"parents": model.parents, "offsets": model.offsets, "names": list("uvwxyz")}
    return {
        s: Call(Skeleton, built),
        s + ".index": Call(model.index, {"joint": "b", "argument": "joint"}),
        s + ".path": Call(model.path, {"effector": 2}),
        s + ".reach": Call(model.reach, {"effector": "f"}),
        k + "forward_kinematics": Call(
            reference.forward_kinematics,
            {"skeleton": model, "local_rotations": local}, free="local_rotations", names="q",
        ),
        k + "local_from_global": Call(
            reference.local_from_global,
            {"skeleton": model, "rotations": turned}, free="rotations",
        ),
        k + "forward_kinematics, one": Call(
            reference.forward_kinematics,
            {"skeleton": model, "local_rotations": local[0]}, free="local_rotations", names="q",
        ),
        k + "forward_kinematics, robot": Call(
            reference.forward_kinematics,
            {"skeleton": robot(), "local_rotations": robot().random(RNG(), 5)},
            free="local_rotations", names="q",
        ),
    }  # fmt: skip


def _articulations():
    model, a = robot(), "reference.articulation.Articulation"
    q = model.random(RNG(), 5)
    built = {
        "skeleton": tree(), "kinds": list(model.kinds), "axes": np.array(model.axes),
        "frames": rotation.random(RNG(), 6), "lower": np.full(6, -1.0), "upper": np.full(6, 1.5),
        "cones": np.full(6, 2.0), "mimics": {4: Mimic(1, 0.5, 0.1)},
    }  # fmt: skip

    def mimics(leader, multiplier, shift):
        mimics = {2: Mimic(1, 0.5), 4: Mimic(leader, multiplier, shift)}
        return Articulation(tree(), list(model.kinds), mimics=mimics)

    def chain(multiplier, shift):
        joints = Skeleton(np.arange(9) - 1, np.ones((9, 3)))
        mimics = {j: Mimic(j - 1, multiplier, shift) for j in range(1, 9)}
        return Articulation(joints, "slide", mimics=mimics)

    table = {
        a: Call(Articulation, built, infinite="lower upper cones",
                single="axes frames lower upper cones"),
        a + ", mimics": Call(mimics, {"leader": 1, "multiplier": 2.0, "shift": 0.5},
                             names="mimics"),
        a + ", chain of mimics": Call(chain, {"multiplier": 2.0, "shift": 0.5}, names="mimics"),
        a + ".index": Call(model.index, {"joint": "b", "argument": "joint"}),
        a + ".coordinates_of": Call(model.coordinates_of, {"joint": 3}),
        a + ".freedoms_of": Call(model.freedoms_of, {"joint": 3}),
        a + ".neutral": Call(model.neutral, {}),
        a + ".zero": Call(model.zero, {}),
        a + ".random": Call(lambda rng, shape: model.random(rng, 2, shape),
                            {"rng": np.random.default_rng(0), "shape": 3}),
        a + ".within_limits": Call(model.within_limits, {"q": q, "tolerance": 1e-9}, free="q"),
    }  # fmt: skip
    for name in ("clamp", "local_transforms", "forward"):
        table[f"{a}.{name}"] = Call(getattr(model, name), {"q": q}, free="q")
    return table


def _derivatives():
    model, balls, d = robot(), tree(), "reference.jacobians."
    q, q0 = model.random(RNG(), 2, 5)
    v = RNG().uniform(-1.0, 1.0, (5, model.freedom_count))
    local = rotation.random(RNG(), 5, 6)
    given = {"articulation": model, "q": q}
    return {
        d + "jacobian": Call(differential.jacobian, {**given, "effector": "f"}, free="q"),
        d + "jacobian, balls": Call(
            differential.jacobian, {"articulation": balls, "q": local, "effector": -1}, free="q"
        ),
        d + "jacobians": Call(differential.jacobians, {**given, "joints": [2, 0]}, free="q"),
        d + "integrate": Call(differential.integrate, {**given, "v": v}, free="q v"),
        d + "difference": Call(
            differential.difference, {"articulation": model, "q1": q, "q0": q0}, free="q1 q0"
        ),
    }


def _solves():
    model, balls = robot(), tree()
    local, q = rotation.random(RNG(), 6), model.random(RNG())
    points = RNG().uniform(-0.5, 0.5, (4, 3))
    rotations = rotation.random(RNG(), 4)
    numbers = {"tolerance": 1e-4, "tolerance_rotation": 1e-4, "max_iterations": 4}
    settings = {"solver": "ccd", "effector": "f", **numbers}
    drawn = {"restarts": 1, "seed": 3, "record": True}
    i, t = "reference.inverse_kinematics.solve_ik", "reference.tracking.track"
    j = "reference.judging.pose.judge_pose"

    def posed(position, rotation, effector, weight):
        target = Target(position, rotation, effector, weight), Target([0.1, 0.2, 0.3], None, "c")
        return reference.solve_ik(model, q, target, "levenberg_marquardt", max_iterations=4)

    def one_pose(position, rotation, effector, weight):
        target = Target(position, rotation, effector, weight)
        return reference.solve_ik(model, q, target, "levenberg_marquardt", max_iterations=4)

    def follow(position, rotation, weight):
        target = Target(position, rotation, "f", weight)
        return reference.track(model, [target], "levenberg_marquardt", q, max_iterations=4)

    target = {"position": points[0], "rotation": rotations[0], "effector": "f", "weight": 2.0}
    targets = {"position": points, "rotation": rotations, "weight": 2.0}
    table = {
        i: Call(reference.solve_ik,
                {"skeleton": balls, "local_rotations": local, "target": points[0], **settings,
                 "restarts": 0, "seed": 3, "record": False},
                free="local_rotations target", names="q effector"),
        i + ", batch": Call(reference.solve_ik,
                            {"skeleton": balls, "local_rotations": np.tile(local, (4, 1, 1)),
                             "target": points, **settings, **drawn},
                            free="local_rotations target", names="q effector"),
        i + ", robot": Call(reference.solve_ik,
                            {"skeleton": model, "local_rotations": q, "target": points, **settings,
                             **drawn},
                            free="local_rotations target", names="q effector"),
        i + ", poses": Call(posed, target, free="position rotation", names="target"),
        i + ", pose": Call(one_pose, target, free="position rotation", names="target"),
        t: Call(reference.track,
                {"skeleton": balls, "curve": points, "start": local, **settings, "warm": True,
                 "coherent": True, "closed": True, "record": True},
                free="curve", names="q effector", raises=(FloatingPointError,)),
        t + ", poses": Call(follow, targets, free="position rotation",
                            names="target curve"),
    }  # fmt: skip
    place = reference.forward_kinematics(balls, local).positions
    judged = {"target": points[0], "effector": "f", "tolerance": 1e-4, "tolerance_rotation": 1e-4}
    table |= {
        j: Call(reference.judge_pose,
                {"model": balls, "pose": local, "positions": place, **judged},
                names="local_rotations q"),
        j + ", robot": Call(reference.judge_pose, {"model": model, "pose": q, **judged},
                             names="q local_rotations"),
    }  # fmt: skip
    for solver in inverse_kinematics.IK_SOLVERS:
        table[f"{i}, {solver}"] = Call(
            reference.solve_ik,
            {"skeleton": balls, "local_rotations": local, "target": points[0], "solver": solver,
             "max_iterations": 4}, free="local_rotations target", names="q effector",
        )  # fmt: skip
    return table


def _systems():
    model, state = system()
    x, m = state.positions, "reference.mass_spring."
    outer = RNG().uniform(-1.0, 1.0, (5, 3))
    per_spring = {
        "rest_lengths": np.full(7, 0.9), "stiffnesses": np.full(7, 50.0),
        "dampings": np.full(7, 0.5), "tension_only": np.zeros(7, bool),
    }  # fmt: skip
    built = {
        "masses": np.array(model.masses), "springs": np.array(model.springs), **per_spring,
        "pinned": np.array([0, 2]), "gravity": np.array([0.0, -9.81, 1.0]),
    }  # fmt: skip
    table = {
        "MassSpring": Call(MassSpring, built, single=" ".join(per_spring), free="masses pinned"),
        "State": Call(State, {"positions": x, "velocities": outer}),
        "spring_blocks": Call(
            mass_spring.spring_blocks, {"system": model, "positions": x, "geometric": False}
        ),
        "derivation": Call(mass_spring.derivation, {"system": model}),
        "incidence": Call(mass_spring.incidence, {"system": model}),
        "kinetic_energy": Call(mass_spring.kinetic_energy, {"system": model, "state": state}),
        "damper_forces": Call(mass_spring.damper_forces, {"system": model, "state": state}),
        "forces": Call(mass_spring.forces,
                       {"system": model, "state": state, "external_forces": outer}),
    }  # fmt: skip
    for name in ("rest_vectors", "lengths", "stretches", "potential_energy", "spring_energy",
                 "spring_forces", "stiffness_matrix", "damping_matrix"):  # fmt: skip
        table[name] = Call(getattr(mass_spring, name), {"system": model, "positions": x})
    moved = {"state": state, "triangles": np.array([[0, 1, 2], [2, 3, 4]]), "wind": outer,
             "density": 1.2, "drag": 1.0, "lift": 0.5}  # fmt: skip
    blown = Call(reference.wind_forces, moved, single="wind", free="triangles",
                 raises=(FloatingPointError,))  # fmt: skip
    return {m + name: call for name, call in table.items()} | {"reference.wind.wind_forces": blown}


def _steps():
    model, state = system()
    x = state.positions
    outer, pins = RNG().uniform(-1.0, 1.0, (5, 3)), np.array([[0.1, 0.0, 0.0]])
    moved = {"state": state, "external_forces": outer, "pin_positions": pins}
    explicit_step = {"system": model, **moved, "h": 0.01}
    euler = ImplicitEuler(model, h=0.01, max_iterations=5)
    g = euler.objective(state)
    result = euler.step(state)
    proof = euler.certify(state, result)
    o, e = (
        "reference.implicit_euler.objective.Objective",
        "reference.implicit_euler.ImplicitEuler",
    )

    def iterates(state, external_forces, pin_positions):
        return list(itertools.islice(euler.iterates(state, external_forces, pin_positions), 2))

    table = {
        f"reference.explicit.{name}": Call(getattr(reference, name), explicit_step,
                                           raises=(FloatingPointError,))
        for name in ("symplectic_euler", "runge_kutta")
    }  # fmt: skip
    table |= {
        f"{o}.{name}": Call(getattr(g, name), {"positions": x})
        for name in ("evaluate", "value", "gradient", "rest_vectors")
    }
    return table | {
        e: Call(ImplicitEuler, {"system": model, "h": 0.01, "solver": "newton",
                                "tolerance": 1e-10, "max_iterations": 5}),
        e + ".step": Call(euler.step, moved),
        e + ".objective": Call(euler.objective, moved),
        e + ".certify": Call(euler.certify, {**moved, "result": result}, names="positions"),
        e + ".iterates": Call(iterates, moved),
        o: Call(objective.Objective, {"system": model, **moved, "h": 0.01, "start": "x_n"}),
        "reference.judging.step.judge_step": Call(
            reference.judge_step,
            {"system": model, **moved, "h": 0.01, "positions": x, "velocities": outer},
        ),
        o + ".residual": Call(g.residual, {"iterate": g.start}),
        o + ".hessian": Call(g.hessian, {"positions": x, "geometric": True}),
        o + ".quadratic_form": Call(g.quadratic_form, {"positions": x, "d": g.rest_vectors(x)}),
        "reference.implicit_euler.certificate.certify": Call(
            certificate.certify, {"objective": g, "positions": x}),
        "reference.implicit_euler.certificate.Certificate.shares_minimiser": Call(
            proof.shares_minimiser, {"other": proof, "apart": 0.1}),
    }  # fmt: skip


def _scenes():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.5]], float)
    elastic = {"stiffness": 100.0, "damping": 0.1, "gravity": 9.81}
    grid = {"rows": 3, "columns": 4, "spacing": 0.2, "height": 1.5, "mass": 1.0, **elastic}
    mesh = {"vertices": vertices, "triangles": np.array([[0, 1, 2], [0, 2, 3]]), **elastic,
            "bending_stiffness": 1.0, "tension_only": True, "pinned": np.array([0, 1])}  # fmt: skip
    s = "reference.scenes."
    return {
        s + "grids.lab_cloth": Call(
            scenes.lab_cloth, {"size": 3, "side": 2.0, "height": 1.5, "mass": 1.0, **elastic},
            names="spacing positions"),
        s + "grids.grid_cloth": Call(
            scenes.grid_cloth, {**grid, "shear_stiffness": 10.0, "bending_stiffness": 5.0,
                                "tension_only": False, "pinned": np.array([0, 3])},
            free="pinned", names="positions"),
        s + "grids.grid_triangles": Call(scenes.grid_triangles, {"rows": 3, "columns": 4}),
        s + "grids.net": Call(scenes.net, grid, names="positions"),
        s + "grids.lattice": Call(
            scenes.lattice, {"counts": (3, 2, 2), "spacing": 0.1, "mass": 0.1, **elastic},
            names="positions"),
        s + "grids.hanging_rope": Call(
            scenes.hanging_rope,
            {"particles": 4, "length": 1.0, "mass": 0.1, **elastic, "tension_only": True}),
        s + "meshes.cloth_from_mesh": Call(
            scenes.cloth_from_mesh, {**mesh, "density": 0.3}, free="triangles pinned",
            names="mass masses"),
        s + "meshes.cloth_from_mesh, mass": Call(
            scenes.cloth_from_mesh, {**mesh, "mass": 0.3}, free="vertices triangles pinned",
            names="density"),
        s + "networks.random_network": Call(
            scenes.random_network, {"seed": 3, "particles": 6, "pinned": 1, "damping": 1.0,
                                    "tension_only": 0.5}, names="dampings"),
        s + "skeletons.lab_arm": Call(scenes.lab_arm, {}),
        s + "skeletons.ball_chain": Call(scenes.ball_chain, {"links": 3, "link_length": 0.1}),
    }  # fmt: skip


def _trees_of_numbers():
    """Return calls whose arguments are the numbers of a skeleton or a robot as well."""
    tree_of = functools.partial(Skeleton, [-1, 0, 1, 1, 3, 4], names=list("abcdef"))
    kinds = ["fixed", "hinge", "slide", "ball", "hinge", "free"]

    def robot_of(offsets, axes, lower, upper, cones, multiplier, shift):
        mimics = {4: Mimic(1, multiplier, shift)}
        limits = {"lower": lower, "upper": upper, "cones": cones, "mimics": mimics}
        return Articulation(tree_of(offsets), kinds, axes, **limits)

    def of_balls(function):
        return lambda offsets, **given: function(tree_of(offsets), **given)

    def of_robot(function):
        names = inspect.signature(robot_of).parameters

        def call(**given):
            model = robot_of(**{name: given.pop(name) for name in names})
            return function(model, **given)

        return call

    def reached(model, position, rotation, weight, **settings):
        target = Target(position, rotation, "f", weight), Target([0.1, 0.2, 0.3], None, "c")
        return reference.solve_ik(model, model.neutral(), target, max_iterations=8, **settings)

    def drawn(model):
        return model.neutral(), model.random(RNG(), 3)

    balls = {"offsets": np.array(tree().offsets)}
    model, local = robot(), rotation.random(RNG(), 6)
    parts = {
        **balls,
        "axes": np.array(model.axes),
        "lower": np.full(6, -1.0),
        "upper": np.full(6, 1.5),
        "cones": np.full(6, 2.0),
        "multiplier": 0.5,
        "shift": 0.1,
    }
    q, q0 = model.random(RNG(), 2, 3)
    points, turns = RNG().uniform(-0.5, 0.5, (4, 3)), rotation.random(RNG(), 4)
    v = RNG().uniform(-1.0, 1.0, (3, model.freedom_count))
    tolerances = {"tolerance": 1e-4, "tolerance_rotation": 1e-4}
    smooth = functools.partial(
        reference.track, effector="f", coherent=True, closed=True, max_iterations=8
    )
    judged = functools.partial(reference.judge_pose, effector="f")
    posed = {"position": points[0], "rotation": turns[0], "weight": 2.0}
    place = reference.forward_kinematics(tree(), local).positions
    table = {
        "kinematics.forward_kinematics": (
            reference.forward_kinematics,
            {"local_rotations": local},
            {"local_rotations": q},
        ),
        "jacobians.jacobians": (differential.jacobians, {"q": local}, {"q": q}),
        "jacobians.integrate": (differential.integrate, None, {"q": q, "v": v}),
        "jacobians.difference": (differential.difference, None, {"q1": q, "q0": q0}),
        "tracking.track": (smooth, {"curve": points, **tolerances}, {"curve": points}),
        "judging.pose.judge_pose": (
            judged,
            {"pose": local, "target": points[0], "positions": place},
            {"pose": q[0], "target": points[0], "positions": place},
        ),
        "formats.bvh.writer.format": (bvh.format, {"local_rotations": local[None]}, None),
        "articulation.Articulation.random": (drawn, None, {}),
    }
    for solver in inverse_kinematics.IK_SOLVERS:
        solve = functools.partial(reference.solve_ik, solver=solver, max_iterations=8, restarts=1)
        given = {"local_rotations": local, "target": points[0], **tolerances}
        table[f"inverse_kinematics.solve_ik, {solver}"] = solve, given, None
        table[f"inverse_kinematics.solve_ik, {solver} poses"] = (
            functools.partial(reached, solver=solver),
            None,
            posed | tolerances,
        )
    given = {
        "names": "q local_rotations target mimics names effector parents",
        "free": "local_rotations q q0 q1 v curve target position rotation",
    }
    limited = {"single": "axes lower upper cones", "infinite": "lower upper cones"}
    made = {}
    for name, (function, of_tree, of_model) in table.items():
        key, raises = "reference." + name, (FloatingPointError,) * (function is smooth)
        if of_tree is not None:
            made[key + ", numbers"] = Call(
                of_balls(function), balls | of_tree, raises=raises, **given
            )
        if of_model is not None:
            made[key + ", robot of numbers"] = Call(
                of_robot(function), parts | of_model, raises=raises, **given, **limited
            )
    return made


def _systems_of_numbers():
    """Return calls whose arguments are the numbers of a system and its state as well."""
    model, state = system()
    parts = {
        "masses": np.array(model.masses),
        "rest_lengths": np.full(7, 0.9),
        "stiffnesses": np.full(7, 50.0),
        "dampings": np.full(7, 0.5),
        "gravity": np.array([0.0, -9.81, 1.0]),
    }
    moving = {"positions": np.array(state.positions), "velocities": np.array(state.velocities)}
    loads = {
        "external_forces": RNG().uniform(-1.0, 1.0, (5, 3)),
        "pin_positions": np.array([[0.1, 0.0, 0.0]]),
    }

    def of_system(function):
        def call(gravity, positions, velocities, **given):
            values = {name: given.pop(name) for name in parts if name != "gravity"}
            made = MassSpring(
                values.pop("masses"),
                model.springs,
                **values,
                pinned=[0],
                gravity=gravity,
                tension_only=model.tension_only,
            )
            return function(made, State(positions, velocities), **given)

        return call

    def stepped(solver):
        def call(made, state, h, tolerance, **loads):
            settings = {"h": h, "solver": solver, "tolerance": tolerance, "max_iterations": 8}
            return ImplicitEuler(made, **settings).step(state, **loads)

        return call

    def certified(made, state, h, **loads):
        return ImplicitEuler(made, h=h).certify(state, state.positions, **loads)

    def measured(made, state):
        x = state.positions
        return [
            mass_spring.potential_energy(made, x),
            mass_spring.kinetic_energy(made, state),
            mass_spring.damper_forces(made, state),
            mass_spring.stiffness_matrix(made, x),
            mass_spring.damping_matrix(made, x),
            mass_spring.rest_vectors(made, x),
            mass_spring.stretches(made, x),
            mass_spring.derivation(made),
        ]

    def judged(made, state, h, result, **loads):
        return reference.judge_step(made, state, h, result, state.velocities, **loads)

    def formed(made, state, h, **loads):
        g = ImplicitEuler(made, h=h).objective(state, **loads)
        x = state.positions
        residual = min(g.residual(g.evaluate(x)), 1e308)  # infinite where g overflows
        return [
            g.evaluate(x),
            residual,
            g.hessian(x),
            g.quadratic_form(x, g.rest_vectors(x)),
        ]

    timed = loads | {"h": 0.01}
    table = {
        "mass_spring.forces": (mass_spring.forces, {"external_forces": loads["external_forces"]}),
        "mass_spring.potential_energy": (measured, {}),
        "explicit.symplectic_euler": (reference.symplectic_euler, timed),
        "explicit.runge_kutta": (reference.runge_kutta, timed),
        "implicit_euler.certificate.certify": (certified, timed),
        "implicit_euler.objective.Objective.evaluate": (formed, timed),
        "judging.step.judge_step": (judged, timed | {"result": moving["positions"] + 0.01}),
    }
    for solver in implicit_euler.STEP_SOLVERS:
        table[f"implicit_euler.ImplicitEuler.step, {solver}"] = (
            stepped(solver),
            timed | {"tolerance": 1e-10},
        )
    return {
        f"reference.{name}, numbers": Call(
            of_system(function),
            parts | moving | given,
            single="rest_lengths stiffnesses dampings",
            names="state springs",
            raises=(FloatingPointError,),
        )
        for name, (function, given) in table.items()
    }


IT = "it"  # stands for a path
URDF = """<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="revolute">
<parent link="a"/><child link="b"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/></joint></robot>
"""
MJCF = """<mujoco><worldbody><body name="a"><joint name="j" type="hinge"/>
<geom size="1"/></body></worldbody></mujoco>"""
OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


def _files():
    model, local, robots = tree(), rotation.random(RNG(), 4, 6), robot()
    text = bvh.format(model, local)
    shifts = np.tile(model.offsets, (4, 1, 1)) * np.arange(1.0, 5.0)[:, None, None]
    moved = {"skeleton": model, "local_rotations": local, "frame_time": 0.02, "offsets": shifts,
             "order": "ZXY"}  # fmt: skip
    f = "reference.formats."

    def named(function, text, **options):
        """Return a call by path, IT being that of a file with the text."""

        def from_file(path, **given):
            with tempfile.NamedTemporaryFile("w", suffix=".txt") as file:
                file.write(text)
                file.flush()
                return function(file.name if path is IT else path, **given)

        return Call(from_file, {"path": IT, **options}, names="text")

    def posed(skeleton, local_rotations, offsets):
        return bvh.Motion(skeleton, local_rotations, 0.02, offsets).pose()

    def written(path, **given):
        with tempfile.TemporaryDirectory() as folder:
            bvh.write(Path(folder, "it.bvh") if path is IT else path, **given)

    pose = {name: moved[name] for name in ("skeleton", "local_rotations", "offsets")}
    return {
        f + "bvh.reader.Motion.pose": Call(posed, pose),
        f + "bvh.reader.read": named(bvh.read, text),
        f + "bvh.reader.parse": Call(bvh.parse, {"text": text}, names="BVH"),
        f + "bvh.writer.format": Call(bvh.format, moved, free="local_rotations"),
        f + "bvh.writer.format, robot": Call(
            bvh.format, {"skeleton": robots, "local_rotations": robots.random(RNG(), 4)},
            free="local_rotations"),
        f + "bvh.writer.write": Call(written, {"path": IT, **moved}, free="local_rotations",
                                     raises=(OSError,)),
        f + "mjcf.read": named(mjcf.read, MJCF),
        f + "mjcf.parse": Call(mjcf.parse, {"text": MJCF}, names="MJCF"),
        f + "urdf.read": named(urdf.read, URDF, mimic=True),
        f + "urdf.parse": Call(urdf.parse, {"text": URDF, "mimic": True}, names="URDF"),
        f + "obj.read_obj": named(obj.read_obj, OBJ),
        f + "obj.parse_obj": Call(obj.parse_obj, {"text": OBJ, "name": "text"}, names="x"),
    }  # fmt: skip


def _matrices():
    A = scipy.sparse.csc_array(np.diag([4.0, 5.0, 6.0, 7.0]) + np.ones((4, 4)))
    b = np.arange(4.0)
    factor = cholesky.CholeskyFactor(A)
    c, library = (
        "reference.sparse.factor.CholeskyFactor",
        "reference.sparse.linear_solver.",
    )
    lu = linear_solver.SuperLUFactor(A)
    table = {
        library + "factorize": Call(
            linear_solver.factorize, {"matrix": A, "library": "supernodal"}),
        library + "SuperLUFactor": Call(linear_solver.SuperLUFactor, {"matrix": A}),
        library + "SuperLUFactor.solve": Call(lu.solve, {"b": b}, passed_on="b"),
        library + "SuperLUFactor.refactorize": Call(lu.refactorize, {"matrix": A}),
        c: Call(cholesky.CholeskyFactor, {"matrix": A, "pattern": None}),
        c + ".refactorize": Call(factor.refactorize, {"matrix": A}),
        c + ".solve": Call(factor.solve, {"b": b}, passed_on="b"),
        c + ".lower": Call(factor.lower, {}),
    }  # fmt: skip
    with_cholespy = _cholespy_calls(A, b)
    return table | {library + "CholespyFactor" + name: call for name, call in with_cholespy.items()}


def _cholespy_calls(A, b):
    factor = linear_solver.CholespyFactor(A)
    return {
        "": Call(linear_solver.CholespyFactor, {"matrix": A}),
        ".solve": Call(factor.solve, {"b": b}, passed_on="b"),
        ".refactorize": Call(factor.refactorize, {"matrix": A}),
    }


def _settings():
    def within(setting):
        def call(**arguments):
            with setting(**arguments):
                return 1.0

        return call

    compiled, threads = "reference.backend.compiled.", "reference.backend.threads."
    backends = {
        "set_backend": Call(within(reference.set_backend), {"name": "python"}, names="backend"),
    }
    counts = {
        "set_num_threads": Call(within(reference.set_num_threads), {"count": 1}),
    }
    return {compiled + name: call for name, call in backends.items()} | {
        threads + name: call for name, call in counts.items()
    }


def _samples():
    s = "crosscheck.samples."
    tree = samples.skeleton(3)
    claim = verdict.Claim("a", "b", "c", _compared, POSITION, 1)
    table = {
        s + name: Call(getattr(samples, name), {"case": 0})
        for name in ("skeleton", "reach", "uniform", "smooth", "unpinned", "drifting", "oscillator",
                     "line")
    }  # fmt: skip
    return table | {
        s + "network": Call(samples.network, {"case": 0, "damped": True}),
        s + "local_rotations": Call(
            lambda case, skeleton, batch: samples.local_rotations(case, skeleton, batch),
            {"case": 0, "skeleton": tree, "batch": 2}, names="shape"),
        s + "highest_rate": Call(samples.highest_rate, {"system": system()[0]}),
        "crosscheck.verdict.check_claim": Call(verdict.check_claim, {"claim": claim, "cases": 1}),
    }  # fmt: skip


def _compared(cases):
    return [verdict.Comparison(np.ones(3), np.ones(3), np.zeros(3), 1.0)] * cases
