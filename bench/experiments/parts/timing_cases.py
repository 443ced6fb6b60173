"""The cases of the timing: kinematics, robots, solves and steps of the lab's cloth.

All work is done by us and by engines, or a plain copy moves as many bytes.
"""

from collections.abc import Callable, Iterator
from functools import partial
from itertools import product
from typing import Any

import mujoco
import numpy as np

from plumbob.crosscheck.engines import ABSENT, SKELETON_ENGINES, MujocoMassSpring, SkeletonEngine
from plumbob.crosscheck.engines.skeleton_engine import MujocoSkeleton, coordinates
from plumbob.reference import (
    IK_SOLVERS,
    ImplicitEuler,
    Skeleton,
    State,
    forward_kinematics,
    prepare,
    prepare_ik,
    rotation,
    scenes,
    solve_ik,
    symplectic_euler,
)
from plumbob.reference.arguments import FloatArray
from plumbob.reference.backend.compiled import Kernel
from plumbob.reference.backend.threads import in_slices
from plumbob.reference.formats import mjcf, urdf
from plumbob.reference.implicit_euler.factor_cache import global_factor
from plumbob.reference.jacobians import jacobian
from plumbob.reference.kinematics import THREAD_JOINTS
from plumbob.reference.sparse import CholeskyFactor

from ...peers import catalogue
from ...peers.levenberg_marquardt import ReferenceKinematics, levenberg_marquardt
from ...problems.chains import chain_targets
from ...problems.cloth_swing import MIDDLE, ClothSwing, cloth_swing, converged_motion, motion
from ...problems.evaluate import MUJOCO, PINOCCHIO, mujoco_model, pinocchio_model, to_pinocchio
from ...problems.robots import CHARACTER, BenchRobot, is_installed, robot
from ..chain import MAX_ITERATIONS, TOLERANCE
from ..timing import COMPILED, LIMIT, PLAIN, PREPARED, PRESET, TIGHT, TimedCase, TimedWork

# Bytes of each joint: its local rotation is read, its position and global rotation are written.
READ, WRITE = 8 * 4, 8 * (3 + 4)
# A batch for all cores is longer by this factor than a batch for a single core.
LONGER = 5
# The limbs of a body, each a joint to start from and a number of joints: spine, legs, arms.
LIMBS = ((0, 5), (0, 5), (0, 5), (4, 7), (4, 7))
ROBOTS = ("iiwa14", "human", CHARACTER)
POSES = 1_000  # of a batch
Calls = dict[str, Callable[[FloatArray], Any]]  # by subject
STRATA = ("near", "far")
# Plain Python takes milliseconds a solve; the first targets of the same set are enough.
TARGETS, FEW_TARGETS = 50, 5
LIMITS: dict[str, Any] = {"tolerance": TOLERANCE, "max_iterations": MAX_ITERATIONS}
# The same method as a Python loop on three kinematics.
LOOP = "levenberg_marquardt"
KINEMATICS: dict[str, Callable[[Any], SkeletonEngine]] = {
    catalogue.OUR_KINEMATICS.name: ReferenceKinematics,
    **{
        loop.name: SKELETON_ENGINES[loop.engine]
        for loop in catalogue.LOOPS
        if loop.engine in SKELETON_ENGINES
    },
}
FACTORS = (1, 100)
SUBSTEPS = ITERATIONS = 10
# Particles along a side of a larger cloth, whose factor exceeds the nearest caches.
LARGE = 50
# Newton's motion of more particles than this would take longer than all the timing.
MANY_PARTICLES = 1000
DEFAULT = mujoco.MjOption()

# Sets a problem up and returns the call to be timed.
Starter = Callable[[ClothSwing], Callable[[], Any]]


def cases() -> Iterator[TimedCase]:
    """Yield the cases of all subjects."""
    for subject in (kinematics_cases, robot_cases, ik_cases, cloth_cases):
        yield from subject()


def _work(subject: str, name: str, title: str, group: str = "") -> TimedWork:
    return TimedWork(f"{subject}/{name}/{title}", subject, group or name, title)


