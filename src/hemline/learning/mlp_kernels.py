"""Compiled: one layer of a small network, over weights of 16 bits."""

import llvmlite.ir as ir
import numpy as np

from hemline.compiled import intrinsic, kernel, types

from .prefetch_kernels import LINE, ask_for_entry

SMALLEST = 2.0**-14
"""The smallest normal number of float16."""
LIFT = np.float32(2.0**56)
"""The bits of a normal float16 number, read as those of a float32 number, are too small by the square of this."""
TOGETHER = 4
"""Rows of weights that are added in one pass over the outputs."""

_INT32 = ir.IntType(32)


@intrinsic
def _lowered(typing, bits):
    """The float16 number of these bits (int16), divided by LIFT^2: sign, exponent and mantissa moved into place."""

    def generate(context, builder, signature, arguments):
        wide = builder.shl(builder.sext(arguments[0], _INT32), ir.Constant(_INT32, 13))
        return builder.bitcast(builder.and_(wide, ir.Constant(_INT32, 0x8FFFE000)), ir.FloatType())

    return types.float32(bits), generate


@kernel(fastmath={"reassoc", "contract", "nsz"})
def layer(weights, scale, biases, inputs, rectified, outputs_out):
    """`outputs = inputs weights + biases`, rectified if asked; float32 throughout. Zero inputs cost nothing."""
    # in: weights (ins, outs) int16 and scale as `mlp.packed` gives them, biases (outs,), inputs (ins,)
    # out: outputs_out (outs,)
    count = 0
    live = np.zeros(inputs.shape[0] + 2 * TOGETHER, np.int32)
    shares = np.zeros(inputs.shape[0] + 2 * TOGETHER, np.float32)
    for j in range(inputs.shape[0]):
        if inputs[j] != 0.0:
            live[count], shares[count] = j, inputs[j] * LIFT
            count += 1
    for i in range(outputs_out.shape[0]):
        outputs_out[i] = 0.0
    for k in range(0, count, TOGETHER):
        a, b, c, d = weights[live[k]], weights[live[k + 1]], weights[live[k + 2]], weights[live[k + 3]]
        for row in live[k + TOGETHER : k + 2 * TOGETHER]:
            for i in range(0, outputs_out.shape[0], LINE // 2):
                ask_for_entry(weights[row], i)
        p, q, r, s = shares[k], shares[k + 1], shares[k + 2], shares[k + 3]
        for i in range(outputs_out.shape[0]):
            outputs_out[i] += p * _lowered(a[i]) + q * _lowered(b[i]) + r * _lowered(c[i]) + s * _lowered(d[i])
    for i in range(outputs_out.shape[0]):
        total = outputs_out[i] * scale + biases[i]
        outputs_out[i] = max(total, np.float32(0.0)) if rectified else total
