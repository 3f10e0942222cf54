"""Compiled: rays of eight points at once against the faces of a leaf."""

from typing import NamedTuple

import llvmlite.ir as ir
import numpy as np

from hemline.compiled import cgutils, intrinsic, types

LANES = 8
"""Points tested at once, those of a block; also the number of faces in a leaf."""

_FLOAT, _INT64, _INT32, _INT8 = ir.FloatType(), ir.IntType(64), ir.IntType(32), ir.IntType(8)
_VECTOR, _TRUTHS, _BITS = (ir.VectorType(each, LANES) for each in (_FLOAT, ir.IntType(1), _INT32))
_ZERO, _ONE = (ir.Constant(_VECTOR, [value] * LANES) for value in (0.0, 1.0))
_MAGNITUDE = ir.Constant(_BITS, [0x7FFFFFFF] * LANES)


class ShaftLeaf(NamedTuple):
    """A leaf as rays meet it."""

    leaf: np.int64
    """Number of the leaf."""
    shaft: np.int64
    """Column of the leaf in the shafts."""
    begins: np.float32
    """Where the leaf begins along the rays [m]."""


class ShaftRays(NamedTuple):
    """Direction of the rays of a block."""

    axis: np.int64
    """Axis along the rays."""
    u: np.int64
    """First axis across."""
    v: np.int64
    """Second axis across."""
    sign: np.float32
    """1, or -1 for rays along the negative axis."""
    rounding: np.float32
    """Distance to a face within which a point is in doubt [m]."""


