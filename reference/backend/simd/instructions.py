"""The compiled versions of the functions in `vectors.py`, as LLVM's vectors of doubles.

LLVM maps a vector of eight to a register of AVX-512, two of AVX or four of SSE. Floating point is
as strict as for floats, with an exception: products of rows may be fused with differences, as
everywhere in relaxed kernels. Functions that read or write a row of a tile also prefetch a share of
the next tile. The processor does not foresee accesses so far apart.
"""

import operator

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.typeconv.castgraph import Conversion
from numba.extending import (
    intrinsic,
    lower_builtin,
    lower_cast,
    models,
    register_model,
    type_callable,
)

from .vectors import LANES

DOUBLE, INT, POINTER = ir.DoubleType(), ir.IntType(32), ir.IntType(8).as_pointer()
VECTOR = ir.VectorType(DOUBLE, LANES)
HALF = LANES // 2
MASK = ir.IntType(LANES)
ROW = ir.VectorType(DOUBLE, 4)
DOUBLE_BYTES, LINE_BYTES = 8, 64
FUSED = ("contract",)
INSTRUCTIONS = {
    operator.add: "fadd",
    operator.sub: "fsub",
    operator.mul: "fmul",
    operator.truediv: "fdiv",
}
# The arguments of llvm.prefetch: read or write, keep in the nearest cache, data.
READ, WRITE, NEAR, DATA = 0, 1, 3, 1


class LanesType(types.Type):
    """LANES doubles side by side; a float is converted to equal doubles."""

    def can_convert_from(self, typingctx, other):
        """Let floats convert."""
        return Conversion.safe if isinstance(other, types.Float) else None

    def unify(self, typingctx, other):
        """Give lanes as the type of a variable that is a float in some branches."""
        return self if isinstance(other, types.Float) else None


lanes = LanesType("lanes")


@register_model(LanesType)
class LanesModel(models.PrimitiveModel):
    """Lanes are an LLVM value."""

    def __init__(self, manager, kind):
        super().__init__(manager, kind, VECTOR)


@lower_cast(types.Float, LanesType)
def repeat(context, builder, kind, target, value):
    """Put a float into every lane."""
    return _repeated(builder, value, VECTOR)


def define_arithmetic(operation, instruction):
    """Let lanes be added, subtracted, multiplied or divided, by lanes or floats."""

    @type_callable(operation)
    def operands(context):
        def typed(a, b):
            if lanes in (a, b) and all(k is lanes or isinstance(k, types.Float) for k in (a, b)):
                return lanes(lanes, lanes)
            return None

        return typed

    @lower_builtin(operation, lanes, lanes)
    def lower(context, builder, signature, arguments):
        return getattr(builder, instruction)(*arguments)


for _operation, _instruction in INSTRUCTIONS.items():
    define_arithmetic(_operation, _instruction)


@type_callable(operator.neg)
def negated(context):
    """Return the typing of -a for a vector of lanes; None for other types."""
    return lambda a: lanes if a is lanes else None


@lower_builtin(operator.neg, lanes)
def negate(context, builder, signature, arguments):
    """Change all signs."""
    return builder.fneg(*arguments)


@intrinsic
def load_lanes(typingctx, scratch, j):
    """Read four lanes."""

    def generate(context, builder, signature, arguments):
        pointers = _scratch_row(context, builder, signature, arguments)
        parts = [builder.load(pointer, align=DOUBLE_BYTES) for pointer in pointers]
        return context.make_tuple(builder, signature.return_type, parts)

    return types.UniTuple(lanes, 4)(_contiguous(scratch), types.intp), generate


@intrinsic
def store_lanes(typingctx, scratch, j, value):
    """Write four lanes."""

    def generate(context, builder, signature, arguments):
        pointers = _scratch_row(context, builder, signature, arguments)
        parts = cgutils.unpack_tuple(builder, arguments[2])
        for part, pointer in zip(parts, pointers, strict=True):
            builder.store(part, pointer, align=DOUBLE_BYTES)
        return context.get_dummy_value()

    return types.none(_contiguous(scratch), types.intp, types.UniTuple(lanes, 4)), generate


