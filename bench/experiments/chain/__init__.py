"""A chain of ten ball joints: accuracy and iterations of every inverse-kinematics solver."""