def kinematics_cases() -> Iterator[TimedCase]:
    """Yield poses and batches, each with a plain copy of its bytes."""
    for name, (skeleton, batch) in skeletons().items():
        size = skeleton.joint_count * np.array([READ, WRITE])
        pose = _work("kinematics", name, "one pose a call")
        yield TimedCase(pose, COMPILED, partial(compiled_poses, skeleton))
        yield TimedCase(pose, PREPARED, partial(prepared_poses, skeleton))
        yield TimedCase(pose, PLAIN, partial(compiled_poses, skeleton), backend="python")
        for engine in SKELETON_ENGINES:
            yield TimedCase(pose, engine, partial(engine_poses, engine, skeleton))
        yield TimedCase(pose, PRESET, partial(preset_pose, skeleton))
        yield streaming(pose, *size)
        for count, cores, suffix, minimum in (
            (batch, 1, "", 0),
            (LONGER * batch, None, ", all cores", READ * THREAD_JOINTS),
        ):
            poses = _work("kinematics", name, f"{count:,} poses a call{suffix}")
            for solver, start in ((COMPILED, compiled_poses), (PREPARED, prepared_poses)):
                yield TimedCase(poses, solver, partial(start, skeleton, count), count, cores=cores)
            for engine in SKELETON_ENGINES if cores else ():
                loop = partial(engine_poses, engine, skeleton, count)
                yield TimedCase(poses, engine, loop, count)
            yield streaming(poses, *(count * size), operations=count, cores=cores, minimum=minimum)


def skeletons() -> dict[str, tuple[Skeleton, int]]:
    """Return the skeletons by name, and the size of a batch beyond the nearest caches."""
    return {
        "10 balls": (scenes.ball_chain(links=10)[0], 10_000),
        "100 balls": (scenes.ball_chain(links=100)[0], 1_000),
        "30-joint tree": (body(), 3_000),
    }


def body() -> Skeleton:
    """Return a tree of 30 joints with the limbs of a body, all links along random directions."""
    parents = [-1]
    for begin, length in LIMBS:
        parents += [begin, *range(len(parents), len(parents) + length - 1)]
    return Skeleton(parents, np.random.default_rng(30).standard_normal((len(parents), 3)))


def compiled_poses(skeleton: Skeleton, *batch: int) -> Callable[[], Any]:
    """Return our forward kinematics of random poses."""
    return partial(forward_kinematics, skeleton, _local_rotations(skeleton, *batch))


def prepared_poses(skeleton: Skeleton, *batch: int) -> Callable[[], Any]:
    """Return our forward kinematics of random poses, which fills the same arrays every time."""
    local = _local_rotations(skeleton, *batch)
    if not batch:
        return partial(prepare(skeleton), local)
    positions, rotations = map(np.copy, forward_kinematics(skeleton, local))
    return partial(forward_kinematics, skeleton, local, out=(positions, rotations))


def engine_poses(name: str, skeleton: Skeleton, *batch: int) -> Callable[[], Any]:
    """Return an engine's forward kinematics of random poses; the last stays in the engine."""
    engine: Any = SKELETON_ENGINES[name](skeleton)
    q = coordinates(engine, _local_rotations(skeleton, *batch))
    call = engine.update_kinematics
    if name == PINOCCHIO:  # its own call, to which our method adds a fifth on ten balls
        import pinocchio

        call = partial(pinocchio.forwardKinematics, engine.model, engine.data)
    return (lambda: [*map(call, q)]) if batch else partial(call, q)


def preset_pose(skeleton: Skeleton) -> Callable[[], Any]:
    """Return MuJoCo's forward kinematics of a random pose already in its memory."""
    engine = MujocoSkeleton(skeleton)
    engine.update_kinematics(coordinates(engine, _local_rotations(skeleton)))
    return partial(mujoco.mj_kinematics, engine.model, engine.data)


def _local_rotations(skeleton: Skeleton, *batch: int) -> np.ndarray:
    return rotation.random(np.random.default_rng(0), *batch, skeleton.joint_count)