@intrinsic
def load_entries(typingctx, values, s):
    """Read lanes."""

    def generate(context, builder, signature, arguments):
        entry = _pointer(context, builder, signature, *arguments)
        return builder.load(builder.bitcast(entry, VECTOR.as_pointer()), align=DOUBLE_BYTES)

    return lanes(values, types.intp), generate


@intrinsic
def gather_vectors(typingctx, x, ends, s, end):
    """Read eight rows and transpose them."""

    def generate(context, builder, signature, arguments):
        pointers = _rows_of_springs(context, builder, signature, arguments)
        rows = [builder.load(pointer, align=DOUBLE_BYTES) for pointer in pointers]
        parts = _in_lanes(builder, rows)
        return context.make_tuple(builder, signature.return_type, parts[:3])

    return types.UniTuple(lanes, 3)(_contiguous(x, 2), ends, types.intp, types.intp), generate


@intrinsic
def scatter_vectors(typingctx, x, ends, s, end, value):
    """Transpose lanes and add a row at a time: springs may share an end."""

    def generate(context, builder, signature, arguments):
        pointers = _rows_of_springs(context, builder, signature, arguments)
        zero = ir.Constant(VECTOR, [0.0] * LANES)
        rows = _in_rows(builder, [*cgutils.unpack_tuple(builder, arguments[4]), zero], HALF)
        for pointer, row in zip(pointers, rows, strict=True):
            total = builder.fadd(builder.load(pointer, align=DOUBLE_BYTES), row)
            builder.store(total, pointer, align=DOUBLE_BYTES)
        return context.get_dummy_value()

    vectors = types.UniTuple(lanes, 3)
    return types.none(_contiguous(x, 2), ends, types.intp, types.intp, vectors), generate


@intrinsic
def square_root(typingctx, value):
    """Take all roots."""

    def generate(context, builder, signature, arguments):
        kind = ir.FunctionType(VECTOR, [VECTOR])
        root = cgutils.get_or_insert_function(builder.module, kind, f"llvm.sqrt.v{LANES}f64")
        return builder.call(root, arguments)

    return lanes(lanes), generate


@intrinsic
def larger(typingctx, value, other):
    """Compare and select."""

    def generate(context, builder, signature, arguments):
        return builder.select(builder.fcmp_ordered(">=", *arguments), *arguments)

    return lanes(lanes, lanes), generate


@intrinsic
def all_within(typingctx, value, bound):
    """Compare all lanes at once; an ordered comparison with NaN is false."""

    def generate(context, builder, signature, arguments):
        value, bound = arguments
        below = builder.fcmp_ordered("<=", value, bound)
        above = builder.fcmp_ordered("<=", builder.fneg(value), bound)
        mask = builder.bitcast(builder.and_(below, above), MASK)
        return builder.icmp_unsigned("==", mask, MASK(2**LANES - 1))

    return types.boolean(lanes, lanes), generate


class RowType(types.Type):
    """Four doubles side by side."""


row_type = RowType("row")


@register_model(RowType)
class RowModel(models.PrimitiveModel):
    """A row is an LLVM value."""

    def __init__(self, manager, kind):
        super().__init__(manager, kind, ROW)


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
        return builder.fmul(_repeated(builder, factor, ROW), row)

    return row_type(types.float64, row_type), generate


@intrinsic
def subtract_scaled(typingctx, row, factor, other):
    """Multiply and subtract all four."""

    def generate(context, builder, signature, arguments):
        row, factor, other = arguments
        product = builder.fmul(_repeated(builder, factor, ROW), other, flags=FUSED)
        return builder.fsub(row, product, flags=FUSED)

    return row_type(row_type, types.float64, row_type), generate


