"""Says how much of a garment's swing can be predicted: `python -m papers.rope_chains.swing FOLDER`.

FOLDER holds the takes of `papers.rope_chains.bones`. Simulates the coarse cape on its ten test clips eight more times,
from starts in which each vertex is displaced by a millimetre. The mean of these simulations is what a perfect predictor
of the mean would show; its distance from another simulation and the power of its hem are the limits of a fit by least
squares. Corrected ropes stand beside it, fitted with several amounts of noise on their inputs. Writes pages/swing.md.
FOLDER keeps the simulations, so that a stopped run continues.
"""

import argparse
import os
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from hemline import sim
from hemline.animators.ropes import RopesConfig
from hemline.animators.ropes.bones.bone_source import BoneSource
from hemline.animators.ropes.bones.bones import rest_bones
from hemline.animators.ropes.bones.chains import Ropes
from hemline.animators.ropes.fit.correction import NOISE, fit_correction
from hemline.animators.ropes.fit.fit_ropes import fit_ropes
from hemline.animators.ropes.fit.gather import TakeFrames, gather
from hemline.arrays import Float, FramesOfVertices
from hemline.bench.machine import commit, machine
from hemline.bodies import ShapedBody
from hemline.datasets import Dataset, Take, open_dataset
from hemline.errors import SimulationFailed
from hemline.learning.key_frame import to_key_frame

from .bones import bones_in_play
from .hem import BANDS, power_by_band

PAGE = Path(__file__).parent / "pages" / "swing.md"
COUNT = 8
"""Number of simulations of each clip from displaced starts."""
DISPLACEMENT = 0.001
"""Distance by which each vertex is displaced at the start [m]."""
TEXT = """\
# Swing: what can be predicted, and what ropes show of it

`python -m papers.rope_chains.swing FOLDER` wrote this page at commit {commit}, on {machine}. The light cape, coarsened
to {vertices} vertices, was simulated on ten clips of people outside the fit, and {count} more times from starts in
which each vertex is displaced by {displacement:.0f} mm in a random direction. *Distance* is the mean distance of all
bones of the ropes from those of the first simulation [mm]. The other columns are the power of the motion of the lowest
bone of each chain in the frame of the key joint, relative to that of the first simulation: the mean over the clips of
the logarithm of the ratio, as a factor.

{table}

*Another simulation* is the mean over the {count}. *Mean of {count} simulations* is, frame by frame, the mean of their
positions: what a predictor with the least mean square error would show if the start is known to a millimetre. Where
its power is below 1, simulations that began alike have drifted apart, and no fit by least squares can keep that power.
The corrections of the last rows are fitted with noise on their inputs, relative to the deviation of each; a fit chooses
the noise with the least distance on validation data, here {chosen:g}.

Distance by clip [mm]:

{clips}
"""


def displaced(folder: Path, truth: Dataset, take: Take, body: ShapedBody, number: int) -> FramesOfVertices:
    """Returns the frames of a take simulated again from a displaced start, read from the folder if they are there."""
    path = folder / f"{take.motion.name.replace('/', '-')}-{number}.npy"
    if not path.exists():
        rest = truth.rest(truth.garment.body_betas)
        directions = np.random.default_rng(number).standard_normal(rest.vertices[0].shape)
        directions *= DISPLACEMENT / np.linalg.norm(directions, axis=1, keepdims=True)
        start = replace(rest, vertices=(rest.vertices + directions).astype(np.float32))
        made = sim.simulate(truth.garment, body, take.motion[int(take.clip_frames[0]) :], start=start)
        if made.failed:
            raise SimulationFailed(made.failed)
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=folder, suffix=".part", delete=False) as file:
            np.save(file, made.vertices[made.clip_frames])
        os.replace(file.name, path)
    return np.load(path)


def in_key(ropes: Ropes, take: Take, body: ShapedBody, frames: FramesOfVertices) -> Float[np.ndarray, "frames nodes 3"]:
    """Returns the bones on simulated frames of a clip, in the frame of the key joint [m]."""
    motion = take.motion[int(take.clip_frames[0]) :]
    keys = body.transforms_of(motion.rotations, motion.translations)[0][:, ropes.key_index].astype(np.float64)
    bones = ropes.positions_on(frames)
    return np.stack([to_key_frame(key, each) for key, each in zip(keys, bones, strict=True)])


def tips_of(ropes: Ropes) -> np.ndarray:
    """Returns the last bone of each chain."""
    return np.setdiff1d(np.flatnonzero(ropes.parents >= 0), ropes.parents)


