"""Tests one mesh element against eight others at once, by sphere, motion and normal, for whether they may be near."""

from typing import NamedTuple

import llvmlite.ir as ir
import numpy as np
from jaxtyping import Float, UInt

from hemline.compiled import intrinsic, kernel, prange, types

LANES = 8
"""Elements in a block."""

ROWS = 7
"""Numbers per element: centre (3), reach, unit normal (3)."""

NOBODY = np.uint32(2**32 - 1)
"""Fills the lanes of a block that hold no element."""

ROUNDING = 2e-6
"""Added to the reach of each element for rounding of 32-bit coordinates within some metres [m]."""

SURELY = np.float32(1e-5)
"""Cosine up to which 32-bit unit normals may be more than 90 degrees apart."""

_FLOAT, _INT32, _INT8 = ir.FloatType(), ir.IntType(32), ir.IntType(8)
_VECTOR = ir.VectorType(_FLOAT, LANES)


class Lanes(NamedTuple):
    """Elements of each patch in blocks: patch p has the blocks `elements[starts[p]:starts[p + 1]]`.

    Attributes:
        starts: First block of each patch.
        elements: Numbers of the elements; NOBODY fills a patch's last block.
        blocks: ROWS numbers for each element, written by `fill_lanes`.
    """

    starts: UInt[np.ndarray, " patches_and_one"]
    elements: UInt[np.ndarray, "blocks lanes"]
    blocks: Float[np.ndarray, "blocks rows lanes"]


@kernel(parallel=True)
def fill_lanes(frames, motion, origin, out: Lanes):
    """Writes the bounds of elements into blocks.

    Reads: frames (elements, 11): from `element_bounds`; motion (patches, 4): of `PatchBounds` [m]; origin (3,):
        reference of the centres [m]; out.starts, out.elements.
    Writes: out.blocks. The reach of an element is its radius plus the distance by which a corner may leave the mean
        motion of the patch. An empty lane is infinitely far away.
    """
    starts, elements, blocks_out = out.starts, out.elements, out.blocks
    for p in prange(starts.shape[0] - 1):
        for block in range(starts[p], starts[p + 1]):
            lanes = blocks_out[block]
            for lane in range(LANES):
                e = elements[block, lane]
                lanes[:, lane] = 0.0
                if e == NOBODY:
                    lanes[0, lane] = np.inf
                    continue
                apart = normal = 0.0
                for c in range(3):
                    apart += (frames[e, 7 + c] - motion[p, c]) ** 2
                    normal += frames[e, 4 + c] ** 2
                over = 1.0 / max(normal**0.5, 1e-30)
                for c in range(3):
                    lanes[c, lane], lanes[4 + c, lane] = frames[e, c] - origin[c], over * frames[e, 4 + c]
                lanes[3, lane] = frames[e, 3] + frames[e, 10] + apart**0.5 + ROUNDING


@intrinsic
def near_lanes(typing, blocks, block, centre, reach, normal, cosine):
    """Tests which elements of a block may come near another element.

    These are elements whose sphere touches the one about the centre, and whose normal has less than the given cosine
    with that of the other element. The code uses the compiler's vectors directly because its own vectoriser unrolls so
    short a loop instead; this halves the time.

    Reads: blocks (blocks, ROWS, LANES): of `Lanes`; block: number of the block; centre: three coordinates, float32 [m];
        reach: radius of the sphere, float32 [m]; normal: three coordinates, float32; cosine: float32.
    Returns: int32, bit i of which says that lane i may come near.
    """

    def generate(context, builder, signature, arguments):
        data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
        data = builder.bitcast(data, _VECTOR.as_pointer())
        first = builder.mul(arguments[1], ir.Constant(arguments[1].type, ROWS))

        def row(number):
            at = builder.add(first, ir.Constant(arguments[1].type, number))
            return builder.load(builder.gep(data, [at]), align=4)

        def broadcast(value):
            nothing, everywhere = ir.Constant(_VECTOR, ir.Undefined), ir.VectorType(_INT32, LANES)
            one = builder.insert_element(nothing, value, ir.Constant(_INT32, 0))
            return builder.shuffle_vector(one, nothing, ir.Constant(everywhere, [ir.Constant(_INT32, 0)] * LANES))

        def dot(first, second):
            total = builder.fmul(first[0], second[0])
            for one, two in zip(first[1:], second[1:], strict=True):
                total = builder.fadd(total, builder.fmul(one, two, flags=("contract",)), flags=("contract",))
            return total

        centre, normal = (
            [broadcast(builder.extract_value(arguments[place], axis)) for axis in range(3)] for place in (2, 4)
        )
        reaches, most = broadcast(arguments[3]), broadcast(arguments[5])
        offset = [builder.fsub(row(axis), value) for axis, value in enumerate(centre)]
        reaches = builder.fadd(row(3), reaches)
        near = builder.fcmp_ordered("<=", dot(offset, offset), builder.fmul(reaches, reaches))
        turned = builder.fcmp_ordered("<", dot([row(4), row(5), row(6)], normal), most)
        return builder.zext(builder.bitcast(builder.and_(near, turned), _INT8), _INT32)

    if not (isinstance(blocks, types.Array) and blocks.ndim == 3 and blocks.layout == "C"):
        return None
    three = types.UniTuple(types.float32, 3)
    return types.int32(blocks, types.intp, three, types.float32, three, types.float32), generate


__all__ = ["LANES", "NOBODY", "ROWS", "SURELY", "Lanes", "fill_lanes", "near_lanes"]
