"""One element of a mesh against eight others at once: which of them may be near, by sphere, motion and normal."""

from typing import NamedTuple

import llvmlite.ir as ir
import numpy as np
from jaxtyping import Float, UInt

from hemline.compiled import intrinsic, kernel, prange, types

LANES = 8
"""Elements in a block."""

ROWS = 7
"""Numbers for each: centre (3), reach, unit normal (3)."""

NOBODY = np.uint32(2**32 - 1)
"""Stands in the lanes of a block that hold no element."""

ROUNDING = 2e-6
"""Added to what each element reaches, for coordinates of 32 bits within some metres [m]."""

SURELY = np.float32(1e-5)
"""Cosine up to which unit normals of 32 bits may be more than 90 degrees apart."""

_FLOAT, _INT32, _INT8 = ir.FloatType(), ir.IntType(32), ir.IntType(8)
_VECTOR = ir.VectorType(_FLOAT, LANES)


class Lanes(NamedTuple):
    """The elements of each patch by the block: patch p has those of `elements[starts[p]:starts[p + 1]]`.

    Attributes:
        starts: Of each patch.
        elements: NOBODY fills up a patch's last block.
        blocks: Their numbers, ROWS of them, as `fill_lanes` lays them out.
    """

    starts: UInt[np.ndarray, " patches_and_one"]
    elements: UInt[np.ndarray, "blocks lanes"]
    blocks: Float[np.ndarray, "blocks rows lanes"]


@kernel(parallel=True)
def fill_lanes(frames, motion, origin, out: Lanes):
    """Lay the frames of elements out in blocks.

    # in:  frames (elements, 11) as `element_bounds` gives them; motion (patches, 4); origin: what centres count from;
    #      out.starts, out.elements
    # out: out.blocks; what an element reaches: its radius, and how far a corner may move from where the mean motion of
    #      the patch carries it. An empty lane is infinitely far
    """
    starts, elements, blocks_out = out
    for p in prange(starts.shape[0] - 1):
        for block in range(starts[p], starts[p + 1]):
            laid = blocks_out[block]
            for lane in range(LANES):
                e = elements[block, lane]
                laid[:, lane] = 0.0
                if e == NOBODY:
                    laid[0, lane] = np.inf
                    continue
                apart = normal = 0.0
                for c in range(3):
                    apart += (frames[e, 7 + c] - motion[p, c]) ** 2
                    normal += frames[e, 4 + c] ** 2
                over = 1.0 / max(normal**0.5, 1e-30)
                for c in range(3):
                    laid[c, lane], laid[4 + c, lane] = frames[e, c] - origin[c], over * frames[e, 4 + c]
                laid[3, lane] = frames[e, 3] + frames[e, 10] + apart**0.5 + ROUNDING


@intrinsic
def near_lanes(typing, blocks, block, x, y, z, reach, a, b, c, cosine):
    """Which elements of a block may come near another: bit i of the result for lane i.

    Those whose sphere touches the one about (x, y, z), and whose normal has less than that cosine with (a, b, c).
    Written as vectors of the compiler because its own vectoriser unrolls so short a loop instead; it halves the time.
    """

    def generate(context, builder, signature, arguments):
        data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
        data = builder.bitcast(data, _VECTOR.as_pointer())
        first = builder.mul(arguments[1], ir.Constant(arguments[1].type, ROWS))

        def row(number):
            at = builder.add(first, ir.Constant(arguments[1].type, number))
            return builder.load(builder.gep(data, [at]), align=4)

        def spread(value):
            nothing, everywhere = ir.Constant(_VECTOR, ir.Undefined), ir.VectorType(_INT32, LANES)
            one = builder.insert_element(nothing, value, ir.Constant(_INT32, 0))
            return builder.shuffle_vector(one, nothing, ir.Constant(everywhere, [ir.Constant(_INT32, 0)] * LANES))

        def dot(first, second):
            total = builder.fmul(first[0], second[0])
            for one, two in zip(first[1:], second[1:], strict=True):
                total = builder.fadd(total, builder.fmul(one, two, flags=("contract",)), flags=("contract",))
            return total

        *centre, reaches, p, q, r, most = (spread(value) for value in arguments[2:])
        way = [builder.fsub(row(axis), value) for axis, value in enumerate(centre)]
        reaches = builder.fadd(row(3), reaches)
        near = builder.fcmp_ordered("<=", dot(way, way), builder.fmul(reaches, reaches))
        turned = builder.fcmp_ordered("<", dot([row(4), row(5), row(6)], [p, q, r]), most)
        return builder.zext(builder.bitcast(builder.and_(near, turned), _INT8), _INT32)

    if not (isinstance(blocks, types.Array) and blocks.ndim == 3 and blocks.layout == "C"):
        return None
    return types.int32(blocks, types.intp, *[types.float32] * 8), generate


__all__ = ["LANES", "NOBODY", "ROWS", "SURELY", "Lanes", "fill_lanes", "near_lanes"]