class Row:
    """Figures of one way to move the bones, clip by clip."""

    def __init__(self, ropes: Ropes, fps: float):
        self.free, self.tips, self.fps = np.flatnonzero(ropes.parents >= 0), tips_of(ropes), fps
        self.distances: dict[str, list[float]] = {}
        self.logs: list[np.ndarray] = []

    def add(self, clip: str, shown: Float[np.ndarray, "frames nodes 3"], truth: Float[np.ndarray, "frames nodes 3"]):
        """Adds a clip, or one more simulation of it."""
        miss = np.linalg.norm((shown - truth)[:, self.free], axis=2).mean()
        self.distances.setdefault(clip, []).append(1e3 * float(miss))
        powers = [power_by_band((each - each.mean(axis=0))[:, self.tips], self.fps) for each in (shown, truth)]
        self.logs.append(np.log(np.maximum(powers[0], 1e-12)) - np.log(np.maximum(powers[1], 1e-12)))

    def by_clip(self) -> list[float]:
        """Returns the distance in each clip [mm]."""
        return [float(np.mean(values)) for values in self.distances.values()]

    def factors(self) -> np.ndarray:
        """Returns the ratio of the powers in each band, a geometric mean over the clips."""
        return np.exp(np.mean(self.logs, axis=0))


def table(rows: dict[str, Row]) -> str:
    """Returns the table of distances and powers."""
    bands = [f"{low:g} to {high:g} Hz" for low, high in BANDS]
    lines = ["| bones | distance | " + " | ".join(bands) + " |", "|---" * (len(bands) + 2) + "|"]
    for name, row in rows.items():
        powers = " | ".join(f"{each:.2f}" for each in row.factors())
        lines.append(f"| {name} | {np.mean(row.by_clip()):.0f} | {powers} |")
    return "\n".join(lines)


def clip_table(rows: dict[str, Row]) -> str:
    """Returns the table of the distances in each clip."""
    clips = list(next(iter(rows.values())).distances)
    lines = ["| bones | " + " | ".join(clips) + " |", "|---" * (len(clips) + 1) + "|"]
    lines += [f"| {name} | " + " | ".join(f"{each:.0f}" for each in row.by_clip()) + " |" for name, row in rows.items()]
    return "\n".join(lines)


def corrections(train: Dataset, body: ShapedBody) -> tuple[Ropes, dict[str, Callable], float]:
    """Fits ropes and one correction for each amount of noise; returns them, and the noise that a fit chooses."""
    config, source = RopesConfig(), TakeFrames.of(train)
    drape = np.ascontiguousarray(train.rest(train.garment.body_betas).vertices[0], np.float32)
    ropes, _ = fit_ropes(source, body, drape, config, None)
    with tempfile.TemporaryDirectory() as folder:
        frames, _ = gather(source, ropes, Path(folder), mirror=True, clear=False)
        made = {noise: fit_correction(frames, config.correction_components, (noise,)) for noise in sorted(NOISE)}
        chosen = fit_correction(frames, config.correction_components)
    same = [noise for noise, each in made.items() if np.array_equal(each.matrix, chosen.matrix)]
    sources = {"ropes": BoneSource(ropes, chosen.with_zero_output())}
    sources |= {f"ropes, corrected, noise {noise:g}": BoneSource(ropes, each) for noise, each in made.items()}
    return ropes, sources, same[0]


def main() -> None:
    """Simulates, fits, measures and writes the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="Folder of the takes.")
    options = parser.parse_args()
    train, test = (open_dataset(options.folder / name) for name in ("train", "test"))
    body = train.body.shaped(train.garment.body_betas)
    takes = [test.take(row) for row in test.clips()]
    again = {}
    for take in takes:
        again[take.motion.name] = [
            displaced(options.folder / "swing", test, take, body, number) for number in range(1, COUNT + 1)
        ]
        print(f"{take.motion.name}: simulated", flush=True)
    ropes, sources, chosen = corrections(train, body)
    drape = np.ascontiguousarray(train.rest(train.garment.body_betas).vertices[0], np.float32)
    rest = rest_bones(ropes, drape, body)
    names = ("another simulation", f"mean of {COUNT} simulations", *sources)
    rows = {name: Row(ropes, takes[0].motion.fps) for name in names}
    for take in takes:
        clip = take.motion.name
        truth = in_key(ropes, take, body, take.vertices[take.clip_frames])
        others = [in_key(ropes, take, body, frames) for frames in again[clip]]
        for other in others:
            rows[names[0]].add(clip, other, truth)
        rows[names[1]].add(clip, np.mean(others, axis=0), truth)
        for name, source in sources.items():
            rows[name].add(clip, bones_in_play(source, rest, body, take)[take.clip_frames], truth)
    page = TEXT.format(
        commit=commit(),
        machine=machine(),
        vertices=len(test.garment.vertices),
        count=COUNT,
        displacement=1e3 * DISPLACEMENT,
        table=table(rows),
        chosen=chosen,
        clips=clip_table(rows),
    )
    PAGE.write_text(page)
    print(page)


if __name__ == "__main__":
    main()
