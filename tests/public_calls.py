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
    inverse_kinematics, tracking, mass_spring, explicit, implicit_euler, objective,
    certificate, scenes, formats, bvh, mjcf, obj, urdf, linear_solver, cholesky, compiled, parallel,
    samples, verdict,
]  # fmt: skip

# What stands in these modules for other modules of ours, and why no user calls it.
_INTERNAL = {
    "of what is checked already": """
        reference.articulation.one_batch reference.articulation.rotated_by_pi
        reference.articulation.number_coordinates reference.rotation.check_unit
        reference.skeleton.Skeleton.path_array reference.implicit_euler.objective.global_matrix
        reference.implicit_euler.objective.effective_stiffnesses crosscheck.samples.particles""",
    "unchecked twin": """
        reference.mass_spring.MassSpring.replaced reference.mass_spring.State.of
        reference.implicit_euler.objective.Objective.iterate_at
        reference.implicit_euler.objective.Objective.hessian_at
        reference.implicit_euler.objective.Objective.pin_gradient_at
        reference.implicit_euler.certificate.Certificate.shares_minimiser_within""",
    "is a border itself": """
        reference.skeleton.checked_skeleton reference.articulation.Articulation.checked
        reference.mass_spring.checked_state reference.mass_spring.pin_targets
        reference.mass_spring.constant_forces""",
    "made only by us": """
        reference.implicit_euler.objective.Iterate reference.judging.step.StepJudgement
        reference.judging.pose.PoseJudgement reference.implicit_euler.StepResult
        reference.implicit_euler.certificate.Certificate crosscheck.verdict.Claim
        reference.inverse_kinematics.certificate.IKCertificate""",
    "of our own sources": """
        crosscheck.verdict.each_case reference.implicit_euler.objective.Iterate.within
        reference.implicit_euler.objective.Iterate.is_above crosscheck.samples.generator
        reference.formats.bvh.euler_angles""",
    "a protocol": """
        reference.implicit_euler.StepMethod.iterates reference.sparse.linear_solver.Factor.solve
        reference.sparse.linear_solver.Factor.refactorize""",
    "a part of the proof": """
        reference.implicit_euler.certificate.kantorovich_distance
        reference.implicit_euler.certificate.least_curvature
        reference.implicit_euler.certificate.newton_length
        reference.implicit_euler.certificate.hessian_change
        reference.implicit_euler.certificate.laplacian_norm
        reference.implicit_euler.certificate.rounding_errors""",
    "for kernels": """
        reference.backend.compiled.Kernel
        reference.backend.compiled.bind reference.backend.compiled.digest
        reference.backend.compiled.compiled_in reference.backend.threads.in_slices""",
    "made only by check_claim": """
        crosscheck.verdict.ClaimVerdict""",
}
INTERNAL = {name: why for why, names in _INTERNAL.items() for name in names.split()}


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
    """Return the valid calls by the names of the functions; a variant follows a comma."""
    table = {}
    for section in (
        _rotations, _curves, _skeletons, _articulations, _derivatives, _solves, _systems, _steps,
        _scenes, _files, _matrices, _settings, _samples, _trees_of_numbers, _systems_of_numbers,
    ):  # fmt: skip
        for name, call in section():
            assert name not in table
            table[name] = call
    return table


def entry(function, arguments, variant="", of=None, **laws):
    """Return a call and its name, that of the public function `of` where a wrapper is called."""
    public = of or function
    name = f"{public.__module__}.{public.__qualname__}".removeprefix("plumbob.")
    return name + (f", {variant}" if variant else ""), Call(function, arguments, **laws)


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


