"""The rays of eight points at once against the faces of a leaf, compiled."""

import llvmlite.ir as ir

from hemline.compiled import cgutils, intrinsic, types

LANES = 8
"""Points at once: those of a block."""

_FLOAT, _INT32, _INT8 = ir.FloatType(), ir.IntType(32), ir.IntType(8)
_VECTOR, _TRUTHS = ir.VectorType(_FLOAT, LANES), ir.VectorType(ir.IntType(1), LANES)
_ZERO, _ONE = (ir.Constant(_VECTOR, [value] * LANES) for value in (0.0, 1.0))
_PLUS_MINUS = ir.Constant(ir.VectorType(_INT32, LANES), [0x7FFFFFFF] * LANES)


@intrinsic
def add_crossings_of_leaf(typing, corners, leaf, axis, u, v, sign, near, far, low_u, high_u, low_v, high_v, rounding, lanes):
    """Add the signed crossings of eight rays with the faces of a leaf; bit i of the result: that of lane i is in doubt.

    A ray that misses the box of the leaf crosses nothing. In doubt are faces whose plane may lie within rounding of the
    point, unless the leaf lies wholly ahead. Written as vectors of the compiler because its own vectoriser works along
    the faces of one ray, and how many leaves a ray meets is not to be foreseen; this has no branch, and takes less than
    half the time. The arithmetic is that of `winding_kernels.crossing`, without fused multiply-add.
    """
    # in: corners (leaves,10,8); leaf; axis, u, v, sign: which way rays go; near, far: where the box begins and ends
    #     along it, low_u .. high_v: and across; rounding [m]; in and out: lanes (4,8): u, v and signed axis of the
    #     points, and their crossings so far

    def generate(context, builder, signature, arguments):
        data, rows = (
            context.make_array(signature.args[i])(context, builder, arguments[i]).data for i in (0, len(arguments) - 1)
        )
        rows = builder.bitcast(rows, _VECTOR.as_pointer())

        def number(value):
            return ir.Constant(arguments[1].type, value)

        def row(index):
            return builder.gep(rows, [number(index)])

        def spread(value):
            nothing = ir.Constant(_VECTOR, ir.Undefined)
            one = builder.insert_element(nothing, value, ir.Constant(_INT32, 0))
            return builder.shuffle_vector(one, nothing, ir.Constant(_PLUS_MINUS.type, [0] * LANES))

        def above(one, two):
            return builder.fcmp_ordered(">", one, two)

        signed, near, far, low_u, high_u, low_v, high_v, rounding = (spread(each) for each in arguments[5:13])
        x, y, z = (builder.load(row(index), align=4) for index in range(3))
        met = builder.fcmp_ordered(">=", far, builder.fsub(z, rounding))
        for place, low, high in ((x, low_u, high_u), (y, low_v, high_v)):
            met = builder.and_(met, builder.fcmp_ordered("<=", low, builder.fadd(place, rounding)))
            met = builder.and_(met, builder.fcmp_ordered(">=", high, builder.fsub(place, rounding)))
        ahead = above(near, builder.fadd(z, rounding))
        total = cgutils.alloca_once_value(builder, builder.load(row(3), align=4))
        doubt = cgutils.alloca_once_value(builder, ir.Constant(_TRUTHS, [0] * LANES))
        first = builder.mul(arguments[1], number(10 * LANES))
        with cgutils.for_range(builder, number(LANES)) as loop:

            def corner(index, way):
                at = builder.add(builder.mul(builder.add(way, number(3 * index)), number(LANES)), loop.index)
                return spread(builder.load(builder.gep(data, [builder.add(first, at)])))

            def edge(one, two):
                return builder.fsub(
                    builder.fmul(across[one][0], across[two][1]), builder.fmul(across[one][1], across[two][0])
                )

            across = [
                [builder.fsub(corner(i, way), place) for way, place in zip(arguments[3:5], (x, y), strict=True)]
                for i in range(3)
            ]
            sides = [builder.select(above(each[1], _ZERO), _ONE, _ZERO) for each in across]
            terms, turns = [], _ZERO
            for one, two in ((0, 1), (1, 2), (2, 0)):
                term, up = edge(one, two), builder.fsub(sides[two], sides[one])
                terms.append(term)
                turns = builder.fadd(turns, builder.select(above(builder.fmul(up, term), _ZERO), up, _ZERO))
            volume = None
            for i, term in ((0, terms[1]), (1, terms[2]), (2, terms[0])):
                part = builder.fmul(term, builder.fsub(builder.fmul(signed, corner(i, arguments[2])), z))
                volume = part if volume is None else builder.fadd(volume, part)
            counts = builder.or_(ahead, above(builder.fmul(volume, turns), _ZERO))
            counted = builder.select(builder.and_(met, counts), turns, _ZERO)
            builder.store(builder.fadd(builder.load(total), counted), total)
            size = builder.bitcast(builder.and_(builder.bitcast(volume, _PLUS_MINUS.type), _PLUS_MINUS), _VECTOR)
            close = builder.fcmp_ordered("<=", size, corner(3, number(0)))
            builder.store(builder.or_(builder.load(doubt), close), doubt)
        builder.store(builder.load(total), row(3), align=4)
        asked = builder.and_(met, builder.not_(ahead))
        return builder.zext(builder.bitcast(builder.and_(builder.load(doubt), asked), _INT8), _INT32)

    return types.int32(corners, types.intp, types.intp, types.intp, types.intp, *[types.float32] * 8, lanes), generate
