"""The test set of loose garments on other shapes: the same clips simulated on the mean body and on random ones."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from hemline import bodies, motions
from hemline.datasets import Take, open_dataset
from hemline.garments import Garment
from hemline.sim import produce, random_shapes
from hemline.sim.takes.produce import Clip

BETAS = 4
"""Of a random body, so many betas are drawn, as when close-fitting garments are watched."""


@dataclass(frozen=True)
class Trial:
    """One clip, simulated on the mean body and on another one, frame by frame in the same pose.

    Attributes:
        clip: Its name.
        body: Number of the other body.
        betas: Its shape.
        mean: The take on the mean body.
        truth: The take on the other one.
    """

    clip: str
    body: int
    betas: tuple[float, ...]
    mean: Take
    truth: Take


def trials(
    folder: Path, garment: Garment, clips: Sequence[str], *, count: int, seconds: float, seed: int, jobs: int = 1
) -> list[Trial]:
    """All clips on all bodies; what the folder lacks is simulated now.

    Limbs are lifted out of each other on the mean body, so that every body takes the same poses.

    Args:
        folder: The dataset.
        garment: The garment.
        clips: Names of shipped clips.
        count: Random bodies.
        seconds: How much of each clip [s].
        seed: Of the bodies.
        jobs: Processes.
    """
    body = bodies.load(garment.body_name)
    plain = body.shaped()
    shown = []
    for name in clips:
        motion = motions.load(name)
        motion = motion[: round(seconds * motion.fps)]
        shown.append(Clip(plain.untangled_motion(plain.placed(motion)), name))
    found = []
    for number, betas in enumerate([(), *(each[:BETAS] for each in random_shapes(body, count, seed))]):
        rows = produce(folder, garment, shown, betas=betas, untangle=False, jobs=jobs)
        takes = [open_dataset(folder).take(row) for row in rows]
        if number == 0:
            means = takes
            continue
        for name, mean, truth in zip(clips, means, takes, strict=True):
            if truth.failed is None:
                found.append(Trial(name, number, betas, mean, truth))
    return found