def _lists(position, rotation):
    """All solutions of an arm that is searched on a grid, and of an arm with a closed form."""
    axes, offsets = RNG().standard_normal((2, 7, 3))
    arm = Articulation(Skeleton(range(-1, 6), offsets), "hinge", axes, lower=-2.0, upper=1.5)
    wrist = Articulation(Skeleton(range(-1, 5), [*offsets[:4], [0, 0, 0], [0, 0, 0]]), "hinge",
                         axes[:6])  # fmt: skip

    def listed(position, rotation, effector, grid, restarts, seed):
        target, grid = Target(position, rotation), {2: grid}
        options = {"grid": grid, "restarts": restarts, "seed": seed}
        return reference.all_solutions(arm, target, effector, **options)

    def listed_by_form(position, rotation):
        return reference.all_solutions(wrist, Target(position, rotation))

    def turned(position, rotation):
        return list(listed_by_form(position, rotation).with_turns())

    turns = inverse_kinematics.IKSolutions.with_turns
    pose, all_solutions = {"position": position, "rotation": rotation}, reference.all_solutions
    options = {"effector": 6, "grid": np.array([0.2, 0.4]), "restarts": 8, "seed": 3}
    laws = {"free": "position rotation grid", "names": "target"}
    yield entry(listed, pose | options, of=all_solutions, single="grid", **laws)
    yield entry(listed_by_form, pose, "closed form", all_solutions, **laws)
    yield entry(turned, pose, of=turns, **laws)


def _rotations():
    q, p = rotation.random(RNG(), 6), rotation.random(np.random.default_rng(1), 6)
    v, w = RNG().uniform(-1.0, 1.0, (2, 6, 3))
    yield entry(lambda shape: rotation.identity(2, shape), {"shape": 3}, of=rotation.identity)
    yield entry(lambda rng, shape: rotation.random(rng, 2, shape),
                {"rng": np.random.default_rng(0), "shape": 3}, of=rotation.random)  # fmt: skip
    yield entry(lambda q: rotation.unit("q", q), {"q": q}, of=rotation.unit, free="q")
    yield entry(rotation.from_matrix, {"matrix": rotation.to_matrix(q)}, free="matrix")
    yield entry(rotation.normalise, {"quaternions": q}, free="quaternions")
    yield entry(rotation.rotate, {"q": q, "v": v}, free="q v")
    yield entry(rotation.exponential, {"v": v}, free="v")
    for function in (rotation.conjugate, rotation.logarithm, rotation.to_matrix):
        yield entry(function, {"q": q}, free="q")
    for function, a, b in (
        (rotation.multiply, q, p), (rotation.angle, q, p), (rotation.between, v, w)
    ):  # fmt: skip
        yield entry(function, {"a": a, "b": b}, free="a b")


def _curves():
    for name in ("circle", "square", "heart", "triangle", "star", "plumb_bob"):
        yield entry(getattr(curve, name), {"count": 12})
    spacing = {"min_spacing": 0.01, "max_spacing": 0.05, "closed": True}
    yield entry(curve.resample, {"curve": curve.circle(30), **spacing}, free="curve")


def _skeletons():
    model, local = tree(), rotation.random(RNG(), 5, 6)
    turned = kinematics.forward_kinematics(model, local).rotations
    yield entry(
        Skeleton, {"parents": model.parents, "offsets": model.offsets, "names": list("uvwxyz")}
    )
    yield entry(model.index, {"joint": "b", "argument": "joint"})
    yield entry(model.path, {"effector": 2})
    yield entry(model.reach, {"effector": "f"})
    for variant, some, q in (
        ("", model, local), ("one", model, local[0]), ("robot", robot(), robot().random(RNG(), 5))
    ):  # fmt: skip
        given = {"skeleton": some, "local_rotations": q}
        yield entry(reference.forward_kinematics, given, variant, free="local_rotations", names="q")
    yield entry(reference.prepare, {"skeleton": model})
    yield entry(
        lambda local_rotations: reference.prepare(model)(local_rotations),
        {"local_rotations": local[0]}, of=kinematics.PreparedKinematics,
    )  # fmt: skip
    yield entry(
        lambda q: reference.prepare(robot())(q), {"q": q[0]}, "robot",
        of=kinematics.PreparedKinematics,
    )  # fmt: skip
    yield entry(
        reference.local_from_global, {"skeleton": model, "rotations": turned}, free="rotations"
    )


