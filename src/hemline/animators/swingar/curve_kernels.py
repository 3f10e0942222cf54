"""Compiled exponential and hyperbolic tangent of float32 numbers, without branches, so that they run as vectors."""

import llvmlite.ir as ir
import numpy as np

from hemline.compiled import intrinsic, kernel, types

F = np.float32
_REACH = F(87.0)
_LOG2E, _LN2_HIGH, _LN2_LOW = F(1.44269504), F(0.693359375), F(-2.12194440e-4)
_EXP = (F(1.9875691500e-4), F(1.3981999507e-3), F(8.3334519073e-3), F(4.1665795894e-2), F(1.6666665459e-1), F(0.5))
_FLAT = F(7.90531110763549805)
"""Argument above which the tangent is 1 in float32."""
_ODD = tuple(
    F(c)
    for c in (
        -2.76076847742355e-16,
        2.00018790482477e-13,
        -8.60467152213735e-11,
        5.12229709037114e-08,
        1.48572235717979e-05,
        6.37261928875436e-04,
        4.89352455891786e-03,
    )
)
_EVEN = tuple(F(c) for c in (1.19825839466702e-06, 1.18534705686654e-04, 2.26843463243900e-03, 4.89352518554385e-03))


@intrinsic
def _power_of_two(typing, exponent):
    """Computes a power of two.

    Reads: exponent, int32 between -126 and 127.
    Returns: 2 to this power, float32.
    """

    def generate(context, builder, signature, arguments):
        wide = ir.IntType(32)
        biased = builder.add(arguments[0], ir.Constant(wide, 127))
        return builder.bitcast(builder.shl(biased, ir.Constant(wide, 23)), ir.FloatType())

    return types.float32(exponent), generate


@kernel(inline="always")
def exponential(x):
    """Computes the exponential, within 2 units of the last place.

    The range is reduced by powers of two; the rest is a polynomial (Cephes, `expf`).

    Reads: x, float32, clipped to -87 and 87.
    Returns: e to the power of x.
    """
    x = min(max(x, -_REACH), _REACH)
    whole = np.int32(np.floor(x * _LOG2E + F(0.5)))
    n = F(whole)
    x = x - n * _LN2_HIGH - n * _LN2_LOW
    p = _EXP[0]
    p = p * x + _EXP[1]
    p = p * x + _EXP[2]
    p = p * x + _EXP[3]
    p = p * x + _EXP[4]
    p = p * x + _EXP[5]
    return (p * x * x + x + F(1.0)) * _power_of_two(whole)


@kernel(inline="always")
def tangent(x):
    """Computes the hyperbolic tangent within 4 units of the last place, a quotient of polynomials (Eigen's `ptanh`).

    Reads: x, float32.
    Returns: its hyperbolic tangent.
    """
    x = min(max(x, -_FLAT), _FLAT)
    s = x * x
    p = _ODD[0]
    p = p * s + _ODD[1]
    p = p * s + _ODD[2]
    p = p * s + _ODD[3]
    p = p * s + _ODD[4]
    p = p * s + _ODD[5]
    p = p * s + _ODD[6]
    q = _EVEN[0]
    q = q * s + _EVEN[1]
    q = q * s + _EVEN[2]
    q = q * s + _EVEN[3]
    return x * p / q


@kernel(fastmath={"contract", "nsz"})
def fill_exponentials(values, out):
    """Computes exponentials.

    Reads: values (n,), contiguous.
    Writes: out (n,), contiguous; may be the same array.
    """
    for i in range(values.shape[0]):
        out[i] = exponential(values[i])
