"""Simulates takes for `lag` and `swingar`: `python -m hemline.models.make.swingar_takes CLIPS -o FOLDER GARMENT...`.

CLIPS is the folder of `fit.clips`. The proxy mesh of each garment is simulated in several takes of a few seconds.
Clips, sections, speeds and bodies are assigned by a seed so that all clips occur equally often. Each garment gets a
dataset of its own; existing takes are kept, so a killed run can be continued. With `--scheduler` the workers of a dask
cluster simulate; meshes are still tried on in this process. A garment is a name or a file; a mesh that does not sit on
the body is tried on. `--only CLIP...`, `--betas`, `--edge` and `--most` make the takes that models are evaluated on.

`--generated N` adds N random designs with the kinds in turn, close-fitting in every other round. `--rough` takes
fewer steps to a larger residual, several times as fast as `hemline simulate`, and leaves overlapping limbs as they are.
"""

import argparse
import functools
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hemline import bodies, motions
from hemline.animators.newton_solver import newton_settings
from hemline.datasets import Row
from hemline.errors import BadCluster, HemlineError
from hemline.garments.garment import Garment
from hemline.garments.generate import KINDS
from hemline.garments.proxy.proxy import ProxySize, proxy_of
from hemline.motions.motion import Motion
from hemline.sim import ClipRequest, SimSettings, random_shapes
from hemline.sim.takes.jobs import Call, Job, Progress, ignore_progress, run_jobs
from hemline.sim.takes.produce import Plan, clip_job
from hemline.sim.takes.rest_states import rest_job
from hemline.sim.takes.setup import Setup
from hemline.sim.takes.start_dataset import start_dataset
from hemline.sim.takes.workers import workers
from hemline.tryon import open_garment

FIT_CLIPS = Path(__file__).parents[1] / "fit.clips"
BODY = "anny24"
BODIES = 9
"""Default number of body shapes: the mean shape and random ones."""
BODIES_PER_GARMENT = 2
"""Number of body shapes that a garment is simulated on."""
SPEEDS = (1.0, 1.0, 0.8, 1.25)
"""Playback speeds of the clips, in turn."""
MIN_SECONDS = 1.5
"""Minimum length of the section without jumps; clips with shorter ones are skipped [s]."""


@dataclass(frozen=True)
class TakePart:
    """Section of a clip on a body."""

    clip: Path
    first: float
    """Start of the section, as a fraction of the possible range of starts."""
    speed: float
    betas: tuple[float, ...]


@dataclass(frozen=True)
class Recipe:
    """Garment with the settings and the sections that it is simulated in."""

    garment: str
    folder: Path
    size: ProxySize
    settings: SimSettings | None
    """Settings of the simulator; None for those of `hemline simulate`."""
    seconds: float
    parts: tuple[TakePart, ...]