def _articulations():
    model = robot()
    q = model.random(RNG(), 5)
    targets = [Target((0.1, 0.2, 1.0), effector=5)]
    settings = {"tolerance": 1e-3, "max_iterations": 5, "restarts": 1, "seed": 3}
    yield entry(
        lambda q, **options: reference.solve_tasks(model, q, targets, **options),
        {"q": q[0]} | settings, of=reference.solve_tasks,
    )  # fmt: skip
    prepared = settings | {"tolerance_rotation": 1e-3, "effector": 5}
    yield entry(
        lambda **options: int(reference.prepare_ik(model, **options)(q[0], q[0, :3])), prepared,
        of=reference.prepare_ik,
    )  # fmt: skip
    yield entry(
        lambda q, target: reference.prepare_ik(model, effector=5, restarts=1)(q, target),
        {"q": q[0], "target": np.array([0.1, 0.2, 0.3])}, of=reference.PreparedIK,
    )  # fmt: skip
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

    gear, named = {"multiplier": 2.0, "shift": 0.5}, {"of": Articulation, "names": "mimics"}
    single = "axes frames lower upper cones"
    yield entry(Articulation, built, infinite="lower upper cones", single=single)
    yield entry(mimics, {"leader": 1, **gear}, "mimics", **named)
    yield entry(chain, gear, "chain of mimics", **named)
    yield entry(model.index, {"joint": "b", "argument": "joint"})
    yield entry(model.coordinates_of, {"joint": 3})
    yield entry(model.freedoms_of, {"joint": 3})
    yield entry(model.neutral, {})
    yield entry(model.zero, {})
    yield entry(lambda rng, shape: model.random(rng, 2, shape),
                {"rng": np.random.default_rng(0), "shape": 3}, of=model.random)  # fmt: skip
    yield entry(model.within_limits, {"q": q, "tolerance": 1e-9}, free="q")
    for function in (model.clamp, model.local_transforms, model.forward):
        yield entry(function, {"q": q}, free="q")


def _derivatives():
    model, local = robot(), rotation.random(RNG(), 5, 6)
    q, q0 = model.random(RNG(), 2, 5)
    v, jacobian = RNG().uniform(-1.0, 1.0, (5, model.freedom_count)), differential.jacobian
    given, balls = {"articulation": model, "q": q}, {"articulation": tree(), "q": local}
    yield entry(jacobian, {**given, "effector": "f"}, free="q")
    yield entry(jacobian, {**balls, "effector": -1}, "balls", free="q")
    yield entry(differential.jacobians, {**given, "joints": [2, 0]}, free="q")
    yield entry(differential.integrate, {**given, "v": v}, free="q v")
    ends = {"articulation": model, "q1": q, "q0": q0}
    yield entry(differential.difference, ends, free="q1 q0")


