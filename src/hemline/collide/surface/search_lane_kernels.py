"""Compiled: the vertex of the body nearest to each of eight points is searched for at once."""

import llvmlite.ir as ir
import numpy as np

from hemline.compiled import cgutils, intrinsic, kernel, types

_index = np.uintp
LANES = 8
"""Points at once, those of a block."""
POINT, SQUARED, VERTEX, ROWS = 0, 3, 4, 5
"""First row of each quantity of the lanes: points (3 rows) [m], squared distance to the nearest vertex known (1) [m^2],
and its number (1), which float32 holds exactly below 16 million; the last number is that of all rows."""

_FLOAT, _INT64, _INT32 = ir.FloatType(), ir.IntType(64), ir.IntType(32)
_VECTOR, _ORDER = ir.VectorType(_FLOAT, LANES), ir.VectorType(_INT32, LANES)


@intrinsic
def compare_vertices(typing, body, vertices, begin, end, lanes):
    """Compares vertices[begin:end] with the nearest vertex that each lane knows.

    This is written as vectors of the compiler because its own vectoriser cannot tell that the rows do not overlap; this
    takes a third of the time.

    Reads: body (body_verts, 3) [m]; vertices (corners,): numbers of vertices; begin, end (int64).
    Writes: lanes (ROWS, LANES): the rows of the squared distance and of the vertex.
    """

    def generate(context, builder, signature, arguments):
        def data(place):
            return context.make_array(signature.args[place])(context, builder, arguments[place]).data

        rows = builder.bitcast(data(4), _VECTOR.as_pointer())

        def row(index):
            return builder.gep(rows, [ir.Constant(_INT64, index)])

        def splat(value):
            nothing = ir.Constant(_VECTOR, ir.Undefined)
            one = builder.insert_element(nothing, value, ir.Constant(_INT32, 0))
            return builder.shuffle_vector(one, nothing, ir.Constant(_ORDER, [0] * LANES))

        points = [builder.load(row(POINT + axis), align=4) for axis in range(3)]
        least = cgutils.alloca_once_value(builder, builder.load(row(SQUARED), align=4))
        nearest = cgutils.alloca_once_value(builder, builder.load(row(VERTEX), align=4))
        one = ir.Constant(_INT64, 1)
        with cgutils.for_range_slice(builder, arguments[2], arguments[3], one) as (place, _):
            vertex = builder.zext(builder.load(builder.gep(data(1), [place])), _INT64)
            first, total = builder.mul(vertex, ir.Constant(_INT64, 3)), None
            for axis in range(3):
                at = builder.gep(data(0), [builder.add(first, ir.Constant(_INT64, axis))])
                away = builder.fsub(splat(builder.load(at)), points[axis])
                square = builder.fmul(away, away)
                total = square if total is None else builder.fadd(total, square)
            known = builder.load(least)
            nearer = builder.fcmp_ordered("<", total, known)
            number = splat(builder.uitofp(vertex, _FLOAT))
            builder.store(builder.select(nearer, total, known), least)
            builder.store(builder.select(nearer, number, builder.load(nearest)), nearest)
        builder.store(builder.load(least), row(SQUARED), align=4)
        builder.store(builder.load(nearest), row(VERTEX), align=4)
        return context.get_dummy_value()

    return types.none(body, vertices, types.int64, types.int64, lanes), generate


@kernel
def nearest_of_leaves(skin, leaves, count, lanes):
    """Finds the vertex of leaves[:count] nearest to each lane's point, if it is nearer than the one that is known.

    Reads: skin; leaves (leaves,); count; lanes (ROWS, LANES): the points, and a vertex known for each. A lane whose
        squared distance is 0 keeps its vertex.
    Writes: lanes: the rows of the squared distance and of the vertex.
    """
    for k in range(count):
        leaf = _index(leaves[k])
        begin, end = np.int64(skin.leaf_start[leaf]), np.int64(skin.leaf_start[leaf + _index(1)])
        compare_vertices(skin.body, skin.leaf_vertices, begin, end, lanes)
