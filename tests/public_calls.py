"""Every public function of Plumbob with right arguments, for the laws of its borders."""

import functools
import inspect
import itertools
import tempfile
from enum import Enum
from pathlib import Path

import numpy as np

import plumbob
from plumbob import IK_SOLVERS, STEP_SOLVERS, Target, formats, rotation

# Public by name, but no user's arguments come to them: they are made only by us, or take what is
# checked already.
_INTERNAL = """
    Certificate IKCertificate PoseJudgement PreparedIK PreparedKinematics PreparedTasks
    StepJudgement StepResult
    Articulation.checked Certificate.shares_minimiser_within MassSpring.replaced State.of
    Skeleton.path_array formats.bvh.euler_angles mass_spring.checked_state
    mass_spring.constant_forces mass_spring.pin_targets rotation.check_unit rotation.roll_pitch_yaw
    tasks.BuiltInTask.evaluate tasks.BuiltInTask.factors tasks.CentreOfMass.factors
    tasks.Configuration.frame tasks.Coupling.factors tasks.FrameTask.factors tasks.IKTask
    tasks.IKTask.evaluate tasks.LookAt.factors tasks.Posture.factors tasks.configuration
    PreparedSolutions"""
INTERNAL = _INTERNAL.split()
RNG = functools.partial(np.random.default_rng, 9)
OFFSETS, KINDS = (
    RNG().uniform(-0.5, 0.5, (6, 3)),
    ["fixed", "hinge", "slide", "ball", "hinge", "free"],
)
SPRINGS = np.array([[0, 1], [1, 2], [2, 3], [3, 4], [0, 2], [1, 3], [2, 4]])
EXPLICIT = ("symplectic_euler", "runge_kutta")


def public_names():
    """Return each public function, class and method by its name below `plumbob`."""
    found = {}
    for name in plumbob.__all__:
        for path, part in _parts(name, getattr(plumbob, name)):
            if part not in found.values():
                found[path] = part
    return found


def _parts(path, thing):
    """Yield what may be called; kernels, which have no annotations, are left out."""
    members = {}
    if inspect.isfunction(thing) and (thing.__annotations__ or not thing.__code__.co_argcount):
        yield path, thing
    elif inspect.ismodule(thing):
        home = thing.__name__
        own = [n for n, x in vars(thing).items() if getattr(x, "__module__", "") == home]
        members = {name: getattr(thing, name) for name in getattr(thing, "__all__", own)}
    elif isinstance(thing, dict):
        members = {name: x for name, x in thing.items() if inspect.isfunction(x)}
    elif inspect.isclass(thing) and not issubclass(thing, Enum | Exception):
        methods = {name: getattr(x, "__func__", x) for name, x in vars(thing).items()}
        members = {name: x for name, x in methods.items() if inspect.isfunction(x)}
        if "__init__" in members:
            yield path, thing
    for name, member in members.items():
        if name[0] != "_":
            yield from _parts(f"{path}.{name}", member)


def names():
    """Return the names of all calls; a variant follows a comma."""
    return list(dict.fromkeys([*(n for n in public_names() if n not in INTERNAL), *VARIANTS]))


def call_of(name):
    """Return a call, a KeyError if an argument of the function has no value in the table."""
    given = {}
    for prefix, some in values().items():
        if not prefix or name == prefix or name.startswith((f"{prefix}.", f"{prefix},")):
            given |= some
    function = VARIANTS.get(name) or _callable(name.partition(",")[0])
    various = inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD
    parameters = inspect.signature(function).parameters.items()
    arguments = {name: given[name] for name, one in parameters if one.kind not in various}
    return functools.partial(function, **arguments)


def _callable(name):
    """Return a method of an instance, or what uses a task, a file or a setting, or the thing."""
    thing, (owner, _, method) = public_names()[name], name.rpartition(".")
    wrapped = functools.wraps(thing)
    if owner == "tasks":
        return wrapped(lambda **given: solved(thing(**given)))
    if name.startswith("set_"):
        return wrapped(lambda **given: within(thing(**given)))
    if "path" in inspect.signature(thing).parameters:
        return wrapped(lambda **given: in_file(thing, **given))
    instance = values()["instances"].get(owner)
    return thing if instance is None else getattr(instance, method)