def main() -> None:
    """Simulates the missing takes and prints which failed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("clips", type=Path, help="Folder of the clips.")
    parser.add_argument("garments", nargs="*", help="Garments to simulate, by name or file.")
    parser.add_argument("--generated", type=int, default=0, help="Number of additional random designs.")
    parser.add_argument("--first-seed", type=int, default=1000, help="Seed of the first random design.")
    parser.add_argument("--rough", action="store_true", help="Simulate with fewer and rougher steps.")
    parser.add_argument("-o", "--output", type=Path, required=True, help="Folder of the datasets.")
    parser.add_argument("--only", nargs="*", default=None, help="Clips to use. Defaults to fit.clips.")
    parser.add_argument("--takes", type=int, default=8, help="Number of takes per garment.")
    parser.add_argument("--seconds", type=float, default=4.0, help="Length of a take [s].")
    parser.add_argument("--edge", type=float, default=ProxySize().edge, help="Edge length of the proxy mesh [m].")
    parser.add_argument("--fewest", type=int, default=ProxySize().fewest, help="Minimum number of proxy vertices.")
    parser.add_argument("--most", type=int, default=ProxySize().most, help="Maximum number of proxy vertices.")
    parser.add_argument("--bodies", type=int, default=BODIES, help="Number of body shapes, the mean one included.")
    parser.add_argument("--betas", action="append", type=_betas, help="Body shape, such as 3,-3, not a random one.")
    parser.add_argument("--seed", type=int, default=0, help="Seed of clips, sections and bodies.")
    parser.add_argument("--jobs", type=int, default=1, help="Number of processes.")
    parser.add_argument("--scheduler", help="Address of a dask scheduler whose workers simulate.")
    options = parser.parse_args()
    names = options.only or FIT_CLIPS.read_text().split()
    garments = [*options.garments, *design_names(options.generated, options.first_seed, options.edge)]
    if not garments:
        parser.error("name garments, or ask for random designs with --generated")
    size = ProxySize(edge=options.edge, most=options.most, fewest=min(options.most, options.fewest))
    settings = newton_settings() if options.rough else None
    clips, shapes = [options.clips / name for name in names], body_shapes(options.betas, options.bodies, options.seed)
    dealt = deal_parts(clips, len(garments), options.takes, options.seed, shapes)
    recipes = [
        Recipe(name, options.output / folder_of(name), size, settings, options.seconds, each)
        for name, each in zip(garments, dealt, strict=True)
    ]
    began = time.monotonic()
    try:
        for path in sorted({part.clip for recipe in recipes for part in recipe.parts}):
            longest_clean(path)  # an unreadable clip fails before anything is written
        with workers(options.jobs, options.scheduler) as pool:
            results = run_jobs((garment_job(recipe) for recipe in recipes), pool)
    except HemlineError as error:
        sys.exit(f"hemline: {error}")
    for recipe, result in zip(recipes, results, strict=True):
        _say(f"{recipe.garment:<28} {result}")
    _say(f"{time.monotonic() - began:.0f} s")


def _betas(word: str) -> tuple[float, ...]:
    try:
        return tuple(float(each) for each in word.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"must be numbers; got '{word}'; write a body as 3,-3") from None


def folder_of(garment: str) -> str:
    """Returns the name of the dataset folder of a garment."""
    stem = Path(garment).stem if "/" in garment else garment
    return stem.replace(":", "-").replace(" ", "_")


def design_names(count: int, first: int, edge: float) -> list[str]:
    """Returns the names of random designs.

    Args:
        count: Number of designs.
        first: Seed of the first design.
        edge: Edge length of the meshes [m].
    """
    close = [i // len(KINDS) % 2 == 1 for i in range(count)]
    return [
        f"{'close-' * close[i]}{KINDS[i % len(KINDS)]}:{first + i // len(KINDS)}@{round(1000 * edge)}"
        for i in range(count)
    ]


def body_shapes(betas: Sequence[tuple[float, ...]] | None, count: int, seed: int) -> list[tuple[float, ...]]:
    """Returns the shapes of the bodies that garments are simulated on.

    Args:
        betas: First coefficients of each shape; None for the mean and random ones.
        count: Number of shapes if `betas` is None.
        seed: Seed of the random shapes.
    """
    body = bodies.load(BODY)
    zeros = tuple(0.0 for _ in range(len(body.shapedirs)))
    if betas:
        return [(*each, *zeros[len(each) :]) for each in betas]
    return [zeros, *random_shapes(body, count - 1, seed)]


def deal_parts(
    clips: Sequence[Path], garments: int, takes: int, seed: int, shapes: Sequence[tuple[float, ...]]
) -> list[tuple[TakePart, ...]]:
    """Assigns sections of clips and bodies to each garment.

    Args:
        clips: All clips; they are shuffled and dealt out round by round.
        garments: Number of garments.
        takes: Number of takes per garment.
        seed: Seed of the assignment.
        shapes: Body shapes.
    """
    random = np.random.default_rng(seed)
    rounds = -(-garments * takes // len(clips))
    order = np.concatenate([random.permutation(len(clips)) for _ in range(rounds)])
    firsts, dealt = random.random(len(order)), []
    for garment in range(garments):
        numbers = range(garment * takes, (garment + 1) * takes)
        dealt.append(
            tuple(
                TakePart(
                    clips[order[number]],
                    float(firsts[number]),
                    SPEEDS[number % len(SPEEDS)],
                    shapes[
                        (garment * BODIES_PER_GARMENT + (number % takes) * BODIES_PER_GARMENT // takes) % len(shapes)
                    ],
                )
                for number in numbers
            )
        )
    return dealt


def garment_job(recipe: Recipe) -> Job[str]:
    """Simulates the takes of one garment and returns a summary."""
    try:
        if Path(recipe.garment).suffix:  # a file of this machine; the result of its try-on is stored here
            garment = make_proxy(recipe, None, ignore_progress)
        else:
            garment = yield Call(make_proxy, recipe, None)
    except BadCluster:
        raise
    except HemlineError as error:
        return f"left out: {error}"
    dataset, setup = start_dataset(recipe.folder, garment), Setup.of(garment, recipe.settings)
    names: list[str] = []
    reasons: list[str] = []
    for betas in dict.fromkeys(part.betas for part in recipe.parts):
        clips = [clip_request(part, recipe.seconds) for part in recipe.parts if part.betas == betas]
        plan = Plan(betas, untangle=recipe.settings is None)
        try:
            rest = yield from rest_job(dataset, setup, betas)
            for clip in clips:
                if clip is not None:
                    names += yield from clip_job(dataset, setup, plan, clip, rest, ignore_progress)
        except BadCluster:
            raise
        except HemlineError as error:
            reasons.append(str(error))
    by_name = {row.name: row for row in dataset.rows()}
    rows: list[Row] = [by_name[name] for name in names]
    reasons += [str(row.failed) for row in rows if row.failed]
    frames = sum(row.clip_frames for row in rows)
    summary = f"{len(garment.vertices)} vertices, {len(rows)} takes, {frames} frames"
    _say(f"{time.strftime('%H:%M:%S')} {recipe.garment}: {summary}")
    return summary + "".join(f"; failed: {reason}" for reason in reasons)


def make_proxy(recipe: Recipe, argument: None, progress: Progress) -> Garment:
    """Opens the garment of a recipe and returns its proxy mesh."""
    garment = open_garment(recipe.garment, bodies.load(BODY).shaped(), dressed=False, dataset=recipe.folder)
    return proxy_of(garment, recipe.size)[0]


@functools.cache
def longest_clean(clip: Path) -> Motion:
    """Returns the longest section of a clip without jumps."""
    motion = motions.read(clip)
    first, last = motions.longest_clean(motion)
    return motion[first:last]


def clip_request(part: TakePart, seconds: float) -> ClipRequest | None:
    """Returns the section as a clip; None if the clip has no section without jumps that is long enough."""
    whole = longest_clean(part.clip)
    if whole.seconds < MIN_SECONDS:
        return None
    length = round(seconds * part.speed * whole.fps) + 1
    start = int(part.first * max(0, len(whole) - length))
    cut = whole[start : start + length]
    if part.speed == 1:
        return ClipRequest(cut, motions.subject_of(whole))
    return ClipRequest(
        replace(cut, fps=cut.fps * part.speed, name=f"{cut.name} x{part.speed:g}"), motions.subject_of(whole)
    )


def _say(line: str) -> None:
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
