"""The phases of Levenberg-Marquardt with a library's own task loop."""

import numpy as np
import pinocchio as pin
import pytest

from plumbob.bench.peers.differential import PhasedReach, further_starts, reaching
from plumbob.bench.problems.evaluate import Tolerance, evaluator_of, pinocchio_model, to_pinocchio
from plumbob.bench.problems.robot_targets import robot_targets
from plumbob.bench.problems.robots import CHARACTER, UnableError, is_installed

TOLERANCE = Tolerance(1e-3, 1e-3)
needs_robots = pytest.mark.skipif(not is_installed("panda"), reason="example-robot-data is absent")


class FrameTask:
    """The error of an effector in its own frame, as pink and mink define it."""

    def __init__(self, frame):
        self.frame, self.lm_damping = frame, 0.0

    def set_target(self, target):
        self.target = target

    def compute_error(self, configuration):
        return pin.log6(configuration.pose(self.frame).actInv(self.target)).vector

    def rows(self, configuration):
        e, J = self.compute_error(configuration), configuration.jacobian(self.frame)
        return [(J, e), (np.sqrt(self.lm_damping * e @ e) * np.eye(J.shape[1]), 0.0)]


class Configuration:
    """The coordinates of an arm, kept within its limits."""

    def __init__(self, robot):
        self.robot, self.model = robot, pinocchio_model(robot)
        self.data = self.model.createData()

    def update(self, q):
        self.q = q
        pin.computeJointJacobians(self.model, self.data, to_pinocchio(self.robot, q))
        pin.updateFramePlacements(self.model, self.data)

    def integrate_inplace(self, velocity, dt):
        self.update(np.clip(self.q + dt * velocity, self.robot.lower, self.robot.upper))

    def pose(self, frame):
        return self.data.oMf[self.model.getFrameId(frame)]

    def jacobian(self, frame):
        index = self.model.getFrameId(frame)
        return pin.getFrameJacobian(self.model, self.data, index, pin.LOCAL)


def solve_ik(configuration, tasks, dt, **_):
    """Return the velocity that fits all tasks best."""
    rows = [row for task in tasks for row in task.rows(configuration)]
    A = np.vstack([matrix for matrix, _ in rows] + [1e-6 * np.eye(len(configuration.q))])
    b = np.concatenate([np.broadcast_to(e, len(J)) for J, e in rows] + [np.zeros(A.shape[1])])
    return np.linalg.lstsq(A, b, rcond=None)[0] / dt


@needs_robots
def test_phases_reach_what_one_does_not_within_the_same_iterations():
    robot, targets = evaluator_of("panda").robot, robot_targets("panda", 5)
    configuration, frame = Configuration(robot), FrameTask(robot.effectors[0])
    steps = []

    def counted(*arguments, **more):
        steps.append(arguments)
        return solve_ik(*arguments, **more)

    plain = reaching(counted, configuration, [frame], robot, TOLERANCE, 100)
    goal, starts = (robot, TOLERANCE, 100), further_starts(robot, 8)
    assert starts.shape == (7, len(robot.joints))
    assert ((robot.lower < starts) & (starts < robot.upper)).all()
    phased = PhasedReach(counted, configuration, frame, goal, starts)
    reached = {plain: 0, phased: 0}
    for i in range(targets.shape[0]):
        request = targets.request(i)
        (pose,) = request.poses
        for reach in reached:
            steps.clear()
            claim = reach([pin.SE3(pose[1], pose[0])], request.start.copy())
            assert len(steps) <= 100
            assert (
                not claim
                or np.linalg.norm(configuration.pose(frame.frame).translation - pose[0]) < 1e-3
            )
            reached[reach] += claim
    assert reached[plain] < 0.8 * targets.shape[0]
    assert reached[phased] >= reached[plain] + 5


@needs_robots
@pytest.mark.parametrize("failures", [1, 8])
def test_an_exception_ends_its_phase_only(failures):
    """The start is the first phase: with it, or all eight, the library fails at once."""
    robot = evaluator_of("panda").robot
    configuration, frame = Configuration(robot), FrameTask(robot.effectors[0])
    steps = []

    def failing(*arguments, **more):
        steps.append(arguments)
        if len(steps) <= failures:
            raise ArithmeticError(f"step {len(steps)}")
        return solve_ik(*arguments, **more)

    goal, starts = (robot, TOLERANCE, 100), further_starts(robot, 8)
    reach = PhasedReach(failing, configuration, frame, goal, starts)
    configuration.update(starts[0] + 0.1)  # near the start of the second phase
    target = configuration.pose(frame.frame).copy()
    if failures == 8:
        with pytest.raises(ArithmeticError, match="step 1"):
            reach([target], robot.lower)
    else:
        assert reach([target], robot.lower)
        assert len(steps) < 10


def test_phases_are_refused_for_a_robot_of_several_effectors():
    robot = evaluator_of(CHARACTER).robot
    with pytest.raises(UnableError):
        PhasedReach(solve_ik, None, None, (robot, TOLERANCE, 100), [])
