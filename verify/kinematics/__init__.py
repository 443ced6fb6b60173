"""Judge forward and inverse kinematics, tracking and resampling: cases, laws and faults."""