@intrinsic
def add_crossings_of_leaf(typing, corners, shafts, leaf, rays, box, lanes):
    """Adds the signed crossings of eight rays with the faces of a leaf.

    A ray that misses the box of the leaf crosses nothing, and faces that lie beside all rays are skipped. A face is in
    doubt if its plane may lie within rounding of the point, unless the leaf lies wholly ahead. This is written as
    vectors of the compiler because its own vectoriser works along the faces of one ray, and how many leaves a ray meets
    cannot be predicted; this takes half the time. The arithmetic is that of `winding_kernels.crossing`, without fused
    multiply-add.

    Reads: corners (leaves, 10, 8): of `LeafCorners`; shafts (5, shafts) as `ray_kernels.take_shafts` writes them [m];
        leaf: a `ShaftLeaf`; rays: `ShaftRays`; box (5,): box of all points, as `ray_kernels.block_box` returns it [m].
    Writes: lanes (4, 8): u, v and signed axis of the points [m], and their crossings so far.
    Returns: int32, bit i of which says that lane i is in doubt.
    """

    def generate(context, builder, signature, arguments):
        def pointer(place):
            return context.make_array(signature.args[place])(context, builder, arguments[place])

        leaf, shaft, begins = cgutils.unpack_tuple(builder, arguments[2])
        axis, u, v, sign, rounding = cgutils.unpack_tuple(builder, arguments[3])
        data, rows = pointer(0).data, builder.bitcast(pointer(5).data, _VECTOR.as_pointer())
        shafts, box = pointer(1), pointer(4).data
        first = builder.mul(leaf, ir.Constant(_INT64, 10 * LANES))

        def number(value):
            return ir.Constant(_INT64, value)

        def row(index):
            return builder.gep(rows, [number(index)])

        def splat(value):
            nothing = ir.Constant(_VECTOR, ir.Undefined)
            one = builder.insert_element(nothing, value, ir.Constant(_INT32, 0))
            return builder.shuffle_vector(one, nothing, ir.Constant(_BITS, [0] * LANES))

        def above(one, two):
            return builder.fcmp_ordered(">", one, two)

        def not_below(one, two):
            return builder.fcmp_ordered(">=", one, two)

        def bits(truths):
            return builder.zext(builder.bitcast(truths, _INT8), _INT32)

        def some(truths):
            return builder.icmp_unsigned("!=", bits(truths), ir.Constant(_INT32, 0))

        def coordinate(index, axis):
            """Where a coordinate of a corner of the first face is; those of the others follow it."""
            at = builder.mul(builder.add(axis, number(3 * index)), number(LANES))
            return builder.gep(data, [builder.add(first, at)])

        def range_of(axis):
            """Lowest and highest coordinate of each face."""
            each = [builder.load(builder.bitcast(coordinate(i, axis), _VECTOR.as_pointer()), align=4) for i in range(3)]
            low = high = each[0]
            for value in each[1:]:
                low = builder.select(above(low, value), value, low)
                high = builder.select(above(value, high), value, high)
            return low, high

        long, numbers = builder.extract_value(shafts.shape, 1), []
        for index in range(5):
            at = builder.add(builder.mul(long, number(index)), shaft)
            numbers.append(splat(builder.load(builder.gep(shafts.data, [at]))))
        far, low_u, high_u, low_v, high_v = numbers
        begins, signed, rounding = (splat(value) for value in (begins, sign, rounding))
        x, y, z = (builder.load(row(index), align=4) for index in range(3))
        met = not_below(far, builder.fsub(z, rounding))
        for place, low, high in ((x, low_u, high_u), (y, low_v, high_v)):
            met = builder.and_(met, not_below(builder.fadd(place, rounding), low))
            met = builder.and_(met, not_below(high, builder.fsub(place, rounding)))
        beside = builder.and_(met, builder.not_(above(begins, builder.fadd(z, rounding))))
        total = cgutils.alloca_once_value(builder, builder.load(row(3), align=4))
        doubt = cgutils.alloca_once_value(builder, ir.Constant(_TRUTHS, [0] * LANES))

        def add_face(face, *, whole):
            """Crossings with one face; `whole`: the leaf may lie beside a point, so that it matters on which side."""

            def corner(index, axis):
                return splat(builder.load(builder.gep(coordinate(index, axis), [face])))

            across = [[builder.fsub(corner(i, (u, v)[k]), (x, y)[k]) for k in range(2)] for i in range(3)]
            sides = [builder.select(above(each[1], _ZERO), _ONE, _ZERO) for each in across]
            terms, turns = [], _ZERO
            for one, two in ((0, 1), (1, 2), (2, 0)):
                product = builder.fmul(across[one][0], across[two][1])
                term = builder.fsub(product, builder.fmul(across[one][1], across[two][0]))
                up = builder.fsub(sides[two], sides[one])
                turns = builder.fadd(turns, builder.select(above(builder.fmul(up, term), _ZERO), up, _ZERO))
                terms.append(term)
            counted = met
            if whole:
                volume = _ZERO
                for i, term in ((0, terms[1]), (1, terms[2]), (2, terms[0])):
                    part = builder.fmul(term, builder.fsub(builder.fmul(signed, corner(i, axis)), z))
                    volume = builder.fadd(volume, part)
                behind = builder.not_(above(builder.fmul(volume, turns), _ZERO))
                counted = builder.and_(met, builder.not_(builder.and_(beside, behind)))
                size = builder.bitcast(builder.and_(builder.bitcast(volume, _BITS), _MAGNITUDE), _VECTOR)
                close = builder.fcmp_ordered("<=", size, corner(3, number(0)))
                builder.store(builder.or_(builder.load(doubt), close), doubt)
            builder.store(builder.fadd(builder.load(total), builder.select(counted, turns, _ZERO)), total)

        with builder.if_then(some(met)):
            lows, highs = zip(*(range_of(across) for across in (u, v)), strict=True)
            limits = [splat(builder.load(builder.gep(box, [number(i)]))) for i in range(1, 5)]
            faces = ir.Constant(_TRUTHS, [1] * LANES)
            for low, high, least, most in zip(lows, highs, limits[::2], limits[1::2], strict=True):
                faces = builder.and_(faces, builder.and_(not_below(most, low), not_below(high, least)))
            left = cgutils.alloca_once_value(builder, bits(faces))
            with builder.if_else(some(beside)) as (near_it, ahead):
                for case, whole in ((near_it, True), (ahead, False)):
                    with case:
                        again, over = (builder.append_basic_block(name) for name in ("again", "over"))
                        builder.cbranch(some(faces), again, over)
                        builder.position_at_end(again)
                        bit = builder.load(left)
                        add_face(builder.zext(builder.cttz(bit, ir.Constant(ir.IntType(1), 1)), _INT64), whole=whole)
                        bit = builder.and_(bit, builder.sub(bit, ir.Constant(_INT32, 1)))
                        builder.store(bit, left)
                        builder.cbranch(builder.icmp_unsigned("!=", bit, ir.Constant(_INT32, 0)), again, over)
                        builder.position_at_end(over)
            builder.store(builder.load(total), row(3), align=4)
        return bits(builder.and_(builder.load(doubt), beside))

    return types.int32(corners, shafts, leaf, rays, box, lanes), generate
