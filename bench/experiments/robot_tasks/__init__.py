"""Tasks of arms beyond the pose of the effector: success and time of each solver."""

# The task of records.
ROBOT_TASK = "robot task"
TOLERANCE = 1e-3  # [m], [rad]
