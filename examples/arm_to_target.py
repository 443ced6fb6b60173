"""Solve one target of an arm by all five solvers, then one that is out of reach."""

import plumbob

arm, rest = plumbob.scenes.lab_arm()
for target in ([0.3, 0.0, 0.4], [0.0, 0.0, 5.0]):
    print("target", target)
    for solver in plumbob.IK_SOLVERS:
        solution = plumbob.solve_ik(arm, rest, target, solver=solver, tolerance=1e-6)
        pose = plumbob.forward_kinematics(arm, solution.local_rotations)
        print(f"  {solver:20} {solution.outcome.name:12} tip {pose.positions[-1].round(4)}")
