"""Sum of plane waves at many points."""

import math

from hemline.compiled import kernel, prange


@kernel(inline="always")
def cosine_of_turns(turns):
    """Computes a cosine to 2e-7, by a polynomial that the compiler vectorises.

    Reads: turns.
    Returns: cos(2 pi turns).
    """
    r = turns - math.floor(turns + 0.5)
    s = 39.47841760435743 * r * r
    c = 1.0 / 20922789888000.0
    c = c * s - 1.0 / 87178291200.0
    c = c * s + 1.0 / 479001600.0
    c = c * s - 1.0 / 3628800.0
    c = c * s + 1.0 / 40320.0
    c = c * s - 1.0 / 720.0
    c = c * s + 1.0 / 24.0
    c = c * s - 0.5
    return c * s + 1.0


@kernel(parallel=True, fastmath={"contract", "reassoc", "nsz"})
def plane_waves(points, wave, phase, amplitude, mean, velocity_out):
    """Computes a mean velocity plus waves at points.

    Model: u(x) = mean + sum over w of amplitude_w cos(2 pi (wave_w . x + phase_w))
    Reads: points (n, 3) [m]; wave (3, waves) [turns/m]; phase (waves,) [turns]; amplitude (3, waves), mean (3,) [m/s].
    Writes: velocity_out (n, 3) [m/s].
    """
    k0, k1, k2, a0, a1, a2 = wave[0], wave[1], wave[2], amplitude[0], amplitude[1], amplitude[2]
    for i in prange(points.shape[0]):
        x0, x1, x2 = points[i, 0], points[i, 1], points[i, 2]
        u0 = u1 = u2 = 0.0
        for w in range(phase.shape[0]):
            height = cosine_of_turns(k0[w] * x0 + k1[w] * x1 + k2[w] * x2 + phase[w])
            u0 += height * a0[w]
            u1 += height * a1[w]
            u2 += height * a2[w]
        velocity_out[i, 0], velocity_out[i, 1], velocity_out[i, 2] = mean[0] + u0, mean[1] + u1, mean[2] + u2


__all__ = ["cosine_of_turns", "plane_waves"]
