"""Compiled: vertices from PCA coefficients, over bases of 8 bits."""

import llvmlite.ir as ir
import numpy as np

from hemline.compiled import cgutils, intrinsic, kernel, types

from .prefetch_kernels import LINE, ask_for

BLOCK_ROWS = 96
"""Rows (vertex coordinates) in a block: 32 vertices."""

PREFETCH_PAIRS = 16
"""Pairs of columns between the one in work and the one that is prefetched."""

_INT8, _INT16, _INT32, _INT64 = (ir.IntType(bits) for bits in (8, 16, 32, 64))


@intrinsic
def _block_products(typing, block, weights, sums_out):
    """Computes sums_out[r] = sum over columns k of block[k, r] weights[k], for the rows of one block, in int32.

    This is written as vectors of the compiler because its own vectoriser multiplies bytes in 32-bit lanes. Here two
    columns lie side by side, and the sum of two 16-bit products is one instruction wherever there is one (x86:
    pmaddwd). It halves the time; the arithmetic is of integers, so the result is exact on any machine.

    Reads: block (pairs, 2 BLOCK_ROWS), int8; weights (2 pairs,), int16.
    Writes: sums_out (BLOCK_ROWS,), int32.
    """
    lanes = BLOCK_ROWS // 8
    int32x8, int32x16, int16x16 = (ir.VectorType(t, n) for t, n in ((_INT32, 8), (_INT32, 16), (_INT16, 16)))

    def number(value):
        return ir.Constant(_INT64, value)

    def indices(start, step):
        return ir.Constant(int32x8, [ir.Constant(_INT32, start + step * i) for i in range(8)])

    def generate(context, builder, signature, arguments):
        bytes_in, pairs_in, sums = (
            context.make_array(kind)(context, builder, value).data
            for kind, value in zip(signature.args, arguments, strict=True)
        )
        pairs = builder.extract_value(context.make_array(signature.args[0])(context, builder, arguments[0]).shape, 0)
        bytes_in = builder.bitcast(bytes_in, ir.VectorType(_INT8, 16).as_pointer())
        pairs_in = builder.bitcast(pairs_in, _INT32.as_pointer())
        sums = builder.bitcast(sums, int32x8.as_pointer())
        totals = [
            cgutils.alloca_once_value(builder, ir.Constant(int32x8, [ir.Constant(_INT32, 0)] * 8)) for _ in range(lanes)
        ]
        with cgutils.for_range(builder, pairs) as loop:
            pair = builder.load(builder.gep(pairs_in, [loop.index]), align=2)
            one = builder.insert_element(ir.Constant(int32x8, ir.Undefined), pair, ir.Constant(_INT32, 0))
            weight_pair = builder.shuffle_vector(one, ir.Constant(int32x8, ir.Undefined), indices(0, 0))
            weight_pair = builder.sext(builder.bitcast(weight_pair, int16x16), int32x16)
            first = builder.mul(loop.index, number(lanes))
            for line in range(0, 2 * BLOCK_ROWS, LINE):
                ask_for(
                    builder, builder.gep(bytes_in, [builder.add(first, number(lanes * PREFETCH_PAIRS + line // 16))])
                )
            for lane in range(lanes):
                at = builder.gep(bytes_in, [builder.add(first, number(lane))])
                products = builder.mul(builder.sext(builder.load(at, align=1), int32x16), weight_pair)
                none = ir.Constant(int32x16, ir.Undefined)
                even, odd = (builder.shuffle_vector(products, none, indices(start, 2)) for start in (0, 1))
                total = builder.add(builder.load(totals[lane]), builder.add(even, odd))
                builder.store(total, totals[lane])
        for lane in range(lanes):
            builder.store(builder.load(totals[lane]), builder.gep(sums, [number(lane)]), align=4)

    return types.void(block, weights, sums_out), generate


@kernel
def vertices_from_coefficients(blocks, scales, modes, coefficients, rest, transform, vertices_out):
    """Computes `vertices = R (rest + B c) + t`: coefficients to 16 bits, integer sums, then one rigid transform.

    Reads: blocks (blocks, columns / 2, 2 BLOCK_ROWS), int8; scales (columns,), float32; modes (columns,), int32;
        coefficients (modes,), float32 [m]; rest (verts, 3), float32 [m]; transform (3, 4), float32: [R | t].
    Writes: vertices_out (verts, 3), float32 [m].
    """
    columns = scales.shape[0]
    largest = np.float32(0.0)
    for k in range(columns):
        largest = max(largest, abs(coefficients[modes[k]] * scales[k]))
    unit = largest / np.float32(32767.0) if largest > 0 else np.float32(1.0)
    weights = np.empty(columns, np.int16)
    for k in range(columns):
        weights[k] = np.int16(np.rint(coefficients[modes[k]] * scales[k] / unit))
    sums = np.empty(BLOCK_ROWS, np.int32)
    count = rest.shape[0]
    for b in range(blocks.shape[0]):
        _block_products(blocks[b], weights, sums)
        first = b * (BLOCK_ROWS // 3)
        for i in range(min(BLOCK_ROWS // 3, count - first)):
            v = first + i
            x = rest[v, 0] + np.float32(sums[3 * i]) * unit
            y = rest[v, 1] + np.float32(sums[3 * i + 1]) * unit
            z = rest[v, 2] + np.float32(sums[3 * i + 2]) * unit
            for d in range(3):
                row = transform[d, 0] * x + transform[d, 1] * y + transform[d, 2] * z
                vertices_out[v, d] = row + transform[d, 3]
