"""The right-hand sides of one unknown, side by side in a vector register.

A row of an array (unknown, 4) is read, changed and written whole. Here, for the plain speed, a row
is an array; compiled it is a register of four doubles, and the functions are the instructions in
`row_instructions.py`. Three right-hand sides leave the fourth at zero.
"""

from ..compiled import compiled_in

in_vector_registers = compiled_in("reference.backend.simd.row_instructions")


@in_vector_registers
def row_at(y, i):
    """Return row i of an array (unknown, 4)."""
    return y[i].copy()


@in_vector_registers
def put_row(y, i, row):
    """Write row i of an array (unknown, 4)."""
    y[i] = row


@in_vector_registers
def scaled(factor, row):
    """Return a row times a number."""
    return factor * row


@in_vector_registers
def less(row, factor, other):
    """Return a row less a number times another one."""
    return row - factor * other


@in_vector_registers
def ask_for(values, i):
    """Ask memory for an entry that will be read soon, there or not; this changes no result."""