def robot_cases() -> Iterator[TimedCase]:
    """Yield a pose and a batch of each robot, by us and by the engines."""
    subjects, counts = ("kinematics", "jacobians"), (1, POSES)
    for name, subject, count in product(filter(is_installed, ROBOTS), subjects, counts):
        group = f"{robot(name).title}, {len(robot(name).joints)} joints"
        title = "one pose a call" if count == 1 else f"{count:,} poses a call"
        work = _work(subject, name, title, group)
        solvers = CALLS if subject == "kinematics" else (COMPILED, PINOCCHIO, MUJOCO)
        for solver in (solver for solver in solvers if solver not in ABSENT):
            call = partial(timed_call, subject, solver, name, count)
            yield TimedCase(work, solver, call, count)


def timed_call(subject: str, solver: str, name: str, count: int) -> Callable[[], Any]:
    """Return the work of random poses: our compiled call takes a batch at once, others loop."""
    bench_robot = robot(name)
    q = bench_robot.draw(np.random.default_rng(0), POSES)[:count]
    if solver == PINOCCHIO:
        q = np.array([to_pinocchio(bench_robot, row) for row in q])
    call = CALLS[solver](bench_robot)[subject]
    if count == 1:
        return partial(call, q[0])
    return partial(call, q) if solver == COMPILED else lambda: [*map(call, q)]


def our_calls(bench_robot: BenchRobot, is_prepared: bool = False) -> Calls:
    """Return our forward kinematics of all links, and our Jacobian of the first effector."""
    model = (urdf.parse if bench_robot.is_chain else mjcf.parse)(bench_robot.text).articulation
    return {
        "kinematics": prepare(model) if is_prepared else partial(forward_kinematics, model),
        "jacobians": partial(jacobian, model, effector=model.index(bench_robot.effectors[0])),
    }


def pinocchio_calls(bench_robot: BenchRobot) -> Calls:
    """Return Pinocchio's forward kinematics of all frames, and its Jacobian."""
    import pinocchio

    model, axes = pinocchio_model(bench_robot), pinocchio.LOCAL_WORLD_ALIGNED
    data, frame = model.createData(), model.getFrameId(bench_robot.effectors[0])
    return {
        "kinematics": partial(pinocchio.framesForwardKinematics, model, data),
        "jacobians": lambda q: pinocchio.computeFrameJacobian(model, data, q, frame, axes),
    }


def mujoco_calls(bench_robot: BenchRobot) -> Calls:
    """Return MuJoCo's forward kinematics, and its Jacobian, in the same memory every time."""
    model = mujoco_model(bench_robot)
    data, body = mujoco.MjData(model), model.body(bench_robot.effectors[0]).id
    J = np.empty((6, model.nv))
    linear, angular = J[:3], J[3:]

    def forward(q: FloatArray) -> Any:
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        return data

    def derivative(q: FloatArray) -> FloatArray:
        forward(q)
        mujoco.mj_comPos(model, data)
        mujoco.mj_jacBody(model, data, linear, angular, body)
        return J

    return {"kinematics": forward, "jacobians": derivative}


CALLS: dict[str, Callable[[BenchRobot], Calls]] = {
    COMPILED: our_calls,
    PREPARED: partial(our_calls, is_prepared=True),
    PINOCCHIO: pinocchio_calls,
    MUJOCO: mujoco_calls,
}


def ik_cases() -> Iterator[TimedCase]:
    """Yield our solvers in all forms, and a Python loop on three kinematics."""
    for stratum in STRATA:
        for solver in IK_SOLVERS:
            work = _solves(stratum, solver)
            single = partial(single_solves, stratum, solver)
            yield TimedCase(work, COMPILED, partial(single, TARGETS), TARGETS)
            prepared = partial(prepared_solves, stratum, solver)
            yield TimedCase(work, PREPARED, prepared, TARGETS)
            yield TimedCase(
                work, PLAIN, partial(single, FEW_TARGETS), FEW_TARGETS, backend="python"
            )
            calls = f"{TARGETS} targets a call"
            batch = work._replace(problem=f"{work.problem}/{calls}", title=f"{work.title}, {calls}")
            yield TimedCase(batch, COMPILED, partial(batch_solve, stratum, solver), TARGETS)
        for name in KINEMATICS:
            yield TimedCase(
                _solves(stratum, LOOP), name, partial(loop_solves, stratum, name), TARGETS
            )


def _solves(stratum: str, solver: str) -> TimedWork:
    return TimedWork(f"ik/{stratum}/{solver}", "ik", stratum, catalogue.find(solver).label)


