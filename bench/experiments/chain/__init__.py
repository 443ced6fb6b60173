"""A chain of ten ball joints: accuracy and iterations of every inverse-kinematics solver."""

# What a record is about, and the stratum of targets out of reach.
CHAIN, BEYOND = "chain", "beyond"
