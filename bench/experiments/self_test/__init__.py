"""The judge of `plumbob verify` itself: known faults and honest solvers."""
