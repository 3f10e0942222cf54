"""Compiled: matrix products for kernels that multiply within a parallel loop, where BLAS would start threads."""

import llvmlite.ir as ir
import numpy as np

from hemline.compiled import cgutils, intrinsic, kernel, types

LANES = 16
"""Columns in a vector."""
ROWS, COLUMNS = 6, 2 * LANES
"""Rows and columns of the product that are kept in registers."""
DEPTH = 256
"""Rows of the right factor that are copied into a panel at once; they fit the nearest cache."""

_FLOAT, _INT32, _INT64 = ir.FloatType(), ir.IntType(32), ir.IntType(64)
_VECTOR = ir.VectorType(_FLOAT, LANES)
_FIRST = ir.Constant(ir.VectorType(_INT32, LANES), [0] * LANES)
_FUSED = ("contract",)


def _make_tile(rows: int):
    """Makes the function that adds to `rows` x COLUMNS entries of a product."""

    @intrinsic
    def tile(typing, left, left_row, left_step, right, right_step, depth, out, out_row):
        """Computes `out += left right` for a tile.

        Reads: left, right: views that begin at the tile's first entries; left_row, left_step, right_step: distances in
            entries between rows of `left` and between steps along the inner axis; columns lie side by side.
        Writes: out, rows of which are out_row entries apart.
        """

        def generate(context, builder, signature, arguments):
            def pointer(place):
                return context.make_array(signature.args[place])(context, builder, arguments[place]).data

            a, b, c = pointer(0), pointer(3), pointer(6)
            a_row, a_step, b_step, depth, c_row = (arguments[place] for place in (1, 2, 4, 5, 7))

            def number(value):
                return ir.Constant(_INT64, value)

            def vector_at(base, offset):
                return builder.bitcast(builder.gep(base, [offset]), _VECTOR.as_pointer())

            def broadcast(value):
                nothing = ir.Constant(_VECTOR, ir.Undefined)
                return builder.shuffle_vector(
                    builder.insert_element(nothing, value, ir.Constant(_INT32, 0)), nothing, _FIRST
                )

            places = [(row, half) for row in range(rows) for half in range(COLUMNS // LANES)]
            targets, sums = {}, {}
            for row, half in places:
                offset = builder.add(builder.mul(c_row, number(row)), number(half * LANES))
                targets[row, half] = vector_at(c, offset)
                sums[row, half] = cgutils.alloca_once(builder, _VECTOR)
                builder.store(builder.load(targets[row, half], align=4), sums[row, half])
            with cgutils.for_range(builder, depth) as loop:
                along = builder.mul(loop.index, b_step)
                wide = [
                    builder.load(vector_at(b, builder.add(along, number(half * LANES))), align=4)
                    for half in range(COLUMNS // LANES)
                ]
                step = builder.mul(loop.index, a_step)
                for row in range(rows):
                    at = builder.add(step, builder.mul(a_row, number(row)))
                    each = broadcast(builder.load(builder.gep(a, [at])))
                    for half, right_part in enumerate(wide):
                        product = builder.fmul(each, right_part, flags=_FUSED)
                        total = builder.fadd(builder.load(sums[row, half]), product, flags=_FUSED)
                        builder.store(total, sums[row, half])
            for place in places:
                builder.store(builder.load(sums[place]), targets[place], align=4)

        return types.void(left, left_row, left_step, right, right_step, depth, out, out_row), generate

    return tile


_many_rows, _one_row = _make_tile(ROWS), _make_tile(1)


@kernel(fastmath={"contract"})
def add_product(left, right, out):
    """Computes `out += left right` in float32.

    Reads: left (n, k), which may be a transposed view; right (k, m), its columns side by side.
    Writes: out (n, m), its columns side by side.
    """
    count, depth = left.shape
    width = right.shape[1]
    row, step, out_row = left.strides[0] // 4, left.strides[1] // 4, out.strides[0] // 4
    whole, tiled = width - width % COLUMNS, count - count % ROWS
    panel = np.empty((min(depth, DEPTH), COLUMNS), np.float32)
    for column in range(0, whole, COLUMNS):
        for first in range(0, depth, DEPTH):
            deep = min(DEPTH, depth - first)
            for k in range(deep):
                for j in range(COLUMNS):
                    panel[k, j] = right[first + k, column + j]
            for i in range(0, tiled, ROWS):
                _many_rows(left[i:, first:], row, step, panel, COLUMNS, deep, out[i:, column:], out_row)
            for i in range(tiled, count):
                _one_row(left[i:, first:], row, step, panel, COLUMNS, deep, out[i:, column:], out_row)
    if whole < width:
        for i in range(count):
            for k in range(depth):
                factor = left[i, k]
                for j in range(whole, width):
                    out[i, j] += factor * right[k, j]


@kernel
def product(left, right, out):
    """Computes `out = left right` in float32.

    Reads: left (n, k), right (k, m).
    Writes: out (n, m).
    """
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            out[i, j] = np.float32(0.0)
    add_product(left, right, out)