def _solves():
    model, balls, solve = robot(), tree(), reference.solve_ik
    local, q = rotation.random(RNG(), 6), model.random(RNG())
    points, rotations = RNG().uniform(-0.5, 0.5, (4, 3)), rotation.random(RNG(), 4)
    tolerances = {"tolerance": 1e-4, "tolerance_rotation": 1e-4}
    settings = {"solver": "ccd", "effector": "f", **tolerances, "max_iterations": 4}
    once = {"restarts": 0, "seed": 3, "record": False}
    drawn = {"restarts": 1, "seed": 3, "record": True}

    def posed(position, rotation, effector, weight):
        target = Target(position, rotation, effector, weight), Target([0.1, 0.2, 0.3], None, "c")
        return solve(model, q, target, "levenberg_marquardt", max_iterations=4)

    def one_pose(position, rotation, effector, weight):
        target = Target(position, rotation, effector, weight)
        return solve(model, q, target, "levenberg_marquardt", max_iterations=4)

    def follow(position, rotation, weight):
        target = Target(position, rotation, "f", weight)
        return reference.track(model, [target], "levenberg_marquardt", q, max_iterations=4)

    laws = {"free": "local_rotations target", "names": "q effector"}
    for variant, some, start, target, options in (
        ("", balls, local, points[0], once),
        ("batch", balls, np.tile(local, (4, 1, 1)), points, drawn),
        ("robot", model, q, points, drawn),
    ):
        given = {"skeleton": some, "local_rotations": start, "target": target}
        yield entry(solve, given | settings | options, variant, **laws)
    given = {"skeleton": balls, "local_rotations": local, "target": points[0]}
    for solver in inverse_kinematics.IK_SOLVERS:
        yield entry(solve, given | {"solver": solver, "max_iterations": 4}, solver, **laws)
    target = {"position": points[0], "rotation": rotations[0], "effector": "f", "weight": 2.0}
    yield entry(posed, target, "poses", solve, free="position rotation", names="target")
    yield entry(one_pose, target, "pose", solve, free="position rotation", names="target")
    yield from _lists(points[0], rotations[0])
    motion = {"warm": True, "record": True}
    yield entry(
        reference.track, {"skeleton": balls, "curve": points, "start": local, **settings, **motion},
        free="curve", names="q effector", raises=(FloatingPointError,),
    )  # fmt: skip
    targets = {"position": points, "rotation": rotations, "weight": 2.0}
    free, names = "position rotation", "target curve"
    yield entry(follow, targets, "poses", reference.track, free=free, names=names)
    place = reference.forward_kinematics(balls, local).positions
    judged, names = {"target": points[0], "effector": "f", **tolerances}, "local_rotations q"
    given = {"model": balls, "pose": local, "positions": place, **judged}
    yield entry(reference.judge_pose, given, names=names)
    yield entry(reference.judge_pose, {"model": model, "pose": q, **judged}, "robot", names=names)
    yield entry(reference.certify_ik, {"model": balls, "pose": local, **judged}, names=names)
    yield entry(reference.certify_ik, {"model": model, "pose": q, **judged}, "robot", names=names)


def _systems():
    model, state = system()
    outer, m = RNG().uniform(-1.0, 1.0, (5, 3)), mass_spring
    at, moving = {"system": model, "positions": state.positions}, {"system": model, "state": state}
    per_spring = {
        "rest_lengths": np.full(7, 0.9), "stiffnesses": np.full(7, 50.0),
        "dampings": np.full(7, 0.5), "tension_only": np.zeros(7, bool),
    }  # fmt: skip
    built = {
        "masses": np.array(model.masses), "springs": np.array(model.springs), **per_spring,
        "pinned": np.array([0, 2]), "gravity": np.array([0.0, -9.81, 1.0]),
    }  # fmt: skip
    yield entry(MassSpring, built, single=" ".join(per_spring), free="masses pinned")
    yield entry(State, {"positions": state.positions, "velocities": outer})
    yield entry(m.derivation, {"system": model})
    yield entry(m.incidence, {"system": model})
    yield entry(m.kinetic_energy, moving)
    yield entry(m.damper_forces, moving)
    yield entry(m.forces, {**moving, "external_forces": outer})
    for function in (m.rest_vectors, m.lengths, m.stretches, m.potential_energy, m.spring_energy,
                     m.spring_forces, m.stiffness_matrix, m.damping_matrix):  # fmt: skip
        yield entry(function, at)


def _steps():
    model, state = system()
    x, outer = state.positions, RNG().uniform(-1.0, 1.0, (5, 3))
    moved = {"state": state, "external_forces": outer, "pin_positions": np.array([[0.1, 0, 0]])}
    stepped = {"system": model, **moved, "h": 0.01}
    euler = ImplicitEuler(model, h=0.01, max_iterations=5)
    g, result = euler.objective(state), euler.step(state)
    proof = euler.certify(state, result)

    def iterates(state, external_forces, pin_positions):
        return list(itertools.islice(euler.iterates(state, external_forces, pin_positions), 2))

    for function in (reference.symplectic_euler, reference.runge_kutta):
        yield entry(function, stepped, raises=(FloatingPointError,))
    for function in (g.evaluate, g.value, g.gradient, g.rest_vectors):
        yield entry(function, {"positions": x})
    options = {"solver": "newton", "tolerance": 1e-10, "max_iterations": 5}
    yield entry(ImplicitEuler, {"system": model, "h": 0.01, **options})
    yield entry(euler.step, moved)
    yield entry(euler.objective, moved)
    yield entry(euler.certify, {**moved, "result": result}, names="positions")
    yield entry(iterates, moved, of=euler.iterates)
    yield entry(objective.Objective, {**stepped, "start": "x_n"})
    yield entry(reference.judge_step, {**stepped, "positions": x, "velocities": outer})
    yield entry(g.residual, {"iterate": g.start})
    yield entry(g.hessian, {"positions": x, "geometric": True})
    yield entry(g.quadratic_form, {"positions": x, "d": g.rest_vectors(x)})
    yield entry(certificate.certify, {"objective": g, "positions": x})
    yield entry(proof.shares_minimiser, {"other": proof, "distance": 0.1})


