"""roboplan: `SimpleIk`, damped least squares on Pinocchio, clamped to the limits, with restarts.

Its limit of time is lifted, so that the iterations end it; its generator is seeded for each target,
which its user would do for answers that can be repeated. Its own default is two restarts.
"""

from roboplan import core, simple_ik

from .protocol import Ask, BenchRobot, Forward, PoseRequest, Solve, Tolerance

GROUP, SEED, UNLIMITED = "arm", 1986, 1e6


def prepare(
    robot: BenchRobot,
    tolerance: Tolerance,
    iterations: int = 100,
    restarts: int = 0,
    step: float = 0.25,
    damping: float = 1e-3,
) -> Ask:
    """Return the solver, set up for a robot."""
    solver = simple_ik.SimpleIk(
        scene_of(robot),
        simple_ik.SimpleIkOptions(
            group_name=GROUP,
            max_iters=iterations,
            max_restarts=restarts,
            max_time=UNLIMITED,
            step_size=step,
            damping=damping,
            max_linear_error_norm=tolerance.position,
            max_angular_error_norm=tolerance.rotation,
            check_collisions=False,
        ),
    )

    def ask(request: PoseRequest) -> Solve:
        target = core.CartesianConfiguration(robot.root, robot.effectors[0], request.matrix)
        start = core.JointConfiguration(list(robot.joints), request.start)
        solution = core.JointConfiguration()

        def solve() -> bool:
            solver.setRngSeed(SEED)
            return bool(solver.solveIk(target, start, solution))

        return Solve(solve, lambda claim: (solution.positions, claim))

    return ask


def kinematics(robot: BenchRobot) -> Forward:
    """Return roboplan's forward kinematics of the effector."""
    scene, frames = scene_of(robot), (robot.effectors[0], robot.root)
    return lambda q: scene.forwardKinematics(q, *frames)


def scene_of(robot: BenchRobot) -> core.Scene:
    """Return a scene that holds the chain, its joints in a group.

    Raises:
        UnableError: if the robot is no chain.
        ValueError: if its joints are ordered otherwise.
    """
    robot.require_chain()
    scene = core.Scene(robot.name, core.loadUrdfSceneDescriptionFromXml(robot.text))
    robot.check_order("roboplan", scene.getJointNames())
    scene.addGroup(GROUP, list(robot.joints))
    return scene
