"""Products of 3 x 3 blocks and vectors: the inner loops of the solver, written in the compiler's own vectors.

A block is stored by columns, nine numbers without a gap. A vector has four numbers per vertex, the fourth of them 0.
The product of a block and a vector is one multiplication of sixteen lanes, of which the last seven are ignored; the
compiler splits it into what the processor has. The same loop written with scalars takes twice the time.
"""

from types import SimpleNamespace

import llvmlite.ir as ir
import numpy as np

from hemline.compiled import cgutils, intrinsic, types

_FLOAT, _INT32, _INT64 = ir.FloatType(), ir.IntType(32), ir.IntType(64)
_FOUR, _WIDE = ir.VectorType(_FLOAT, 4), ir.VectorType(_FLOAT, 16)
_FAST = ("contract", "nsz")

PAD = 7
"""Numbers of padding after the last block, which is read sixteen wide."""


def blocks_of(count: int) -> np.ndarray:
    """Returns an array for a number of blocks, flat, float32."""
    return np.zeros(9 * count + PAD, np.float32)


def vector_of(vertices: int) -> np.ndarray:
    """Returns an array for a vector, flat, four numbers per vertex, float32, aligned to a cache line."""
    room = np.zeros(4 * vertices + 16, np.float32)
    first = -room.ctypes.data % 64 // 4
    return room[first : first + 4 * vertices]


class _Lanes:
    """Generates operations on vectors. `data` holds the arguments: pointers, numbers, and named tuples of them."""

    def __init__(self, context, builder, signature, arguments):
        self.builder = builder
        self.data = [self._plain(context, *each) for each in zip(signature.args, arguments, strict=True)]

    def _plain(self, context, kind, value):
        if isinstance(kind, types.Array):
            return context.make_array(kind)(context, self.builder, value).data
        if isinstance(kind, types.BaseTuple):
            fields = zip(kind.fields, kind.types, cgutils.unpack_tuple(self.builder, value), strict=True)
            return SimpleNamespace(**{name: self._plain(context, *field) for name, *field in fields})
        return value if isinstance(kind, types.Float) else context.cast(self.builder, value, kind, types.int64)

    def load(self, data, index, kind=_FOUR):
        return self.builder.load(self._place(data, index, kind), align=4)

    def store(self, value, data, index):
        self.builder.store(value, self._place(data, index, _FOUR), align=4)

    def _place(self, data, index, kind):
        return self.builder.bitcast(self.builder.gep(data, [index]), kind.as_pointer())

    def entry(self, data, index):
        """Loads an unsigned index from an array."""
        return self.builder.zext(self.builder.load(self.builder.gep(data, [index])), _INT64)

    def entries(self, starts, row):
        """Loops over the entries of a row, which begin at `starts[row]`."""
        one = ir.Constant(_INT64, 1)
        begin, end = self.entry(starts, row), self.entry(starts, self.builder.add(row, one))
        return cgutils.for_range_slice(self.builder, begin, end, one)

    def times(self, index, factor: int):
        return self.builder.mul(index, ir.Constant(_INT64, factor))

    def shuffle(self, vector, lanes: list[int]):
        mask = ir.Constant(ir.VectorType(_INT32, len(lanes)), lanes)
        return self.builder.shuffle_vector(vector, ir.Constant(vector.type, ir.Undefined), mask)

    def all_lanes(self, number):
        one = self.builder.insert_element(ir.Constant(_FOUR, ir.Undefined), number, ir.Constant(_INT32, 0))
        return self.shuffle(one, [0] * 4)

    def multiply(self, a, b):
        return self.builder.fmul(a, b, flags=_FAST)

    def add(self, a, b):
        return self.builder.fadd(a, b, flags=_FAST)

    def subtract(self, a, b):
        return self.builder.fsub(a, b, flags=_FAST)

    def columns(self, blocks, block, vector):
        """Multiplies the three columns of a block, one after the other, by their numbers of a vector."""
        column = self.load(blocks, self.times(block, 9), _WIDE)
        return self.multiply(column, self.shuffle(vector, [0, 0, 0, 1, 1, 1, 2, 2, 2] + [3] * 7))

    def sum_columns(self, columns):
        x, y, z = (self.shuffle(columns, [3 * c, 3 * c + 1, 3 * c + 2, 15]) for c in range(3))
        return self.add(self.add(x, y), z)

    def three(self, vector):
        """Sets the fourth lane of a vector to 0."""
        return self.builder.insert_element(vector, ir.Constant(_FLOAT, 0.0), ir.Constant(_INT32, 3))

    def dot(self, a, b):
        products = self.multiply(a, b)
        x, y, z = (self.builder.extract_element(products, ir.Constant(_INT32, lane)) for lane in range(3))
        return self.add(self.add(x, y), z)


@intrinsic
def advance(typing, vertex, alpha, vectors, inverse):
    """Moves the solution by alpha along the search direction, then sets product = D^-1 residual.

    Reads: vertex: a slot; alpha: float32; vectors; inverse: blocks by slots.
    Writes: vectors.solution, vectors.residual, vectors.product, of that slot.
    Returns: residual . product, float32.
    """

    def generate(context, builder, signature, arguments):
        lanes = _Lanes(context, builder, signature, arguments)
        vertex, alpha, vectors, inverse = lanes.data
        at, step, solution = lanes.times(vertex, 4), lanes.all_lanes(alpha), vectors.solution
        moved = lanes.add(lanes.load(solution, at), lanes.multiply(step, lanes.load(vectors.search, at)))
        lanes.store(moved, solution, at)
        left = lanes.subtract(lanes.load(vectors.residual, at), lanes.multiply(step, lanes.load(vectors.product, at)))
        lanes.store(left, vectors.residual, at)
        eased = lanes.three(lanes.sum_columns(lanes.columns(inverse, vertex, left)))
        lanes.store(eased, vectors.product, at)
        return lanes.dot(left, eased)

    return types.float32(vertex, alpha, vectors, inverse), generate


