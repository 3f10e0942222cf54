"""Makes clips of runs for the fits of loose garments: `python -m hemline.models.make.runs FOLDER -o RUNS`.

Recordings of runs last little more than a second, too short to show how cloth hangs in the air of a run. FOLDER holds
the clips of `fit.clips`. One cycle of each clip in `RUNS` is repeated for five seconds, and played at other speeds.
Each result is written as a motion of its own, which `hemline simulate -m` reads.
"""

import argparse
from dataclasses import dataclass, replace
from pathlib import Path

from hemline.motions import longest_clean
from hemline.motions.loop import seamless
from hemline.motions.motion import Motion
from hemline.motions.read import read
from hemline.motions.store import write

FPS, SECONDS = 30.0, 5.0
"""Frame rate of the clips [frames/s], and their minimum length before the speed is changed [s]."""


@dataclass(frozen=True)
class Run:
    """A clip with one or more cycles of a run or a walk, and the speeds at which they are played.

    Attributes:
        file: File in the folder of clips.
        speeds: Playback speeds, as multiples of the recorded one.
    """

    file: str
    speeds: tuple[float, ...]


RUNS = (
    Run("id_unverified/running_1.bvh", (0.8, 1.0)),
    Run("id_unverified/running_3.bvh", (0.75, 0.9, 1.0)),
    Run("07_11.bvh", (1.4,)),
    Run("08_01.bvh", (1.3,)),
    Run("16_21.bvh", (1.5,)),
    Run("16_25.bvh", (1.25,)),
    Run("38_02.bvh", (1.4,)),
    Run("style_loops/142_06.bvh", (1.3,)),
)
"""Runs at 2.5 to 3.4 m/s, and brisk walks played as fast as jogs, at 2.0 to 2.5 m/s."""


def make_runs(run: Run, folder: Path) -> list[Motion]:
    """Repeats the cycle of a clip, and returns it at each speed.

    Args:
        run: The clip and the speeds.
        folder: Folder of the clips.
    """
    whole = read(folder / run.file)
    first, end = longest_clean(whole)
    looped = seamless(whole[first:end], seconds=SECONDS, fps=FPS)
    looped = replace(looped, name=f"{whole.name} looped")
    return [looped.at_speed(speed) for speed in run.speeds]


def main() -> None:
    """Writes all runs."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="Folder of the clips.")
    parser.add_argument("-o", "--output", type=Path, required=True, help="Folder for the runs.")
    options = parser.parse_args()
    made = [(run, make_runs(run, options.folder)) for run in RUNS]
    options.output.mkdir(parents=True, exist_ok=True)
    for run, motions in made:
        for speed, motion in zip(run.speeds, motions, strict=True):
            write(options.output / f"{Path(run.file).stem}-{round(100 * speed)}.safetensors", motion)


if __name__ == "__main__":
    main()
