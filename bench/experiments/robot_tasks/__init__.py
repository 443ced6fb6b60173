"""Tasks of arms beyond the pose of the effector: who meets them, and in what time."""

# The task of records.
ROBOT_TASK = "robot task"
TOLERANCE = 1e-3  # [m], [rad]