@intrinsic
def dot_rows(typingctx, a, b):
    """Multiply all four and add the products, in pairs."""

    def generate(context, builder, signature, arguments):
        products = builder.fmul(*arguments)
        halves = [_shuffled(builder, products, products, half) for half in ((0, 1), (2, 3))]
        pair = builder.fadd(*halves)
        first, second = (builder.extract_element(pair, INT(k)) for k in (0, 1))
        return builder.fadd(first, second)

    return types.float64(row_type, row_type), generate


@intrinsic
def prefetch(typingctx, values, i):
    """Prefetch a cache line; the address may be invalid."""

    def generate(context, builder, signature, arguments):
        entry = _pointer(context, builder, signature, *arguments)
        _prefetch(builder, builder.bitcast(entry, POINTER), LINE_BYTES, READ)
        return context.get_dummy_value()

    return types.none(values, i), generate


def _reader(count):
    """Return a function that reads so many doubles of each pose and transposes them into lanes."""

    def generate(context, builder, signature, arguments):
        pointers = _tile_row(context, builder, signature, arguments, count, READ)
        rows = [builder.load(pointer, align=DOUBLE_BYTES) for pointer in pointers]
        parts = _in_lanes(
            builder, [_shuffled(builder, row, row, (0, 1, 2, count - 1)) for row in rows]
        )
        return context.make_tuple(builder, signature.return_type, parts[:count])

    def read(typingctx, tile, j):
        return types.UniTuple(lanes, count)(_contiguous(tile), types.intp), generate

    return intrinsic(read)


def _writer(count):
    """Return a function that transposes lanes and writes a number of doubles into each pose."""

    def generate(context, builder, signature, arguments):
        pointers = _tile_row(context, builder, signature, arguments, count, WRITE)
        parts = cgutils.unpack_tuple(builder, arguments[2])
        rows = _in_rows(builder, [*parts, parts[-1]][:4], count)
        for row, pointer in zip(rows, pointers, strict=True):
            builder.store(row, pointer, align=DOUBLE_BYTES)
        return context.get_dummy_value()

    def write(typingctx, tile, j, value):
        return types.none(_contiguous(tile), types.intp, types.UniTuple(lanes, count)), generate

    return intrinsic(write)


def _in_lanes(builder, rows):
    """Return the four lanes of eight rows."""
    pairs = zip(rows[:HALF], rows[HALF:], strict=True)
    return _transposed(builder, [_shuffled(builder, *pair, range(LANES)) for pair in pairs])


