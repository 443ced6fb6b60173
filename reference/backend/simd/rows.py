"""Four right-hand sides of one unknown, side by side in a vector register.

A row of an array (unknown, 4) is loaded, changed and stored whole. In the interpreter a row is an
array; compiled it is a register of four doubles, and these functions are the instructions in
`row_instructions.py`. Three right-hand sides leave the fourth at zero.
"""

from ..compiled import compiled_in

in_vector_registers = compiled_in("plumbob.reference.backend.simd.row_instructions")


@in_vector_registers
def load_row(y, i):
    """Return row i of an array (unknown, 4)."""
    return y[i].copy()


@in_vector_registers
def store_row(y, i, row):
    """Write row i of an array (unknown, 4)."""
    y[i] = row


@in_vector_registers
def scale_row(factor, row):
    """Return factor * row."""
    return factor * row


@in_vector_registers
def subtract_scaled(row, factor, other):
    """Return row - factor * other."""
    return row - factor * other


@in_vector_registers
def prefetch(values, i):
    """Bring an entry that will be read soon nearer to the processor; this changes no result.

    The index may lie outside of the array.
    """
