"""Compares constants of ropes, air and balance above all: `python -m papers.rope_chains.air CLIPS FOLDER`.

Simulates the light cape, coarsened to a quarter of its vertices, on ten clips of CLIPS (a folder of CMU BVH files), two
of them also half as fast again, and on the six shipped excerpts, of other people. Ropes with four sets of constants
start from the second frame of each excerpt and run to its end. Writes pages/air.md. FOLDER keeps the takes, so that a
stopped run continues.
"""

import argparse
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from hemline import garments, motions, sim
from hemline.animators.ropes.bones.chains import Ropes
from hemline.animators.ropes.fit.calibrate import Clip, _bone_errors, calibrate
from hemline.animators.ropes.layout.layout import build_ropes
from hemline.animators.ropes.mechanics.constants import RopeConstants
from hemline.bench.machine import commit, machine
from hemline.bodies import ShapedBody
from hemline.datasets import Dataset, open_dataset
from hemline.garments.proxy.coarser import coarser_garment
from hemline.make.clips import clean_part

PAGE = Path(__file__).parent / "pages" / "air.md"
TRAIN = (
    *("id_unverified/running_3", "id_unverified/running_1", "16_21", "10_05", "07_11", "38_02", "05_07"),
    *("daz_rig/94_04", "55_25", "13_26"),
)
FASTER = ("16_21", "10_05")
TEST = ("dance", "jump", "kick", "run", "turn", "walk")
MOST_FRAMES, TEST_FRAMES, FASTER_BY = 150, 120, 1.5
TEXT = """\
# Air and balance of ropes

`python -m papers.rope_chains.air CLIPS FOLDER` wrote this page at commit {commit}, on {machine}. The light cape,
coarsened to {vertices} vertices, was simulated on {count} clips ({frames} frames), to which the last row is fitted, and
on six excerpts of other people. Mean distance of the free bones of 26 ropes from simulated ones, from the second frame
of each excerpt to its last [mm]. Nothing but the ropes is compared: no correction, no networks.

{errors}

The part of it that is constant over the clip [mm]:

{offsets}

*Not physical*: the constants that fits began with before, with a drag of 1 per second whichever way the cloth faces.
*Material*: air and friction as the simulator has them. *Fading balance*: besides, what stands for the support of the
settled cloth fades to nothing within 10 cm off it. *Calibrated*: besides, springs and damping fitted to the clips.
"""


def simulated(folder: Path, clips: list[motions.Motion]) -> Dataset:
    """Returns takes of the cape, simulated if they are missing."""
    cape, _ = coarser_garment(garments.load("cape-light"), 0.25)
    sim.produce(folder, cape, [sim.ClipRequest(clip, motions.subject_of(clip)) for clip in clips])
    return open_dataset(folder)


def clips_of(data: Dataset, ropes: Ropes) -> Iterator[Clip]:
    """Yields poses and simulated bones of each clip."""
    for row in data.clips():
        take = data.take(row)
        first = int(take.clip_frames[0])
        yield take.motion[first:], ropes.positions_on(take.vertices[first:])


def errors_mm(ropes: Ropes, body: ShapedBody, clips: list[Clip]) -> dict[str, tuple[float, float]]:
    """Returns the mean error of each clip, and the part of it that is constant over the clip [mm]."""
    found = {}
    for motion, bones in clips:
        window = [body.posed(motion[frame]) for frame in range(len(motion))], bones, 1 / motion.fps
        ((miss, _),) = _bone_errors(ropes, [window])
        whole, constant = np.linalg.norm(miss, axis=2).mean(), np.linalg.norm(miss.mean(axis=0), axis=1).mean()
        found[motion.name] = (1e3 * float(whole), 1e3 * float(constant))
    return found


def table(rows: dict[str, dict[str, tuple[float, float]]], which: int) -> str:
    """Returns a Markdown table of all errors, or of their constant parts."""
    lines = ["| constants | mean | " + " | ".join(TEST) + " |", "|---" * (len(TEST) + 2) + "|"]
    for name, row in rows.items():
        values = [row[clip][which] for clip in TEST]
        lines.append(f"| {name} | {np.mean(values):.0f} | " + " | ".join(f"{each:.0f}" for each in values) + " |")
    return "\n".join(lines)


def main() -> None:
    """Simulates, measures and writes the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("clips", type=Path, help="Folder of BVH files.")
    parser.add_argument("folder", type=Path, help="Folder for the takes.")
    options = parser.parse_args()
    opened = {name: clean_part(motions.open_motion(options.clips / f"{name}.bvh"))[:MOST_FRAMES] for name in TRAIN}
    train = simulated(
        options.folder / "train", [*opened.values(), *(opened[name].at_speed(FASTER_BY) for name in FASTER)]
    )
    test = simulated(options.folder / "test", [clean_part(motions.load(name))[:TEST_FRAMES] for name in TEST])
    body, garment = train.body.shaped(), train.garment
    ropes = build_ropes(
        garment, body, rest=train.rest(garment.body_betas).vertices[0], chain_count=26, bone_counts=(8, 10)
    )
    physical = ropes.constants
    learned, judged = list(clips_of(train, ropes)), list(clips_of(test, ropes))
    compared = {
        "not physical": ropes.with_constants(RopeConstants()),
        "material": ropes.with_constants(replace(physical, balance_reach=0.0)),
        "material, fading balance": ropes,
        "calibrated": calibrate(ropes, body, learned),
    }
    rows = {name: errors_mm(each, body, judged) for name, each in compared.items()}
    page = TEXT.format(
        commit=commit(),
        machine=machine(),
        vertices=len(garment.vertices),
        count=len(learned),
        frames=sum(len(motion) for motion, _ in learned),
        errors=table(rows, 0),
        offsets=table(rows, 1),
    )
    PAGE.write_text(page)
    print(page)


if __name__ == "__main__":
    main()
