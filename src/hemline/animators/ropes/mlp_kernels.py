"""Compiled: one layer of a small network."""

import numpy as np

from hemline.compiled import kernel


@kernel(fastmath={"reassoc", "contract", "nsz"})
def layer(weights, biases, inputs, rectified, outputs_out):
    """`outputs = weights inputs + biases`, rectified if asked; float32 throughout."""
    # in: weights (outs, ins), biases (outs,), inputs (ins,); out: outputs_out (outs,)
    for i in range(weights.shape[0]):
        row = weights[i]
        total = np.float32(0.0)
        for j in range(inputs.shape[0]):
            total += row[j] * inputs[j]
        total += biases[i]
        outputs_out[i] = max(total, np.float32(0.0)) if rectified else total