def solved(task):
    return plumbob.solve_tasks(robot(), robot().neutral(), [task], max_iterations=8)


def retargeted(task, target=None, rotation=None):
    pose = plumbob.tasks.FrameTask("f", np.ones(3), (1.0, 0.0, 0.0, 0.0))
    solve = plumbob.prepare_tasks(robot(), [pose], max_iterations=8)
    solve.set_target(task, target, rotation)
    return solve(robot().neutral()), solve.coordinates


def within(setting):
    with setting:
        return 1.0


def in_file(function, path, **given):
    """Call a function of a path with a file of the text that stands for it."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "it").write_text(path)
        return function(Path(folder, "it"), **given)


def posed(offsets, axes, lower, upper, cones, shift, q, position, weight, rotation=None):
    model = robot(offsets, axes, shift, lower=lower, upper=upper, cones=cones)
    targets = Target(position, rotation, "f", weight), Target([0.1, 0.2, 0.3], None, "c")
    return plumbob.solve_ik(model, q, targets, max_iterations=8)


def stepped(masses, rest_lengths, stiffnesses, dampings, tension_only, gravity, positions, h,
            velocities, solver, external_forces=None, pin_positions=None):  # fmt: skip
    springs = SPRINGS, rest_lengths, stiffnesses, dampings
    system = plumbob.MassSpring(masses, *springs, [0], gravity, tension_only)
    state, loads = plumbob.State(positions, velocities), (external_forces, pin_positions)
    if solver in EXPLICIT:
        return getattr(plumbob, solver)(system, state, h, *loads)
    settings = {"h": h, "solver": solver, "max_iterations": 8}
    return plumbob.ImplicitEuler(system, **settings).step(state, *loads)


def iterates(state, external_forces=None, pin_positions=None):
    steps = values()["instances"]["ImplicitEuler"].iterates(state, external_forces, pin_positions)
    return [one.positions for one in itertools.islice(steps, 2)]


# Functions that hand their arguments on; None stands for the public function itself.
VARIANTS = {
    **dict.fromkeys([f"solve_ik, {solver}" for solver in [*IK_SOLVERS, "robot", "batch"]]),
    **dict.fromkeys([f"ImplicitEuler.step, {solver}" for solver in STEP_SOLVERS], stepped),
    **dict.fromkeys([f"{name}, numbers" for name in EXPLICIT], stepped),
    **dict.fromkeys(["forward_kinematics, robot", "judge_pose, robot", "certify_ik, robot"]),
    **dict.fromkeys(["jacobians.jacobian, balls", "scenes.cloth_from_mesh, mass"]),
    "solve_ik, numbers": posed, "ImplicitEuler.iterates": iterates,
    "all_solutions, closed form": lambda position, rotation=None:
        plumbob.all_solutions(arm(6), Target(position, rotation)),
    "IKSolutions.with_turns": lambda position, rotation=None:
        list(plumbob.all_solutions(arm(6), Target(position, rotation)).with_turns()),
    "prepare, called": lambda q: plumbob.prepare(robot())(q),
    "prepare_all_solutions, called": lambda target:
        plumbob.prepare_all_solutions(arm(6))(target),
    "prepare_ik, called": lambda q, target: plumbob.prepare_ik(robot(), effector="f")(q, target),
    "prepare_tasks, called": lambda q, tasks: plumbob.prepare_tasks(robot(), tasks)(q),
    "PreparedTasks.set_target": retargeted,
    "formats.bvh.Motion.pose": lambda local_rotations, offsets:
        formats.bvh.Motion(tree(), local_rotations, 0.02, offsets).pose(),
}  # fmt: skip


def tree(offsets=OFFSETS):
    """Return six joints, two of them siblings."""
    return plumbob.Skeleton([-1, 0, 1, 1, 3, 4], offsets, list("abcdef"))


def robot(offsets=OFFSETS, axes=(1.0, 0.0, 0.0), shift=0.1, **limits):
    """Return a joint of each kind, with limits and one that follows another."""
    limits = {"lower": -1.0, "upper": 1.5, "cones": 2.0, **limits}
    mimics = {4: plumbob.Mimic(1, 0.5, shift)}
    return plumbob.Articulation(tree(offsets), KINDS, axes, mimics=mimics, **limits)


def arm(count):
    """Return a chain of hinges, the last three axes of which meet."""
    axes, offsets = RNG().standard_normal((2, count, 3))
    offsets[-2:] = 0.0
    return plumbob.Articulation(plumbob.Skeleton(range(-1, count - 1), offsets), "hinge", axes)


@functools.cache
def values():
    """Return arguments by their names, more special ones by the function that takes them."""
    model, balls, rng = robot(), tree(), np.random.default_rng(0)
    q, q0 = model.random(RNG(), 2, 5)
    quaternions, others = rotation.random(RNG(), 2, 6)
    local, turns = rotation.random(RNG(), 2, 5, 6)
    point, ones, freedoms = np.array([0.1, 0.2, 0.3]), np.ones(6), np.ones(model.freedom_count)
    forces, velocities = rng.uniform(-1.0, 1.0, (2, 5, 3))
    v, w = rng.uniform(-1.0, 1.0, (2, 6, 3))
    positions = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 1], [2, 1, 1]], float)
    gravity, masses = np.array([0.0, -9.81, 1.0]), np.array([1.0, 2.0, 1.0, 1.5, 1.0])
    per_spring = {"rest_lengths": np.full(7, 0.9), "stiffnesses": np.full(7, 50.0),
                  "dampings": np.full(7, 0.5), "tension_only": np.arange(7) < 1}  # fmt: skip
    system = plumbob.MassSpring(masses, SPRINGS, **per_spring, pinned=[0])
    state = plumbob.State(positions, velocities)
    euler = plumbob.ImplicitEuler(system, h=0.01, max_iterations=5)
    result = euler.step(state)
    proof = euler.certify(state, result)
    texts = {"urdf": '<robot name="r"><link name="a"/></robot>',
             "bvh": formats.bvh.format(balls, local),
             "mjcf": '<mujoco><worldbody><geom size="1"/></worldbody></mujoco>'}  # fmt: skip
    of_robot = {"skeleton": model, "model": model, "local_rotations": q[0], "pose": q[0],
                "positions": None}  # fmt: skip
    of_seven = {"robot": arm(7), "grid": {2: 0.2}, "effector": 6}
    triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
    target = Target(point, quaternions[0])
    positioned = plumbob.forward_kinematics(balls, local[0]).positions
    shifts = np.tile(OFFSETS, (5, 1, 1)) * np.arange(1.0, 6.0)[:, None, None]
    return {
        "": {
            "skeleton": balls, "articulation": model, "model": model, "robot": model, "joint": "b",
            "effector": "f", "argument": "joint", "parents": balls.parents, "kinds": KINDS,
            "offsets": np.array(balls.offsets), "names": list("uvwxyz"), "frames": quaternions,
            "axes": np.array(model.axes), "lower": -ones, "upper": 1.5 * ones, "cones": 2.0 * ones,
            "mimics": {4: plumbob.Mimic(1, 0.5)}, "shift": 0.1, "q": q, "q1": q,
            "v": rng.uniform(-1.0, 1.0, (5, len(freedoms))), "joints": np.array([2, 0]),
            "q0": q0, "local_rotations": local, "rotations": turns, "rng": rng, "tolerance": 1e-4,
            "tolerance_rotation": 1e-4, "max_iterations": 8, "restarts": 1, "seed": 3,
            "record": True, "phases": 1, "prefer": None, "oriented": False, "target": point,
            "solver": "levenberg_marquardt", "position": point, "rotation": quaternions[0],
            "weight": 2.0, "tasks": [Target(point, effector=5)], "task": 0, "out": None,
            "curve": forces, "start": local[0], "warm": True, "closed": False, "pose": local[0],
            "count": 12, "min_spacing": 0.01, "max_spacing": 0.05, "masses": masses,
            "springs": SPRINGS, **per_spring, "pinned": np.array([0]), "gravity": gravity,
            "positions": positions, "velocities": velocities, "system": system, "state": state,
            "h": 0.01, "steps": 2, "external_forces": forces, "pin_positions": positions[:1] + 0.1,
            "result": result, "other": proof, "distance": 0.1,
            "triangles": np.array([[0, 1, 2], [0, 2, 3]]),
            "density": 1.2, "text": triangle,
        },
        "instances": {"Articulation": model, "Skeleton": balls, "ImplicitEuler": euler,
                      "Certificate": proof},
        "rotation": {"q": quaternions, "a": quaternions, "b": others, "v": v, "name": "q",
                     "quaternions": quaternions, "matrix": rotation.to_matrix(quaternions)},
        "rotation.normalise": {"name": "quaternions"}, "rotation.between": {"a": v, "b": w},
        "solve_ik": {"local_rotations": local[0], "q": q[0]},
        "solve_ik, batch": {"local_rotations": local, "target": forces},
        **{f"solve_ik, {solver}": {"solver": solver} for solver in IK_SOLVERS},
        **{f"ImplicitEuler.step, {solver}": {"solver": solver} for solver in STEP_SOLVERS},
        **{f"{name}, numbers": {"solver": name} for name in EXPLICIT},
        "judge_pose": {"model": balls, "positions": positioned}, "certify_ik": {"model": balls},
        **{name: of_robot for name in VARIANTS if name.endswith(", robot")},
        "solve_ik, robot": {**of_robot, "prefer": "nearest"},
        "jacobians.jacobian, balls": {"articulation": balls, "q": local},
        "solve_tasks": {"q": q[0]}, "prepare": {"q": q[0]}, "prepare_ik": {"q": q[0]},
        "prepare_tasks": {"q": q[0]},
        "all_solutions": {**of_seven, "target": target}, "prepare_all_solutions": of_seven,
        "prepare_all_solutions, called": {"target": np.append(point, quaternions[0])},
        "ImplicitEuler": {"solver": "newton", "start": None},
        "tasks": {"frame": "f", "relative_to": "b", "target_frame": "b", "point": point,
                  "axis": gravity, "origin": point, "axes": ones, "masses": ones, "centres": v,
                  "coordinates": q[0], "leader": "c", "coefficients": point[:2], "zero": 0.1,
                  "leader_zero": 0.1, "exact": True},
        "tasks.CentreOfMass": {"axes": ones[:3]}, "tasks.Posture": {"axes": freedoms},
        "scenes": {"gravity": 9.81, "tension_only": True, "rows": 3, "columns": 4, "spacing": 0.2,
                   "height": 1.5, "mass": 1.0, "stiffness": 100.0, "damping": 0.1, "size": 3,
                   "shear_stiffness": 10.0, "bending_stiffness": 1.0, "side": 2.0, "links": 3,
                   "link_length": 0.1, "counts": (3, 2, 2), "particles": 6, "length": 1.0,
                   "vertices": positions[:4]},
        "scenes.random_network": {"tension_only": 0.5, "pinned": 1},
        "scenes.cloth_from_mesh": {"mass": None},
        "scenes.cloth_from_mesh, mass": {"mass": 0.3, "density": None},
        "formats": {"offsets": shifts, "frame_time": 0.02, "order": "ZXY", "root": None,
                    "mimic": True, "crossed_limits": "unlimited", "name": "x"},
        "formats.read_obj": {"path": triangle}, "formats.bvh.write": {"path": ""},
        **{f"formats.{kind}.parse": {"text": text} for kind, text in texts.items()},
        **{f"formats.{kind}.read": {"path": text} for kind, text in texts.items()},
        "set_backend": {"name": "python"}, "set_num_threads": {"count": 1},
    }  # fmt: skip
