"""The compiled versions of the functions in `rows.py`: vectors of four doubles in LLVM's terms.

A product may be fused with the difference that it goes into, as everywhere in relaxed kernels.
"""

from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic, models, register_model

DOUBLE, INT, POINTER = ir.DoubleType(), ir.IntType(32), ir.IntType(8).as_pointer()
WIDTH = 4
VECTOR = ir.VectorType(DOUBLE, WIDTH)
DOUBLE_BYTES = 8
FUSED = ("contract",)
# The arguments of llvm.prefetch: read, keep in the nearest cache, data.
READ, NEAR, DATA = 0, 3, 1


class RowType(types.Type):
    """Four doubles side by side."""


row_type = RowType("row")


@register_model(RowType)
class RowModel(models.PrimitiveModel):
    """A row is one LLVM value."""

    def __init__(self, manager, kind):
        super().__init__(manager, kind, VECTOR)


@intrinsic
def load_row(typingctx, y, i):
    """Read four doubles."""

    def generate(context, builder, signature, arguments):
        return builder.load(_row(context, builder, signature, arguments), align=DOUBLE_BYTES)

    return row_type(_contiguous(y, 2), i), generate


@intrinsic
def store_row(typingctx, y, i, row):
    """Write four doubles."""

    def generate(context, builder, signature, arguments):
        pointer = _row(context, builder, signature, arguments)
        builder.store(arguments[2], pointer, align=DOUBLE_BYTES)
        return context.get_dummy_value()

    return types.none(_contiguous(y, 2), i, row_type), generate


@intrinsic
def scale_row(typingctx, factor, row):
    """Multiply all four."""

    def generate(context, builder, signature, arguments):
        factor, row = arguments
        return builder.fmul(_repeated(builder, factor), row)

    return row_type(types.float64, row_type), generate


@intrinsic
def subtract_scaled(typingctx, row, factor, other):
    """Multiply and subtract all four."""

    def generate(context, builder, signature, arguments):
        row, factor, other = arguments
        product = builder.fmul(_repeated(builder, factor), other, flags=FUSED)
        return builder.fsub(row, product, flags=FUSED)

    return row_type(row_type, types.float64, row_type), generate


@intrinsic
def prefetch(typingctx, values, i):
    """Prefetch; memory that is not there does no harm."""

    def generate(context, builder, signature, arguments):
        entry = _pointer(context, builder, signature, arguments[0], arguments[1])
        kind = ir.FunctionType(ir.VoidType(), [POINTER, INT, INT, INT])
        fetch = cgutils.get_or_insert_function(builder.module, kind, "llvm.prefetch.p0")
        line = builder.bitcast(entry, POINTER)
        builder.call(fetch, [line, INT(READ), INT(NEAR), INT(DATA)])
        return context.get_dummy_value()

    return types.none(_contiguous(values, 1), i), generate


def _contiguous(array, axes):
    """Return the type if it is that of a C-contiguous array of doubles with so many axes."""
    if array != types.Array(types.float64, axes, "C"):
        raise TypeError(f"expected a C-contiguous array of doubles, {axes} axes, got {array}")
    return array


def _row(context, builder, signature, arguments):
    """Return a pointer to a row of four."""
    entry = builder.mul(arguments[1], arguments[1].type(WIDTH))
    pointer = _pointer(context, builder, signature, arguments[0], entry)
    return builder.bitcast(pointer, VECTOR.as_pointer())


def _pointer(context, builder, signature, array, entry):
    """Return a pointer to an entry, counted from an array's first."""
    return builder.gep(context.make_array(signature.args[0])(context, builder, array).data, [entry])


def _repeated(builder, number):
    """Return a vector of equal numbers."""
    first = builder.insert_element(ir.Constant(VECTOR, ir.Undefined), number, INT(0))
    mask = ir.Constant(ir.VectorType(INT, WIDTH), [INT(0)] * WIDTH)
    return builder.shuffle_vector(first, first, mask)
