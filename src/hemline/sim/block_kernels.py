"""Rows of 3 x 3 blocks times vectors: the inner loop of the solver, written in the compiler's own vectors.

A block is stored by columns, nine numbers without a gap; a vector has four numbers a vertex, the fourth of them 0. So a
column times a number is one multiplication of four lanes, the fourth of which is not looked at, and no lane is gathered
from elsewhere. Written out as scalars the same loop takes twice the time: nine loads a block instead of three.
"""

import llvmlite.ir as ir
import numpy as np

from hemline.compiled import cgutils, intrinsic, types

_FLOAT, _INT32, _INT64 = ir.FloatType(), ir.IntType(32), ir.IntType(64)
_FOUR = ir.VectorType(_FLOAT, 4)
_FAST = ("contract", "nsz")

PAD = 3
"""Numbers to keep behind the last block: its last column is read four wide."""


def blocks_of(count: int) -> np.ndarray:
    """Room for so many blocks, flat, float32."""
    return np.zeros(9 * count + PAD, np.float32)


def vector_of(vertices: int) -> np.ndarray:
    """Room for a vector, flat, four numbers a vertex, float32."""
    return np.zeros(4 * vertices, np.float32)


class _Lanes:
    """Writes operations on vectors of four."""

    def __init__(self, context, builder, signature, arguments):
        self.builder, self.context = builder, context
        self.data = [
            context.make_array(kind)(context, builder, value).data if isinstance(kind, types.Array) else
            context.cast(builder, value, kind, types.int64)
            for kind, value in zip(signature.args, arguments, strict=True)
        ]  # fmt: skip

    def load(self, data, index):
        place = self.builder.bitcast(self.builder.gep(data, [index]), _FOUR.as_pointer())
        return self.builder.load(place, align=4)

    def store(self, value, data, index):
        place = self.builder.bitcast(self.builder.gep(data, [index]), _FOUR.as_pointer())
        last = ir.Constant(_INT32, 3)
        self.builder.store(self.builder.insert_element(value, ir.Constant(_FLOAT, 0.0), last), place, align=4)

    def entry(self, data, index):
        """An unsigned index out of an array."""
        return self.builder.zext(self.builder.load(self.builder.gep(data, [index])), _INT64)

    def times(self, index, factor: int):
        return self.builder.mul(index, ir.Constant(_INT64, factor))

    def plus(self, index, more: int):
        return self.builder.add(index, ir.Constant(_INT64, more))

    def spread(self, vector, lane: int):
        lanes = ir.Constant(ir.VectorType(_INT32, 4), [lane] * 4)
        return self.builder.shuffle_vector(vector, ir.Constant(_FOUR, ir.Undefined), lanes)

    def all_lanes(self, number):
        one = self.builder.insert_element(ir.Constant(_FOUR, ir.Undefined), number, ir.Constant(_INT32, 0))
        return self.spread(one, 0)

    def multiply(self, a, b):
        return self.builder.fmul(a, b, flags=_FAST)

    def add(self, a, b):
        return self.builder.fadd(a, b, flags=_FAST)

    def columns(self, blocks, block, vector):
        """The three columns of a block, each times its number of a vector."""
        first = self.times(block, 9)
        return [
            self.multiply(self.load(blocks, self.plus(first, 3 * lane)), self.spread(vector, lane)) for lane in range(3)
        ]

    def dot(self, a, b):
        products = self.multiply(a, b)
        x, y, z = (self.builder.extract_element(products, ir.Constant(_INT32, lane)) for lane in range(3))
        return self.add(self.add(x, y), z)


@intrinsic
def block_product(typing, blocks, block, vector, out):
    """out = B vector for one vertex and its block, both of the same number; returns vector . out, float32."""

    def generate(context, builder, signature, arguments):
        lanes = _Lanes(context, builder, signature, arguments)
        blocks, block, vector, out = lanes.data
        at = lanes.times(block, 4)
        value = lanes.load(vector, at)
        x, y, z = lanes.columns(blocks, block, value)
        product = lanes.add(lanes.add(x, y), z)
        lanes.store(product, out, at)
        return lanes.dot(value, product)

    return types.float32(blocks, block, vector, out), generate


@intrinsic
def row_product(typing, row, own, ring, ring_begin, ring_end, blocks, far, far_begin, far_end, numbers, vector, out):
    """One row of the matrix times a vector, written to `out`; returns vector . out of that row, float32.

    The row has its own block (number `row` of `own`), the blocks ring_begin:ring_end with columns in `ring`, and the
    multiples of the unit matrix far_begin:far_end with columns in `far`.
    """

    def generate(context, builder, signature, arguments):
        lanes = _Lanes(context, builder, signature, arguments)
        row, own, ring, ring_begin, ring_end, blocks, far, far_begin, far_end, numbers, vector, out = lanes.data
        at = lanes.times(row, 4)
        value = lanes.load(vector, at)
        sums = [cgutils.alloca_once_value(builder, start) for start in lanes.columns(own, row, value)]

        def accumulate(total, more):
            builder.store(lanes.add(builder.load(total), more), total)

        one = ir.Constant(_INT64, 1)
        with cgutils.for_range_slice(builder, ring_begin, ring_end, one) as (index, _):
            neighbour = lanes.load(vector, lanes.times(lanes.entry(ring, index), 4))
            for total, column in zip(sums, lanes.columns(blocks, index, neighbour), strict=True):
                accumulate(total, column)
        with cgutils.for_range_slice(builder, far_begin, far_end, one) as (index, _):
            neighbour = lanes.load(vector, lanes.times(lanes.entry(far, index), 4))
            number = lanes.all_lanes(builder.load(builder.gep(numbers, [index])))
            accumulate(sums[0], lanes.multiply(neighbour, number))
        x, y, z = (builder.load(total) for total in sums)
        product = lanes.add(lanes.add(x, y), z)
        lanes.store(product, out, at)
        return lanes.dot(value, product)

    kinds = (row, own, ring, ring_begin, ring_end, blocks, far, far_begin, far_end, numbers, vector, out)
    return types.float32(*kinds), generate


__all__ = ["PAD", "block_product", "blocks_of", "row_product", "vector_of"]
