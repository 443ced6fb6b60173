"""What solvers are asked: robots, chains, cloths, curves, their targets and evaluation."""
