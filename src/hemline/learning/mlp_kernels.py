"""Compiled: one layer of a small network with weights of 16 bits."""

import llvmlite.ir as ir
import numpy as np

from hemline.compiled import intrinsic, kernel, types

from .prefetch_kernels import LINE, ask_for_entry

SMALLEST_HALF = 2.0**-14
"""The smallest normal number of float16."""
HALF_SCALE = np.float32(2.0**56)
"""A normal float16 number whose bits are read as a float32 number is too small by the square of this factor."""
ROWS_PER_PASS = 4
"""Rows of weights that are added in one pass over the outputs."""

_INT32 = ir.IntType(32)


@intrinsic
def _half_as_float(typing, bits):
    """Shifts the bits of a float16 number into a float32 number.

    Reads: bits, int16.
    Returns: the number, divided by HALF_SCALE^2.
    """

    def generate(context, builder, signature, arguments):
        wide = builder.shl(builder.sext(arguments[0], _INT32), ir.Constant(_INT32, 13))
        return builder.bitcast(builder.and_(wide, ir.Constant(_INT32, 0x8FFFE000)), ir.FloatType())

    return types.float32(bits), generate


@kernel(fastmath={"reassoc", "contract", "nsz"})
def layer(weights, scale, biases, inputs, rectified, outputs_out):
    """Computes `outputs = inputs weights + biases` in float32; inputs that are zero cost nothing.

    Reads: weights (ins, outs), int16, and scale as `mlp.pack_weights` returns them; biases (outs,); inputs (ins,);
        rectified: whether negative outputs become zero.
    Writes: outputs_out (outs,).
    """
    count = 0
    live = np.zeros(inputs.shape[0] + 2 * ROWS_PER_PASS, np.int32)
    scaled = np.zeros(inputs.shape[0] + 2 * ROWS_PER_PASS, np.float32)
    for j in range(inputs.shape[0]):
        if inputs[j] != 0.0:
            live[count], scaled[count] = j, inputs[j] * HALF_SCALE
            count += 1
    for i in range(outputs_out.shape[0]):
        outputs_out[i] = 0.0
    for k in range(0, count, ROWS_PER_PASS):
        a, b, c, d = weights[live[k]], weights[live[k + 1]], weights[live[k + 2]], weights[live[k + 3]]
        for row in live[k + ROWS_PER_PASS : k + 2 * ROWS_PER_PASS]:
            for i in range(0, outputs_out.shape[0], LINE // 2):
                ask_for_entry(weights[row], i)
        p, q, r, s = scaled[k], scaled[k + 1], scaled[k + 2], scaled[k + 3]
        for i in range(outputs_out.shape[0]):
            outputs_out[i] += (
                p * _half_as_float(a[i])
                + q * _half_as_float(b[i])
                + r * _half_as_float(c[i])
                + s * _half_as_float(d[i])
            )
    for i in range(outputs_out.shape[0]):
        total = outputs_out[i] * scale + biases[i]
        outputs_out[i] = max(total, np.float32(0.0)) if rectified else total
