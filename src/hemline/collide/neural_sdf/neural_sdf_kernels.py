"""Compiled: features of a point in the frames of all bones, and softplus with its derivative."""

import numpy as np

from hemline.compiled import kernel

LENGTH_SCALE = np.float32(5.0)
"""Local coordinates and distances are multiplied by this, so that they are near unit size [1/m]."""
RADIUS_SCALE = np.float32(10.0)
"""Radii are multiplied by this, so that they are near unit size [1/m]."""


@kernel(fastmath={"contract", "nsz", "reassoc"})
def bone_features(points, to_rest, starts, ends, radii, temperature, features_out, jacobians_out):
    """Computes the features that `inputs.PointInputs` documents, and their derivatives.

    Reads: points (points, 3) [m]; to_rest (joints, 3, 4); capsules: starts, ends (joints, 3) and radii (joints,) [m];
        temperature [m].
    Writes: features_out (points, 5 + 4 joints); jacobians_out (points, 5 + 4 joints, 3), skipped where it has no rows.
    """
    joints = len(radii)
    local = np.empty((joints, 3), np.float32)
    away = np.empty((joints, 3), np.float32)
    height = np.empty(joints, np.float32)
    weight = np.empty(joints, np.float32)
    mean_away = np.empty(3, np.float32)
    weights_at, middle = 3 + 3 * joints, 3 + 4 * joints
    for i in range(len(points)):
        lowest = np.float32(np.inf)
        for j in range(joints):
            along_point, along_axis = np.float32(0), np.float32(1e-12)
            for c in range(3):
                axis = ends[j, c] - starts[j, c]
                local[j, c] = to_rest[j, c, 3] - starts[j, c]
                for k in range(3):
                    local[j, c] += to_rest[j, c, k] * points[i, k]
                along_point += local[j, c] * axis
                along_axis += axis * axis
            fraction = min(max(along_point / along_axis, np.float32(0)), np.float32(1))
            squared = np.float32(1e-12)
            for c in range(3):
                away[j, c] = local[j, c] - fraction * (ends[j, c] - starts[j, c])
                squared += away[j, c] * away[j, c]
            distance = np.sqrt(squared)
            for c in range(3):
                away[j, c] /= distance
            height[j] = distance - radii[j]
            lowest = min(lowest, height[j])
        total = np.float32(0)
        for j in range(joints):
            weight[j] = np.exp((lowest - height[j]) / temperature)
            total += weight[j]
        girth = np.float32(0)
        for j in range(joints):
            weight[j] /= total
            girth += weight[j] * radii[j]
            for c in range(3):
                features_out[i, 3 + 3 * j + c] = LENGTH_SCALE * weight[j] * local[j, c]
            features_out[i, weights_at + j] = weight[j]
        for c in range(3):
            features_out[i, c] = local[0, c]
        features_out[i, middle] = LENGTH_SCALE * (lowest - temperature * np.log(total))
        features_out[i, middle + 1] = RADIUS_SCALE * girth
        if i >= len(jacobians_out):
            continue
        for k in range(3):  # directions of the world
            mean_away[k] = 0
            for j in range(joints):
                turned = np.float32(0)
                for c in range(3):
                    turned += to_rest[j, c, k] * away[j, c]
                mean_away[k] += weight[j] * turned
        for k in range(3):
            girth_change = np.float32(0)
            for j in range(joints):
                turned = np.float32(0)
                for c in range(3):
                    turned += to_rest[j, c, k] * away[j, c]
                change = weight[j] * (mean_away[k] - turned) / temperature
                for c in range(3):
                    moved = weight[j] * to_rest[j, c, k] + change * local[j, c]
                    jacobians_out[i, 3 + 3 * j + c, k] = LENGTH_SCALE * moved
                jacobians_out[i, weights_at + j, k] = change
                girth_change += change * radii[j]
            for c in range(3):
                jacobians_out[i, c, k] = to_rest[0, c, k]
            jacobians_out[i, middle, k] = LENGTH_SCALE * mean_away[k]
            jacobians_out[i, middle + 1, k] = RADIUS_SCALE * girth_change


@kernel(fastmath={"contract", "nsz", "reassoc"})
def softplus(values, slopes_out):
    """Computes log(1 + exp(100 a)) / 100 and its derivative in place, without a call, so that the loop vectorises.

    exp(-v) is a polynomial on [0, 1/2], squared five times, log(1 + t) one on [0, 1]; the error is below 1e-6 / 100.

    Reads: values (n,), float32: a.
    Writes: values, slopes_out (n,), float32.
    """
    one, half = np.float32(1), np.float32(0.5)
    for i in range(len(values)):
        a = values[i]
        v = min(abs(a) * np.float32(100 / 32), half)
        t = np.float32(-0.008132599) + v * np.float32(0.0010837822)
        t = np.float32(0.041599669) + v * t
        t = np.float32(-0.16665508) + v * t
        t = np.float32(0.49999905) + v * t
        t = np.float32(-0.99999994) + v * t
        t = one + v * t
        t = t * t
        t = t * t
        t = t * t
        t = t * t
        t = t * t
        log = np.float32(-0.029074065) + t * np.float32(0.0051261019)
        log = np.float32(0.077516086) + t * log
        log = np.float32(-0.13602248) + t * log
        log = np.float32(0.19076881) + t * log
        log = np.float32(-0.24835399) + t * log
        log = np.float32(0.33318122) + t * log
        log = np.float32(-0.49999446) + t * log
        log = np.float32(0.99999994) + t * log
        values[i] = max(a, np.float32(0)) + np.float32(0.01) * t * log
        inverse = one / (one + t)
        slopes_out[i] = inverse if a > 0 else t * inverse
