"""Makes the shipped clips: `python -m hemline.models.make.excerpts FOLDER` writes `models/excerpts.safetensors`."""

import sys
from dataclasses import dataclass, replace
from pathlib import Path

from hemline.motions.loop import seamless
from hemline.motions.motion import Motion
from hemline.motions.read import read
from hemline.motions.shipped import SHIPPED
from hemline.motions.store import write_many

FPS = 30.0


@dataclass(frozen=True)
class Excerpt:
    """Section of a clip that ships.

    Attributes:
        file: File in the folder of clips.
        start_s: Start of the section [s].
        seconds: Length of the section [s].
        looped: Whether one cycle of the motion is repeated to that length.
    """

    file: str
    start_s: float
    seconds: float
    looped: bool = False


EXCERPTS = {
    "run": Excerpt("02_03.bvh", 0.0, 4.0, looped=True),
    "walk": Excerpt("06_01.bvh", 0.0, 4.1),
    "jump": Excerpt("01_01.bvh", 1.5, 6.0),
    "turn": Excerpt("05_13.bvh", 1.2, 4.8),
    "kick": Excerpt("daz_rig/135_07.bvh", 0.1, 6.9),
    "dance": Excerpt("60_08.bvh", 32.3, 7.0),
}


def make_excerpt(name: str, folder: Path) -> Motion:
    """Cuts one of `EXCERPTS` out of its clip, at 30 frames per second."""
    excerpt = EXCERPTS[name]
    clip = read(folder / excerpt.file)
    if excerpt.looped:
        return replace(seamless(clip, seconds=excerpt.seconds, fps=FPS), name=name)
    first = round(excerpt.start_s * clip.fps)
    section = clip[first : first + round(excerpt.seconds * clip.fps) + 1]
    return replace(section.resample(FPS), name=name)


def main(folder: str) -> None:
    """Writes all excerpts."""
    write_many(SHIPPED, {name: make_excerpt(name, Path(folder)) for name in EXCERPTS})


if __name__ == "__main__":
    main(sys.argv[1])
