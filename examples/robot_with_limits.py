"""Build a robot of hinges with limits and reach a full pose, position and rotation."""

import numpy as np

from plumbob import Articulation, Skeleton, Target, forward_kinematics, solve_ik

parents = [-1, 0, 1, 2, 3, 4, 5]
heights = [0.2, 0.15, 0.3, 0.25, 0.2, 0.15, 0.1]  # metres between the joints
links = Skeleton(parents, [[0.0, 0.0, height] for height in heights])
axes = [[0, 0, 1], [0, 1, 0], [0, 0, 1], [0, 1, 0], [0, 0, 1], [0, 1, 0], [0, 0, 1]]
robot = Articulation(links, "hinge", axes=axes, lower=-2.5, upper=2.5)

there = np.array([0.3, 0.8, -0.4, 1.1, 0.2, 0.9, -0.5])  # any pose within the limits
wanted = forward_kinematics(robot, there)
target = Target(position=wanted.positions[-1], rotation=wanted.rotations[-1])
solution = solve_ik(
    robot, robot.neutral(), target, solver="levenberg_marquardt", tolerance=1e-9, restarts=20
)
print(solution.outcome.name, "after", solution.iterations, "iterations")
print("coordinates", np.round(solution.coordinates, 4), "within 2.5 either side")