def single_solves(stratum: str, solver: str, count: int) -> Callable[[], Any]:
    """Return a call that solves the first targets, each by its own call."""
    problem = chain_targets(stratum, TARGETS)
    solve = partial(solve_ik, problem.skeleton, solver=solver, **LIMITS)
    return one_by_one(solve, problem.starts[:count], problem.targets[:count])


def one_by_one(
    solve: Callable[..., Any], starts: FloatArray, targets: FloatArray
) -> Callable[[], Any]:
    """Return a call that solves each target from its start."""
    pairs = list(zip(starts, targets, strict=True))

    def run() -> None:
        for start, target in pairs:
            solve(start, target)

    return run


def prepared_solves(stratum: str, solver: str) -> Callable[[], Any]:
    """Return a call that solves all targets, each into the same arrays."""
    problem = chain_targets(stratum, TARGETS)
    solve = prepare_ik(problem.skeleton, solver, **LIMITS)
    return one_by_one(solve, problem.starts, problem.targets)


def batch_solve(stratum: str, solver: str) -> Callable[[], Any]:
    """Return a call that solves all targets as a batch."""
    problem = chain_targets(stratum, TARGETS)
    batch = (problem.skeleton, problem.starts, problem.targets, solver)
    return partial(solve_ik, *batch, **LIMITS)


def loop_solves(stratum: str, name: str) -> Callable[[], Any]:
    """Return a call that solves all targets by Levenberg-Marquardt on named kinematics."""
    problem = chain_targets(stratum, TARGETS)
    engine: Any = KINEMATICS[name](problem.skeleton)
    limits = {"effector": problem.skeleton.joint_count - 1, **LIMITS}
    solve = partial(levenberg_marquardt, engine, **limits)
    return one_by_one(solve, coordinates(engine, problem.starts), problem.targets)


def cloth_cases() -> Iterator[TimedCase]:
    """Yield a frame of 1/60 s by four methods, at two stiffnesses, and of a larger cloth."""
    for factor in FACTORS:
        problem = cloth_swing(factor)
        name, group = f"x{factor:g}", f"stiffness × {factor:g}"
        for title, (reference, engines) in WORKS.items():
            work = _work("cloth", name, title, group)
            yield TimedCase(work, COMPILED, partial(reference, problem))
            yield TimedCase(work, PLAIN, partial(reference, problem), backend="python")
            for solver, engine in engines.items():
                error = partial(step_error, engine, problem) if len(engines) > 1 else None
                yield TimedCase(work, solver, partial(engine, problem), error=error)
        yield solving(_work("cloth", name, LOCAL_GLOBAL, group), problem)
    large, group = cloth_swing(1, LARGE), f"{LARGE} × {LARGE} particles"
    work = _work("cloth", group, LOCAL_GLOBAL)
    yield TimedCase(work, COMPILED, partial(local_global, large))
    yield solving(work, large)


def stepping(problem: ClothSwing, **settings: Any) -> Callable[[], Any]:
    """Return a step of implicit Euler, factorised beforehand."""
    integrator = ImplicitEuler(problem.system, h=problem.h, **settings)
    return partial(integrator.step, moving(problem))


def substeps(problem: ClothSwing) -> Callable[[], Any]:
    """Return a frame of explicit substeps."""
    start, h = moving(problem), problem.h / SUBSTEPS
    return partial(symplectic_euler, problem.system, start, h, steps=SUBSTEPS)


def mujoco_steps(
    problem: ClothSwing, integrator: str, count: int, is_tight: bool = False
) -> Callable[[], MujocoMassSpring]:
    """Return a frame of MuJoCo's steps, from and to its own state, without conversions.

    Tolerance and iterations are MuJoCo's defaults, or the cross-check's.
    """
    engine = MujocoMassSpring(problem.system, h=problem.h / count, integrator=integrator)
    option = engine.model.opt
    option.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    if not is_tight:
        option.tolerance, option.iterations = DEFAULT.tolerance, DEFAULT.iterations
    engine.write(moving(problem))
    kind = mujoco.mjtState.mjSTATE_INTEGRATION
    start = np.empty(mujoco.mj_stateSize(engine.model, kind))
    mujoco.mj_getState(engine.model, engine.data, start, kind)

    def run() -> MujocoMassSpring:
        mujoco.mj_setState(engine.model, engine.data, start, kind)
        mujoco.mj_step(engine.model, engine.data, count)
        return engine

    return run


