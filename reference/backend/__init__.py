"""How kernels are run: one source compiled, on all cores, in vector registers; no mathematics."""
