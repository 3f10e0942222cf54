"""Simulate what `swingar` learns from: `python -m hemline.models.make.swingar_takes CLIPS -o FOLDER GARMENT...`.

CLIPS is the folder of `fit.clips`. Each garment is simulated as its proxy, in some takes of a few seconds: clips,
stretches, speeds and bodies are dealt out by a seed so that all clips come equally often. Each garment gets a dataset
of its own; what is there is kept, so a killed run goes on. With `--scheduler` the workers of a dask cluster do it; a
mesh is then tried on in this process. A garment is a name or a file; a mesh that does not sit on
the body is tried on. With `--only CLIP...`, `--betas`, `--edge` and `--most`, it makes the takes that a model is
judged by, too.

`--generated N` adds so many random designs, the kinds in turn, every other round close-fitting. `--quality good`
simulates as `hemline animate live --quality good` does, several times as fast as `hemline simulate`: with its settings,
and limbs are not lifted out of each other.
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
from hemline.animators.simulated_proxy import QUALITY_LEVELS
from hemline.datasets import Row
from hemline.errors import BadCluster, HemlineError
from hemline.garments.garment import Garment
from hemline.garments.generate import KINDS
from hemline.garments.proxy.proxy import ProxySize, proxy_of
from hemline.motions.motion import Motion
from hemline.sim import Clip, SimSettings, random_shapes
from hemline.sim.takes.start_dataset import start_dataset
from hemline.sim.takes.jobs import Call, Job, Progress, ignore_progress, run_jobs
from hemline.sim.takes.produce import Plan, clip_job
from hemline.sim.takes.rest_states import rest_job
from hemline.sim.takes.setup import Setup
from hemline.sim.takes.workers import workers
from hemline.tryon import open_worn

FIT_CLIPS = Path(__file__).parents[1] / "fit.clips"
BODY = "anny24"
BODIES = 9
"""The mean body and random ones, unless another number is asked for."""
BODIES_EACH = 2
"""Of which a garment is worn by so many."""
SPEEDS = (1.0, 1.0, 0.8, 1.25)
"""How fast the clips are played, in turn."""
SHORTEST = 1.5
"""Clips without so long a stretch without jumps are left out [s]."""


@dataclass(frozen=True)
class Part:
    """A stretch of a clip on a body."""

    clip: Path
    first: float
    """Where it begins, as a share of what is longer than the stretch."""
    speed: float
    betas: tuple[float, ...]


@dataclass(frozen=True)
class Recipe:
    """One garment and what it is simulated in."""

    garment: str
    folder: Path
    size: ProxySize
    settings: SimSettings | None
    """Those of a level of `live`; None: those of `hemline simulate`."""
    seconds: float
    parts: tuple[Part, ...]


def main() -> None:
    """Make what is missing; say what failed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("clips", type=Path)
    parser.add_argument("garments", nargs="*")
    parser.add_argument("--generated", type=int, default=0, help="random designs beside those garments")
    parser.add_argument("--first-seed", type=int, default=1000, help="seed of the first of them")
    parser.add_argument("--quality", choices=QUALITY_LEVELS, help="a level of `live` instead of the settings of `simulate`")
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--only", nargs="*", default=None, help="clips, instead of those of fit.clips")
    parser.add_argument("--takes", type=int, default=8, help="takes of each garment")
    parser.add_argument("--seconds", type=float, default=4.0)
    parser.add_argument("--edge", type=float, default=ProxySize().edge, help="length of the proxy's edges [m]")
    parser.add_argument("--fewest", type=int, default=ProxySize().fewest, help="vertices of a proxy at least")
    parser.add_argument("--most", type=int, default=ProxySize().most, help="vertices of a proxy at most")
    parser.add_argument("--bodies", type=int, default=BODIES, help="shapes of bodies: the mean one and random ones")
    parser.add_argument("--betas", action="append", type=_betas, help="a body, as 3,-3; in the place of random ones")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--scheduler", help="address of a dask scheduler, whose workers simulate instead")
    given = parser.parse_args()
    names = given.only or FIT_CLIPS.read_text().split()
    garments = [*given.garments, *designs(given.generated, given.first_seed, given.edge)]
    if not garments:
        parser.error("name garments, or ask for random designs with --generated")
    size = ProxySize(edge=given.edge, most=given.most, fewest=min(given.most, given.fewest))
    settings = QUALITY_LEVELS[given.quality].settings() if given.quality else None
    clips, shapes = [given.clips / name for name in names], body_shapes(given.betas, given.bodies, given.seed)
    dealt = parts(clips, len(garments), given.takes, given.seed, shapes)
    recipes = [
        Recipe(name, given.output / folder_of(name), size, settings, given.seconds, each)
        for name, each in zip(garments, dealt, strict=True)
    ]
    began = time.monotonic()
    try:
        for path in sorted({part.clip for recipe in recipes for part in recipe.parts}):
            clean(path)  # one that cannot be read is refused before anything is written
        with workers(given.jobs, given.scheduler) as those:
            made = run_jobs((garment_job(recipe) for recipe in recipes), those)
    except HemlineError as error:
        sys.exit(f"hemline: {error}")
    for recipe, said in zip(recipes, made, strict=True):
        _say(f"{recipe.garment:<28} {said}")
    _say(f"{time.monotonic() - began:.0f} s")