@intrinsic
def turn(typing, vertex, cluster, beta, coarse, vectors):
    """Computes the next search direction: product + coarse + beta search.

    Reads: vertex: a slot; cluster: that of the slot; beta: float32; coarse: four numbers per cluster; vectors.
    Writes: vectors.search, of that slot.
    """

    def generate(context, builder, signature, arguments):
        lanes = _Lanes(context, builder, signature, arguments)
        vertex, cluster, beta, coarse, vectors = lanes.data
        at = lanes.times(vertex, 4)
        down = lanes.add(lanes.load(vectors.product, at), lanes.load(coarse, lanes.times(cluster, 4)))
        before = lanes.multiply(lanes.all_lanes(beta), lanes.load(vectors.search, at))
        lanes.store(lanes.add(down, before), vectors.search, at)
        return context.get_dummy_value()

    return types.void(vertex, cluster, beta, coarse, vectors), generate


@intrinsic
def row_product(typing, row, pattern, matrix, vectors):
    """Multiplies one row of the matrix by the search direction.

    The row has its diagonal block, blocks on the ring, and multiples of the unit matrix beyond it.

    Reads: row: a slot; pattern; matrix; vectors.search.
    Writes: vectors.product, of that slot.
    Returns: search . product of that slot, float32.
    """

    def generate(context, builder, signature, arguments):
        lanes = _Lanes(context, builder, signature, arguments)
        row, pattern, matrix, vectors = lanes.data
        at, vector = lanes.times(row, 4), vectors.search
        value = lanes.load(vector, at)
        near = cgutils.alloca_once_value(builder, lanes.columns(matrix.diagonal, row, value))
        beyond = cgutils.alloca_once_value(builder, ir.Constant(_FOUR, [0.0] * 4))

        def accumulate(total, more):
            builder.store(lanes.add(builder.load(total), more), total)

        with lanes.entries(pattern.ring_starts, row) as (index, _):
            neighbour = lanes.load(vector, lanes.times(lanes.entry(pattern.ring, index), 4))
            accumulate(near, lanes.columns(matrix.blocks, index, neighbour))
        with lanes.entries(pattern.far_starts, row) as (index, _):
            neighbour = lanes.load(vector, lanes.times(lanes.entry(pattern.far, index), 4))
            number = lanes.all_lanes(builder.load(builder.gep(pattern.far_bending, [index])))
            accumulate(beyond, lanes.multiply(neighbour, number))
        product = lanes.three(lanes.add(lanes.sum_columns(builder.load(near)), builder.load(beyond)))
        lanes.store(product, vectors.product, at)
        return lanes.dot(value, product)

    return types.float32(row, pattern, matrix, vectors), generate


@intrinsic
def pair_product(typing, pair, pairs, vector):
    """Computes B sum of weight vector[corner], over the four corners of a pair with its block B.

    Reads: pair: its number; pairs: `PairBlocks`; vector: by slots.
    Writes: pairs.product, of that pair.
    """

    def generate(context, builder, signature, arguments):
        lanes = _Lanes(context, builder, signature, arguments)
        pair, pairs, vector = lanes.data
        at, total = lanes.times(pair, 4), None
        for corner in range(4):
            place = builder.add(at, ir.Constant(_INT64, corner))
            value = lanes.load(vector, lanes.times(lanes.entry(pairs.corners, place), 4))
            value = lanes.multiply(value, lanes.all_lanes(builder.load(builder.gep(pairs.weights, [place]))))
            total = value if total is None else lanes.add(total, value)
        lanes.store(lanes.three(lanes.sum_columns(lanes.columns(pairs.block, pair, total))), pairs.product, at)
        return context.get_dummy_value()

    return types.void(pair, pairs, vector), generate


@intrinsic
def add_pairs(typing, row, vertex, pairs, vectors):
    """Adds the products of a vertex's pairs, each times its weight, to the product of the vertex.

    Reads: row: a slot; vertex: that in the slot; pairs: `PairBlocks`, with products; vectors.search.
    Writes: vectors.product, of that slot: increased.
    Returns: search . the sum, float32.
    """

    def generate(context, builder, signature, arguments):
        lanes = _Lanes(context, builder, signature, arguments)
        row, vertex, pairs, vectors = lanes.data
        at = lanes.times(row, 4)
        total = cgutils.alloca_once_value(builder, ir.Constant(_FOUR, [0.0] * 4))
        with lanes.entries(pairs.starts, vertex) as (index, _):
            entry = lanes.entry(pairs.entries, index)
            pair = builder.and_(entry, ir.Constant(_INT64, -4))
            weight = lanes.all_lanes(builder.load(builder.gep(pairs.weights, [entry])))
            product = lanes.multiply(weight, lanes.load(pairs.product, pair))
            builder.store(lanes.add(builder.load(total), product), total)
        added = builder.load(total)
        lanes.store(lanes.add(lanes.load(vectors.product, at), added), vectors.product, at)
        return lanes.dot(lanes.load(vectors.search, at), added)

    return types.float32(row, vertex, pairs, vectors), generate


__all__ = ["PAD", "add_pairs", "advance", "blocks_of", "pair_product", "row_product", "turn", "vector_of"]
