"""How the hem of a garment swings: its power by frequency, and how long it goes on after the body stops."""

import numpy as np

import hemline
from hemline.arrays import Float, FramesOfVertices
from hemline.learning.key_frame import to_key_frame
from hemline.motions.motion import Motion
from hemline.sim import SimSettings, simulate

BANDS = ((0.0, 1.0), (1.0, 2.0), (2.0, 4.0), (4.0, 8.0))
"""Frequency bands of the hem's motion [Hz]."""
BAND_NAMES = tuple(f"{low:g} to {high:g} Hz" for low, high in BANDS)
HEM_PERCENT = 10
"""Percentage of the vertices that are the hem: the lowest ones at rest."""
FROZEN_AT_S, FROZEN_S = 1.0, 4.0


def hem_of(model) -> Float[np.ndarray, " verts"]:
    """Returns whether each vertex belongs to the hem."""
    return model.rest[:, 1] <= np.percentile(model.rest[:, 1], HEM_PERCENT)


def hem_in_key(model, frames, vertices: FramesOfVertices) -> Float[np.ndarray, "frames hem 3"]:
    """Returns the hem in the frame of the key joint, less its mean over the clip [m]."""
    hem = hem_of(model)
    keys = [frame.body.transforms[model.key] for frame in frames]
    seen = np.stack([to_key_frame(key, each[hem]) for key, each in zip(keys, vertices, strict=True)])
    return seen - seen.mean(axis=0)


def power_by_band(seen: Float[np.ndarray, "frames points 3"], fps: float) -> list[float]:
    """Returns the mean power of a motion in each of `BANDS` [m^2]."""
    window = np.hanning(len(seen))[:, None, None]
    power = (np.abs(np.fft.rfft(seen * window, axis=0)) ** 2).mean(axis=(1, 2))
    at = np.fft.rfftfreq(len(seen), 1 / fps)
    return [float(power[(at >= low) & (at < high)].sum()) for low, high in BANDS]


def frozen_run() -> Motion:
    """Returns the shipped run, at 30 frames a second, which stops dead after `FROZEN_AT_S` and stays for `FROZEN_S`."""
    run = hemline.motions.load("run").resample(30)
    stop, still = round(30 * FROZEN_AT_S), round(30 * FROZEN_S)
    index = np.concatenate([np.arange(stop), np.full(still, stop)])
    return Motion(
        run.rotations[index], run.translations[index], 30.0, run.leg_length, "frozen run", run.source, run.licence
    )


def frozen_figures(model, body) -> dict[str, float]:
    """Returns how far and when the hem swings on after `frozen_run` stops, and how fast that decays.

    The figures are those of the model (`frozen_...`) and of the simulation (`frozen_truth_...`): the largest distance
    of the hem's mean from where it comes to hang [mm], when that is [s], and how long it takes until it is within a
    third (1 / e) of that for good [s].
    """
    motion = body.placed(frozen_run())
    played = np.stack([frame.vertices for frame in hemline.play(model, body, motion, fps=None, placed=True)])
    take = simulate(model.garment, body, motion, SimSettings(fps=30.0))
    hem, stop = hem_of(model), round(30 * FROZEN_AT_S)
    figures = {}
    for name, vertices in (("frozen", played), ("frozen_truth", take.vertices[~take.lead_in])):
        path = vertices[stop:, hem].mean(axis=1)
        away = np.linalg.norm(path - path[-15:].mean(axis=0), axis=1)
        lasting = np.flatnonzero(away > away.max() / np.e)
        figures |= {
            f"{name}_swing_mm": 1e3 * float(away.max()),
            f"{name}_lag_s": float(away.argmax() / 30),
            f"{name}_decay_s": float(lasting[-1] / 30),
        }
    return figures
