"""A sum of plane waves at many points."""

import math

from hemline.compiled import kernel, prange


@kernel(parallel=True)
def plane_waves(points, wave, phase, amplitude, mean, velocity_out):
    """Mean velocity plus waves.

    # model: u(x) = mean + sum over w of amplitude_w cos(wave_w . x + phase_w)
    # in:  points (n, 3) [m]; wave (waves, 3) [1/m]; phase (waves) [rad]; amplitude (waves, 3), mean (3) [m/s]
    # out: velocity (n, 3) [m/s]
    """
    for i in prange(points.shape[0]):
        u0, u1, u2 = mean[0], mean[1], mean[2]
        for w in range(wave.shape[0]):
            at = wave[w, 0] * points[i, 0] + wave[w, 1] * points[i, 1] + wave[w, 2] * points[i, 2] + phase[w]
            height = math.cos(at)
            u0 += height * amplitude[w, 0]
            u1 += height * amplitude[w, 1]
            u2 += height * amplitude[w, 2]
        velocity_out[i, 0], velocity_out[i, 1], velocity_out[i, 2] = u0, u1, u2


__all__ = ["plane_waves"]
