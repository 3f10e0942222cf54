"""Compares sources of bones and the simulation with itself: `python -m papers.rope_chains.bones CLIPS RUNS FOLDER`.

Simulates the light cape, coarsened to a quarter of its vertices, on the clips of `models/fit.clips` in CLIPS and on all
clips in RUNS (made by `python -m hemline.models.make.runs`), and on ten clips of other people. Ropes and their
correction are fitted to the former, split by subject, and step through the latter. Besides, the ten clips are simulated
once more from a start a few frames later. Writes pages/bones.md. FOLDER keeps the takes, so that a stopped run
continues.
"""

import argparse
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hemline import garments, motions, sim
from hemline.animators.ropes import RopesConfig
from hemline.animators.ropes.bones.body_inputs import REST_INPUTS
from hemline.animators.ropes.bones.bone_correction import BoneCorrection
from hemline.animators.ropes.bones.bone_source import BoneSource
from hemline.animators.ropes.bones.bones import rest_bones
from hemline.animators.ropes.bones.chains import Ropes
from hemline.animators.ropes.fit.correction import fit_correction
from hemline.animators.ropes.fit.fit_ropes import fit_ropes
from hemline.animators.ropes.fit.frames import KeyFrames
from hemline.animators.ropes.fit.gather import TakeFrames, gather
from hemline.arrays import Float, Nodes
from hemline.bench.machine import commit, machine
from hemline.bodies import ShapedBody
from hemline.datasets import Dataset, Take, open_dataset
from hemline.garments.proxy.coarser import coarser_garment
from hemline.motions import Motion

PAGE = Path(__file__).parent / "pages" / "bones.md"
FIT_CLIPS = Path(garments.__file__).parents[1] / "models" / "fit.clips"
EXCERPTS = ("run", "walk", "jump", "turn", "kick", "dance")
OTHERS = ("daz_rig/135_04.bvh", "06_05.bvh", "01_05.bvh", "02_08.bvh")
TEST_SECONDS, LATER_FRAMES = 5, 5
"""Length of the ten clips [s], and how many frames later they start in the second simulation."""
TEXT = """\
# Bones: ropes, their correction, and a second simulation

`python -m papers.rope_chains.bones CLIPS RUNS FOLDER` wrote this page at commit {commit}, on {machine}, one
thread. The light cape, coarsened to {vertices} vertices, was simulated on {takes} takes ({frames} frames to train on),
and on ten clips of people who are not among them. Mean distance of the free bones from simulated ones over each clip
[mm].

{errors}

The part of it that is constant over the clip [mm]:

{offsets}

*Ropes*: fitted springs and damping, air and friction of the material. *Corrected by bones*: besides, the linear
correction with the motion of the body hidden from it. *Corrected*: the correction as fits make it
(`bones/bone_correction`); its strength is chosen on validation data of the fit. *Simulated again*: the simulation
itself, started {later} frames later, on the frames that both have. Part of each error is therefore chance: a method
that predicted the mean of many such simulations would still err by about 0.7 times this row, if they scatter like
normal numbers.

Fit: springs and damping {ropes_s:.0f} s, correction {correction_s:.1f} s.
"""


def clean(motion: Motion) -> Motion:
    """Returns the longest section without jumps."""
    first, end = motions.longest_clean(motion)
    return motion[first:end]


def simulated(folder: Path, clips: list[Motion], jobs: int) -> Dataset:
    """Returns takes of the coarse cape, simulated if they are missing."""
    cape, _ = coarser_garment(garments.load("cape-light"), 0.25)
    sim.produce(folder, cape, [sim.ClipRequest(clip, motions.subject_of(clip)) for clip in clips], jobs=jobs)
    return open_dataset(folder)


@dataclass(frozen=True)
class Measured:
    """Distances of bones to simulated ones in a clip [mm]."""

    whole: float
    constant: float

    @classmethod
    def of(cls, miss_m: Float[np.ndarray, "frames free 3"]) -> "Measured":
        """Measures the misses of all frames."""
        mean = np.linalg.norm(miss_m.mean(axis=0), axis=1).mean()
        return cls(1e3 * float(np.linalg.norm(miss_m, axis=2).mean()), 1e3 * float(mean))


def simulated_bones(ropes: Ropes, take: Take, body: ShapedBody) -> Float[np.ndarray, "frames nodes 3"]:
    """Returns the simulated bones of a take in the frame of the key joint [m]."""
    keys = body.transforms_of(take.motion.rotations, take.motion.translations)[0][:, ropes.key_index].astype(np.float64)
    positions = ropes.positions_on(take.vertices)
    return np.einsum("fnb,fba->fna", positions - keys[:, None, :, 3], keys[:, :, :3])


def bones_in_play(source: BoneSource, rest: Nodes, body: ShapedBody, take: Take) -> Float[np.ndarray, "frames nodes 3"]:
    """Steps a source of bones through a take; returns its bones in the frame of the key joint, lead-in included [m]."""
    state, shown = source.start(body.posed(take.motion[0])), []
    for frame in range(len(take.motion)):
        state, moved = source.step(state, body.posed(take.motion[frame]), 1 / take.motion.fps, rest)
        shown.append(rest + moved.reshape(-1, 3))
    return np.stack(shown)