def _scenes():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.5]], float)
    elastic = {"stiffness": 100.0, "damping": 0.1, "gravity": 9.81}
    grid = {"rows": 3, "columns": 4, "spacing": 0.2, "height": 1.5, "mass": 1.0, **elastic}
    mesh = {"vertices": vertices, "triangles": np.array([[0, 1, 2], [0, 2, 3]]), **elastic,
            "bending_stiffness": 1.0, "tension_only": True, "pinned": np.array([0, 1])}  # fmt: skip
    lab = {"size": 3, "side": 2.0, "height": 1.5, "mass": 1.0, **elastic}
    cloth = {**grid, "shear_stiffness": 10.0, "bending_stiffness": 5.0, "tension_only": False,
             "pinned": np.array([0, 3])}  # fmt: skip
    blocks = {"counts": (3, 2, 2), "spacing": 0.1, "mass": 0.1, **elastic}
    rope = {"particles": 4, "length": 1.0, "mass": 0.1, **elastic, "tension_only": True}
    network = {"seed": 3, "particles": 6, "pinned": 1, "damping": 1.0, "tension_only": 0.5}
    yield entry(scenes.lab_cloth, lab, names="spacing positions")
    yield entry(scenes.grid_cloth, cloth, free="pinned", names="positions")
    yield entry(scenes.grid_triangles, {"rows": 3, "columns": 4})
    yield entry(scenes.net, grid, names="positions")
    yield entry(scenes.lattice, blocks, names="positions")
    yield entry(scenes.hanging_rope, rope)
    for variant, key, free, names in (
        ("", "density", "triangles pinned", "mass masses"),
        ("mass", "mass", "vertices triangles pinned", "density"),
    ):
        yield entry(scenes.cloth_from_mesh, {**mesh, key: 0.3}, variant, free=free, names=names)
    yield entry(scenes.random_network, network, names="dampings")
    yield entry(scenes.lab_arm, {})
    yield entry(scenes.ball_chain, {"links": 3, "link_length": 0.1})


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
        **balls, "axes": np.array(model.axes), "lower": np.full(6, -1.0), "upper": np.full(6, 1.5),
        "cones": np.full(6, 2.0), "multiplier": 0.5, "shift": 0.1,
    }  # fmt: skip
    q, q0 = model.random(RNG(), 2, 3)
    points, turns = RNG().uniform(-0.5, 0.5, (4, 3)), rotation.random(RNG(), 4)
    v = RNG().uniform(-1.0, 1.0, (3, model.freedom_count))
    tolerances = {"tolerance": 1e-4, "tolerance_rotation": 1e-4}
    track = functools.partial(reference.track, effector="f", max_iterations=8)
    judged = functools.partial(reference.judge_pose, effector="f")
    posed = {"position": points[0], "rotation": turns[0], "weight": 2.0}
    place = reference.forward_kinematics(tree(), local).positions
    target = {"target": points[0], "positions": place}
    # functions, their arguments for a tree of balls, and for a robot
    table = [
        (reference.forward_kinematics, "", None, {"local_rotations": local},
         {"local_rotations": q}),
        (differential.jacobians, "", None, {"q": local}, {"q": q}),
        (differential.integrate, "", None, None, {"q": q, "v": v}),
        (differential.difference, "", None, None, {"q1": q, "q0": q0}),
        (track, "", reference.track, {"curve": points, **tolerances}, {"curve": points}),
        (judged, "", reference.judge_pose, {"pose": local, **target}, {"pose": q[0], **target}),
        (bvh.format, "", None, {"local_rotations": local[None]}, None),
        (drawn, "", Articulation.random, None, {}),
    ]  # fmt: skip
    for solver in inverse_kinematics.IK_SOLVERS:
        solve = functools.partial(reference.solve_ik, solver=solver, max_iterations=8, restarts=1)
        given = {"local_rotations": local, "target": points[0], **tolerances}
        table.append((solve, f"{solver}, ", reference.solve_ik, given, None))
        solve = functools.partial(reached, solver=solver)
        table.append((solve, f"{solver} poses, ", reference.solve_ik, None, posed | tolerances))
    laws = {
        "names": "q local_rotations target mimics names effector parents",
        "free": "local_rotations q q0 q1 v curve target position rotation",
    }
    limited = {"single": "axes lower upper cones", "infinite": "lower upper cones"}
    for function, variant, public, of_tree, of_model in table:
        public, raises = public or function, (FloatingPointError,) * (function is track)
        if of_tree is not None:
            given, call = balls | of_tree, of_balls(function)
            yield entry(call, given, variant + "numbers", public, raises=raises, **laws)
        if of_model is not None:
            given, variant = parts | of_model, variant + "robot of numbers"
            yield entry(
                of_robot(function), given, variant, public, raises=raises, **laws, **limited
            )


