"""Vector registers: functions on arrays for the interpreter, and their instructions for numba."""