def step_through(source: BoneSource, rest: Nodes, body: ShapedBody, take: Take) -> Measured:
    """Measures a source of bones that steps through a take, on the clip without the lead-in."""
    free = np.flatnonzero(source.ropes.parents >= 0)
    miss = bones_in_play(source, rest, body, take) - simulated_bones(source.ropes, take, body)
    return Measured.of(miss[take.clip_frames][:, free])


def again(ropes: Ropes, first: Take, later: Take, body: ShapedBody) -> Measured:
    """Measures a second simulation of a clip that started later."""
    free = np.flatnonzero(ropes.parents >= 0)
    one, two = (simulated_bones(ropes, take, body)[take.clip_frames][:, free] for take in (first, later))
    one = one[LATER_FRAMES:]
    count = min(len(one), len(two))
    return Measured.of(two[:count] - one[:count])


def blind(frames: KeyFrames, components: int) -> BoneCorrection:
    """Fits a correction to which the motion of the body is hidden."""
    return fit_correction(replace(frames, body=np.tile(REST_INPUTS, (len(frames.side), 1))), components)


def timed(make: Callable):
    """Returns what a function makes, and the seconds that it took."""
    began = time.perf_counter()
    made = make()
    return made, time.perf_counter() - began


def table(rows: dict[str, dict[str, Measured]], field: str) -> str:
    """Returns a Markdown table with one row for each source."""
    clips = list(next(iter(rows.values())))
    lines = ["| bones | mean | " + " | ".join(clips) + " |", "|---" * (len(clips) + 2) + "|"]
    for name, row in rows.items():
        values = [getattr(row[clip], field) for clip in clips]
        lines.append(f"| {name} | {np.mean(values):.0f} | " + " | ".join(f"{each:.0f}" for each in values) + " |")
    return "\n".join(lines)


def main() -> None:
    """Simulates, fits, measures and writes the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("clips", type=Path, help="Folder of BVH files.")
    parser.add_argument("runs", type=Path, help="Folder of the runs.")
    parser.add_argument("folder", type=Path, help="Folder for the takes.")
    parser.add_argument("--jobs", type=int, default=1, help="Number of processes that simulate.")
    options = parser.parse_args()
    fit_clips = [clean(motions.read(path)) for path in sorted(options.runs.iterdir())]
    fit_clips += [clean(motions.read(options.clips / name)) for name in FIT_CLIPS.read_text().split()]
    ten = [clean(motions.load(name)) for name in EXCERPTS] + [clean(motions.read(options.clips / n)) for n in OTHERS]
    ten = [clip[: round(TEST_SECONDS * clip.fps) + 1] for clip in ten]
    train = simulated(options.folder / "train", fit_clips, options.jobs)
    test = simulated(options.folder / "test", ten, options.jobs)
    takes = [test.take(row) for row in test.clips()]
    late = [take.motion[int(take.clip_frames[0]) + LATER_FRAMES :] for take in takes]
    late = [replace(motion, name=f"{motion.name} later") for motion in late]
    second = simulated(options.folder / "later", late, options.jobs)
    later = {row.clip: second.take(row) for row in second.clips()}

    body, config, source = train.body.shaped(train.garment.body_betas), RopesConfig(), TakeFrames.of(train)
    drape = np.ascontiguousarray(train.rest(train.garment.body_betas).vertices[0], np.float32)
    (ropes, _), ropes_s = timed(lambda: fit_ropes(source, body, drape, config, None))
    rest = rest_bones(ropes, drape, body)
    with tempfile.TemporaryDirectory() as folder:
        frames, _ = gather(source, ropes, Path(folder), mirror=True, clear=False)
        correction, correction_s = timed(lambda: fit_correction(frames, config.correction_components))
        by_bones = blind(frames, config.correction_components)
        count = int((frames.side == 0).sum())
    sources = {
        "ropes": BoneSource(ropes, correction.with_zero_output()),
        "ropes, corrected by bones": BoneSource(ropes, by_bones),
        "ropes, corrected": BoneSource(ropes, correction),
    }
    rows = {
        name: {take.motion.name: step_through(each, rest, body, take) for take in takes}
        for name, each in sources.items()
    }
    rows["simulated again"] = {
        take.motion.name: again(ropes, take, later[f"{take.motion.name} later"], body) for take in takes
    }
    page = TEXT.format(
        commit=commit(),
        machine=machine(),
        vertices=len(train.garment.vertices),
        takes=len(source.rows),
        frames=count,
        errors=table(rows, "whole"),
        offsets=table(rows, "constant"),
        later=LATER_FRAMES,
        ropes_s=ropes_s,
        correction_s=correction_s,
    )
    PAGE.write_text(page)
    print(page)


if __name__ == "__main__":
    main()