def _systems_of_numbers():
    """Return calls whose arguments are the numbers of a system and its state as well."""
    model, state = system()
    parts = {
        "masses": np.array(model.masses), "rest_lengths": np.full(7, 0.9),
        "stiffnesses": np.full(7, 50.0), "dampings": np.full(7, 0.5),
        "gravity": np.array([0.0, -9.81, 1.0]),
    }  # fmt: skip
    moving = {"positions": np.array(state.positions), "velocities": np.array(state.velocities)}
    loads = {
        "external_forces": RNG().uniform(-1.0, 1.0, (5, 3)),
        "pin_positions": np.array([[0.1, 0.0, 0.0]]),
    }

    def of_system(function):
        def call(gravity, positions, velocities, **given):
            values = {name: given.pop(name) for name in parts if name != "gravity"}
            values |= {"pinned": [0], "gravity": gravity, "tension_only": model.tension_only}
            made = MassSpring(springs=model.springs, **values)
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
        m, x = mass_spring, state.positions
        of_positions = (m.potential_energy, m.stiffness_matrix, m.damping_matrix, m.rest_vectors,
                        m.stretches)  # fmt: skip
        values = [function(made, x) for function in of_positions]
        return [*values, m.kinetic_energy(made, state), m.damper_forces(made, state),
                m.derivation(made)]  # fmt: skip

    def judged(made, state, h, result, **loads):
        return reference.judge_step(made, state, h, result, state.velocities, **loads)

    def formed(made, state, h, **loads):
        g = ImplicitEuler(made, h=h).objective(state, **loads)
        x = state.positions
        residual = min(g.residual(g.evaluate(x)), 1e308)  # infinite where g overflows
        return [g.evaluate(x), residual, g.hessian(x), g.quadratic_form(x, g.rest_vectors(x))]

    timed = loads | {"h": 0.01}
    table = [
        (mass_spring.forces, None, "", {"external_forces": loads["external_forces"]}),
        (measured, mass_spring.potential_energy, "", {}),
        (reference.symplectic_euler, None, "", timed),
        (reference.runge_kutta, None, "", timed),
        (certified, certificate.certify, "", timed),
        (formed, objective.Objective.evaluate, "", timed),
        (judged, reference.judge_step, "", timed | {"result": moving["positions"] + 0.01}),
    ]
    for solver in implicit_euler.STEP_SOLVERS:
        given = timed | {"tolerance": 1e-10}
        table.append((stepped(solver), ImplicitEuler.step, f"{solver}, ", given))
    single = "rest_lengths stiffnesses dampings"
    for function, public, variant, given in table:
        yield entry(
            of_system(function), parts | moving | given, variant + "numbers", public or function,
            single=single, names="state springs", raises=(FloatingPointError,),
        )  # fmt: skip


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

    def of_file(function, text, **options):
        """Return an entry of a call by path, IT being that of a file with the text."""

        def from_file(path, **given):
            with tempfile.NamedTemporaryFile("w", suffix=".txt") as file:
                file.write(text)
                file.flush()
                return function(file.name if path is IT else path, **given)

        return entry(from_file, {"path": IT, **options}, of=function, names="text")

    def posed(skeleton, local_rotations, offsets):
        return bvh.Motion(skeleton, local_rotations, 0.02, offsets).pose()

    def written(path, **given):
        with tempfile.TemporaryDirectory() as folder:
            bvh.write(Path(folder, "it.bvh") if path is IT else path, **given)

    pose = {name: moved[name] for name in ("skeleton", "local_rotations", "offsets")}
    yield entry(posed, pose, of=bvh.Motion.pose)
    yield of_file(bvh.read, text)
    yield entry(bvh.parse, {"text": text}, names="BVH")
    yield entry(bvh.format, moved, free="local_rotations")
    given = {"skeleton": robots, "local_rotations": robots.random(RNG(), 4)}
    yield entry(bvh.format, given, "robot", free="local_rotations")
    raises, given = (OSError,), {"path": IT, **moved}
    yield entry(written, given, of=bvh.write, free="local_rotations", raises=raises)
    yield of_file(mjcf.read, MJCF)
    yield entry(mjcf.parse, {"text": MJCF}, names="MJCF")
    yield of_file(urdf.read, URDF, mimic=True)
    yield entry(urdf.parse, {"text": URDF, "mimic": True}, names="URDF")
    yield of_file(obj.read_obj, OBJ)
    yield entry(obj.parse_obj, {"text": OBJ, "name": "text"}, names="x")


