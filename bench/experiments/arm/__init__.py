"""The lab's arm: curves drawn by its effector, and targets out of reach."""
