"""The problems of the bench: robots, chains, cloths, curves, their targets and evaluation."""