def step_error(engine: Callable[..., Any], problem: ClothSwing) -> float:
    """Return the distance of MuJoCo's linearised step to ours relative to its length."""
    exact = stepping(problem, solver="gauss_newton")().state.positions
    start = moving(problem).positions
    distance = np.linalg.norm(engine(problem)().read().positions - exact)
    return float(distance / np.linalg.norm(start - exact))


def moving(problem: ClothSwing) -> State:
    """Return a state in mid-swing; a large cloth gets there by a few iterations a step."""
    if problem.system.particle_count <= MANY_PARTICLES:
        return converged_motion(problem)[MIDDLE]
    integrator = ImplicitEuler(
        problem.system, h=problem.h, solver="local_global", max_iterations=ITERATIONS
    )
    return motion(problem.start, MIDDLE, integrator)[-1]


def solving(work: TimedWork, problem: ClothSwing) -> TimedCase:
    """Return a copy of the bytes read by the triangular solves: L twice an iteration.

    A nonzero has eight bytes; the nonzeros of a block share indices.
    """
    factor = global_factor(problem.system, problem.h)
    assert isinstance(factor, CholeskyFactor)
    return copying(work, 8 * factor.entries, 2 * ITERATIONS)


LOCAL_GLOBAL = f"implicit Euler, {ITERATIONS} local-global iterations"
local_global: Starter = partial(
    stepping, solver="local_global", tolerance=0.0, max_iterations=ITERATIONS
)
discrete = partial(mujoco_steps, integrator="discrete", count=1)
WORKS: dict[str, tuple[Starter, dict[str, Starter]]] = {
    LOCAL_GLOBAL: (local_global, {}),
    "implicit Euler, Newton to 1e-10": (stepping, {}),
    "implicit Euler, linearised once": (
        partial(stepping, solver="gauss_newton"),
        {MUJOCO: discrete, TIGHT: partial(discrete, is_tight=True)},
    ),
    f"symplectic Euler, {SUBSTEPS} substeps": (
        substeps,
        {MUJOCO: partial(mujoco_steps, integrator="Euler", count=SUBSTEPS)},
    ),
}


def copying(work: TimedWork, size: int, passes: int) -> TimedCase:
    """Return a yardstick of memory: copies that read and write as many bytes, half and half.

    Each pass moves `size` bytes, from as near a cache as the bytes of the work.
    """

    def prepare() -> Callable[[], None]:
        source, sink = np.ones(size // 16), np.zeros(size // 16)

        def run() -> None:
            for _ in range(passes):
                np.copyto(sink, source)

        return run

    return TimedCase(work, LIMIT, prepare, moved=size * passes)


def streaming(
    work: TimedWork, read: int, write: int, *, operations: int = 1,
    cores: int | None = 1, minimum: int = 0,
) -> TimedCase:  # fmt: skip
    """Return a yardstick of memory: a compiled loop that reads and writes so many bytes.

    A processor reads memory before writing (write-allocate), which counts as moved. On several
    cores the loop is cut into slices of at least `minimum` bytes to read.
    """
    prepare = partial(_streams, read // 8, write // 8, minimum // 8)
    return TimedCase(work, LIMIT, prepare, operations, read + 2 * write, cores=cores)


def stream(source: FloatArray, sink: FloatArray) -> None:
    """Fill a sink, longer than the source: the source plus 1, then 1 to the end."""
    for i in range(len(source)):
        sink[i] = source[i] + 1.0
    for i in range(len(source), len(sink)):
        sink[i] = 1.0


_stream = Kernel(stream)


def _streams(read: int, write: int, minimum: int) -> Callable[[], Any]:
    source, sink = np.ones(read), np.zeros(write)

    def share(part: slice) -> tuple[np.ndarray, np.ndarray]:
        return source[part], sink[part.start * write // read : part.stop * write // read]

    if minimum == 0:
        return partial(_stream, source, sink)
    return partial(in_slices, _stream, read, share, minimum=minimum)
