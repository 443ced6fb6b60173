"""Run kernels: compile them from their source, on all cores and in vector registers."""