def _in_rows(builder, parts, count):
    """Return the eight rows of four lanes, each cut to a number of entries."""
    pairs = _transposed(builder, parts)
    begins = [(pairs[lane % HALF], lane // HALF * HALF) for lane in range(LANES)]
    return [_shuffled(builder, pair, pair, range(b, b + count)) for pair, b in begins]


def _transposed(builder, rows):
    """Transpose the lower halves of four vectors as a 4 x 4 matrix, and the upper halves."""
    low, high = (0, 8, 2, 10, 4, 12, 6, 14), (1, 9, 3, 11, 5, 13, 7, 15)
    first, last = (0, 1, 8, 9, 4, 5, 12, 13), (2, 3, 10, 11, 6, 7, 14, 15)
    a, b, c, d = rows
    ab, cd = _shuffled(builder, a, b, low), _shuffled(builder, c, d, low)
    AB, CD = _shuffled(builder, a, b, high), _shuffled(builder, c, d, high)
    whole = [(ab, cd, first), (AB, CD, first), (ab, cd, last), (AB, CD, last)]
    return [_fenced(builder, _shuffled(builder, *three)) for three in whole]


def _fenced(builder, vector):
    """Return a vector, and keep LLVM from splitting the shuffles behind it."""
    kind = ir.FunctionType(VECTOR, [VECTOR])
    name = f"llvm.arithmetic.fence.v{LANES}f64"
    return builder.call(cgutils.get_or_insert_function(builder.module, kind, name), [vector])


def _contiguous(array, axes=3):
    """Return the type of a C-contiguous array of doubles with so many axes; refuse other types."""
    if array != types.Array(types.float64, axes, "C"):
        raise TypeError(f"expected a C-contiguous array of doubles with {axes} axes, got {array}")
    return array


def _repeated(builder, number, kind):
    """Return a vector of equal numbers."""
    first = builder.insert_element(ir.Constant(kind, ir.Undefined), number, INT(0))
    return _shuffled(builder, first, first, [0] * kind.count)


def _tile_row(context, builder, signature, arguments, count, access):
    """Return pointers to row j of each pose, and prefetch a share of the next tile."""
    begin, pose_bytes = _array(context, builder, signature, arguments)
    row_bytes = count * DOUBLE_BYTES
    first = _moved(builder, begin, arguments[1], row_bytes)
    share = _moved(builder, begin, pose_bytes, LANES)
    share = _moved(builder, share, arguments[1], LANES * row_bytes)
    _prefetch(builder, share, LANES * row_bytes, access)
    row = ir.VectorType(DOUBLE, count).as_pointer()
    return [builder.bitcast(_moved(builder, first, pose_bytes, k), row) for k in range(LANES)]


def _scratch_row(context, builder, signature, arguments):
    """Return pointers to the four lanes in row j."""
    begin, row_bytes = _array(context, builder, signature, arguments)
    first = builder.bitcast(
        builder.gep(begin, [builder.mul(row_bytes, arguments[1])]), VECTOR.as_pointer()
    )
    return [builder.gep(first, [INT(c)]) for c in range(4)]


def _array(context, builder, signature, arguments):
    """Return where an array begins, and the bytes from an entry of the first axis to the next."""
    array = context.make_array(signature.args[0])(context, builder, arguments[0])
    return builder.bitcast(array.data, POINTER), cgutils.unpack_tuple(builder, array.strides)[0]


def _moved(builder, pointer, count, size):
    """Return the pointer advanced by count times size bytes."""
    return builder.gep(pointer, [builder.mul(count, count.type(size))])


def _prefetch(builder, pointer, size, access):
    """Prefetch memory for reading or writing soon; any address is allowed."""
    kind = ir.FunctionType(ir.VoidType(), [POINTER, INT, INT, INT])
    fetch = cgutils.get_or_insert_function(builder.module, kind, "llvm.prefetch.p0")
    for offset in range(0, size, LINE_BYTES):
        line = builder.gep(pointer, [INT(offset)])
        builder.call(fetch, [line, INT(access), INT(NEAR), INT(DATA)])


def _shuffled(builder, a, b, indices):
    """Return a vector of the entries of two others, taken end to end, at these indices."""
    mask = ir.Constant(ir.VectorType(INT, len(indices)), [INT(i) for i in indices])
    return builder.shuffle_vector(a, b, mask)


def _rows_of_springs(context, builder, signature, arguments):
    """Return pointers to the rows of an array at one end of eight springs."""
    s, end = arguments[2:4]
    ends = context.make_array(signature.args[1])(context, builder, arguments[1]).data
    entries = [
        builder.add(builder.mul(builder.add(s, s.type(lane)), s.type(2)), end)
        for lane in range(LANES)
    ]
    rows = [builder.load(builder.gep(ends, [entry])) for entry in entries]
    signature = types.none(signature.args[0], types.intp)
    return [_row(context, builder, signature, (arguments[0], row)) for row in rows]


def _row(context, builder, signature, arguments):
    """Return a pointer to a row of four."""
    entry = builder.mul(arguments[1], arguments[1].type(ROW.count))
    pointer = _pointer(context, builder, signature, arguments[0], entry)
    return builder.bitcast(pointer, ROW.as_pointer())


def _pointer(context, builder, signature, array, entry):
    """Return a pointer to an entry, counted from an array's first."""
    return builder.gep(context.make_array(signature.args[0])(context, builder, array).data, [entry])


load_vectors, load_quaternions = _reader(3), _reader(4)
store_vectors, store_quaternions = _writer(3), _writer(4)