def _betas(word: str) -> tuple[float, ...]:
    try:
        return tuple(float(each) for each in word.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"must be numbers; got '{word}'; write a body as 3,-3") from None


def folder_of(garment: str) -> str:
    """A folder's name for a garment: its own, or that of its file."""
    stem = Path(garment).stem if "/" in garment else garment
    return stem.replace(":", "-").replace(" ", "_")


def designs(count: int, first: int, edge: float) -> list[str]:
    """Names of random designs.

    Args:
        count: How many.
        first: Seed of the first.
        edge: Length of their edges [m].
    """
    close = [i // len(KINDS) % 2 == 1 for i in range(count)]
    return [
        f"{'close-' * close[i]}{KINDS[i % len(KINDS)]}:{first + i // len(KINDS)}@{round(1000 * edge)}"
        for i in range(count)
    ]


def body_shapes(betas: Sequence[tuple[float, ...]] | None, count: int, seed: int) -> list[tuple[float, ...]]:
    """Shapes of the bodies that wear the garments.

    Args:
        betas: The first coefficients of each; None: the mean body and random ones.
        count: Number of the bodies then.
        seed: Seed of the random ones.
    """
    body = bodies.load(BODY)
    zeros = tuple(0.0 for _ in range(len(body.shapedirs)))
    if betas:
        return [(*each, *zeros[len(each) :]) for each in betas]
    return [zeros, *random_shapes(body, count - 1, seed)]


def parts(
    clips: Sequence[Path], garments: int, takes: int, seed: int, shapes: Sequence[tuple[float, ...]]
) -> list[tuple[Part, ...]]:
    """What each garment is simulated in.

    Args:
        clips: All clips; they are shuffled and dealt out round by round.
        garments: Number of garments.
        takes: Takes of each.
        seed: Another one deals otherwise.
        shapes: Those of the bodies.
    """
    random = np.random.default_rng(seed)
    rounds = -(-garments * takes // len(clips))
    order = np.concatenate([random.permutation(len(clips)) for _ in range(rounds)])
    firsts, dealt = random.random(len(order)), []
    for garment in range(garments):
        mine = range(garment * takes, (garment + 1) * takes)
        dealt.append(
            tuple(
                Part(
                    clips[order[each]],
                    float(firsts[each]),
                    SPEEDS[each % len(SPEEDS)],
                    shapes[(garment * BODIES_EACH + (each % takes) * BODIES_EACH // takes) % len(shapes)],
                )
                for each in mine
            )
        )
    return dealt


def garment_job(recipe: Recipe) -> Job[str]:
    """Simulate one garment; what to say of it."""
    try:
        if Path(recipe.garment).suffix:  # a file of ours, and what it becomes when it is tried on is kept here
            garment = proxy(recipe, None, ignore_progress)
        else:
            garment = yield Call(proxy, recipe, None)
    except BadCluster:
        raise
    except HemlineError as error:
        return f"left out: {error}"
    dataset, setup = start_dataset(recipe.folder, garment), Setup.of(garment, recipe.settings)
    names: list[str] = []
    reasons: list[str] = []
    for betas in dict.fromkeys(part.betas for part in recipe.parts):
        clips = [stretch(part, recipe.seconds) for part in recipe.parts if part.betas == betas]
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
    said = f"{len(garment.vertices)} vertices, {len(rows)} takes, {frames} frames"
    _say(f"{time.strftime('%H:%M:%S')} {recipe.garment}: {said}")
    return said + "".join(f"; failed: {each}" for each in reasons)


def proxy(recipe: Recipe, argument: None, tell: Progress) -> Garment:
    """The garment as it is simulated."""
    worn = open_worn(recipe.garment, bodies.load(BODY).shaped(), recipe.folder, dressed=False)
    return proxy_of(worn, recipe.size)[0]


@functools.cache
def clean(clip: Path) -> Motion:
    """The longest stretch of a clip without jumps."""
    motion = motions.read(clip)
    first, last = motions.longest_clean(motion)
    return motion[first:last]


def stretch(part: Part, seconds: float) -> Clip | None:
    """The stretch as a clip; None where the clip has none without jumps that is long enough."""
    whole = clean(part.clip)
    if whole.seconds < SHORTEST:
        return None
    length = round(seconds * part.speed * whole.fps) + 1
    start = int(part.first * max(0, len(whole) - length))
    cut = whole[start : start + length]
    if part.speed == 1:
        return Clip(cut, motions.subject_of(whole))
    return Clip(replace(cut, fps=cut.fps * part.speed, name=f"{cut.name} x{part.speed:g}"), motions.subject_of(whole))


def _say(line: str) -> None:
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