def _matrices():
    A = scipy.sparse.csc_array(np.diag([4.0, 5.0, 6.0, 7.0]) + np.ones((4, 4)))
    b = np.arange(4.0)
    factor = cholesky.CholeskyFactor(A)
    yield entry(linear_solver.factorize, {"matrix": A, "library": "supernodal"})
    yield entry(cholesky.CholeskyFactor, {"matrix": A, "pattern": None})
    yield entry(factor.lower, {})
    yield entry(linear_solver.SuperLUFactor, {"matrix": A})
    for solver in (factor, linear_solver.SuperLUFactor(A)):
        yield entry(solver.solve, {"b": b}, passed_on="b")
        yield entry(solver.refactorize, {"matrix": A})


def _settings():
    def within(setting):
        def call(**arguments):
            with setting(**arguments):
                return 1.0

        return call

    backend, threads = reference.set_backend, reference.set_num_threads
    yield entry(within(backend), {"name": "python"}, of=backend, names="backend")
    yield entry(within(threads), {"count": 1}, of=threads)


def _samples():
    claim = verdict.Claim("a", "b", "c", _compared, POSITION, 1)
    for name in ("skeleton", "reach", "uniform", "smooth", "unpinned", "drifting", "oscillator",
                 "line"):  # fmt: skip
        yield entry(getattr(samples, name), {"case": 0})
    yield entry(samples.network, {"case": 0, "damped": True})
    given = {"case": 0, "skeleton": samples.skeleton(3), "batch": 2}
    yield entry(lambda case, skeleton, batch: samples.local_rotations(case, skeleton, batch),
                given, of=samples.local_rotations, names="shape")  # fmt: skip
    yield entry(samples.highest_rate, {"system": system()[0]})
    yield entry(verdict.check_claim, {"claim": claim, "cases": 1})


def _compared(cases):
    return [verdict.Comparison(np.ones(3), np.ones(3), np.zeros(3), 1.0)] * cases
