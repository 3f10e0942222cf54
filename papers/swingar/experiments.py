"""Runs all experiments on SwinGar: `python -m papers.swingar.experiments FOLDER --clips CLIPS MESH...`.

FOLDER receives the data: takes of garments, subjects and bodies that no fit has seen, and the small set of the
ablations. CLIPS is the folder of recordings, see `fit.clips`. Each MESH is a garment that others made; it is evaluated
beside random designs with seeds of their own. Then the experiments of this folder run one after the other, each in a
process of its own, and `hemline bench lag`. Experiments with results of this commit are skipped, so that a killed run
continues. The ablations take hours and run only with `--only ablations`.

Writes papers/swingar/pages/experiments.md with the paper's figures, our goals and our results. `--page` writes this
page alone, from earlier results.
"""

import argparse
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from hemline.bench.machine import commit
from papers.swingar.summary import MODELS, newest, write_page

ROOT = Path(__file__).parents[2]
"""Root of the checkout, where experiments run as modules."""
RESULTS = ROOT / "benchmarks" / "results"
SUBJECTS = ("02", "06", "60")
"""Subjects of the test set, which are in no fit."""
APART = ("02_03", "02_04", "02_05", "06_02", "06_05", "60_08")
BEYOND = ("02_03", "02_04", "06_02", "60_08")
"""Recordings of these subjects for the smaller sets."""
DESIGNS = ("jumpsuit:100", "dress:100", "dress:101", "dress:102", "skirt:100", "skirt:101")
"""Random designs of the test set, which are in no fit."""
SEED_OF_TEST = "7"
LONG = ("ablations",)
"""Experiments that run only when `--only` names them."""


@dataclass(frozen=True)
class Takes:
    """A set of takes with the options that make it."""

    name: str
    garments: tuple[str, ...]
    words: tuple[str, ...]

    def command(self, folder: Path, clips: Path) -> list[str]:
        """Returns the command that makes the set, or continues to make it."""
        module = [sys.executable, "-m", "hemline.models.make.swingar_takes", str(clips)]
        return [*module, *self.garments, "-o", str(folder / self.name), *self.words]


@dataclass(frozen=True)
class Step:
    """An experiment with the file of its results."""

    name: str
    command: tuple[str, ...]
    results: Path

    @property
    def done(self) -> bool:
        """Whether there are results of this commit."""
        return self.results.exists() and newest(self.results)["commit"] == commit()


def sets(meshes: list[str], clips: Path) -> Iterator[Takes]:
    """Yields all sets of takes.

    Args:
        meshes: Files of garments that others made.
        clips: The folder of recordings.
    """
    subjects = sorted(path.name for path in clips.glob("*.bvh") if path.name.split("_")[0] in SUBJECTS)
    designs = tuple(f"{name}@35" for name in DESIGNS)
    test = ("--takes", "4", "--seed", SEED_OF_TEST, "--only", *subjects)
    yield Takes("unseen", (*meshes, *designs), test)
    short, apart = ("--seconds", "3", "--takes", "2"), tuple(f"{name}.bvh" for name in APART)
    first = tuple(f"{kind}:100@35" for kind in ("dress", "top", "skirt", "trousers"))
    yield Takes("apart", first, (*short, "--seed", SEED_OF_TEST, "--only", *apart))
    close = ("close-top:100@35", "close-trousers:100@35")
    yield Takes("apart", close, (*short, "--seed", SEED_OF_TEST, "--only", *apart))
    bodies = ("--betas=3,3", "--betas=-3,-3")
    yield Takes("beyond", first[:2], (*short, "--seed", "9", "--only", *(f"{name}.bvh" for name in BEYOND), *bodies))


def small_set() -> Iterator[Takes]:
    """Yields the takes that the ablations are trained on."""
    short = ("--seconds", "3", "--takes")
    kinds = ("dress", "top", "skirt", "trousers", "jumpsuit")
    yield Takes("train", (*(f"{kind}:0@35" for kind in kinds), "dress:1@35", "top:1@35"), (*short, "2", "--seed", "0"))
    second = ("skirt:1@35", "trousers:1@35", "jumpsuit:1@35", "dress:2@35", "skirt:2@35")
    yield Takes("train", second, (*short, "2", "--seed", "1"))
    third = ("top:2@35", "dress:3@35", "trousers:2@35", "skirt:3@35", "jumpsuit:2@35", "top:3@35")
    yield Takes("train", third, (*short, "3", "--seed", "2"))


def steps(folder: Path) -> Iterator[Step]:
    """Yields all experiments in their order.

    Args:
        folder: The folder of the data.
    """

    def takes(name: str) -> list[str]:
        return sorted(str(each) for each in (folder / name).iterdir()) if (folder / name).exists() else []

    def experiment(name: str, *words: str) -> tuple[str, ...]:
        return (sys.executable, "-m", f"papers.swingar.{name}", *words)

    models = [word for name in MODELS for word in ("--model", name)]
    for name, output in (("unseen", "unseen"), ("beyond", "unseen_bodies")):
        file = RESULTS / f"{output}.json"
        yield Step(name, experiment("unseen", *takes(name), *models, "-o", str(file)), file)
    file = RESULTS / "swingar_spread.json"
    yield Step("spread", experiment("spread", *takes("apart"), "-o", str(file)), file)
    yield Step("laws", experiment("laws"), RESULTS / "swingar_laws.jsonl")
    yield Step("collisions", experiment("collisions"), RESULTS / "swingar_collisions.jsonl")
    file = RESULTS / "swingar_ablations.jsonl"
    options = ("--judged", *takes("apart"), "--checkpoints", str(folder / "checkpoints"), "-o", str(file))
    yield Step("ablations", experiment("ablations", *takes("train"), *options), file)
    bench = (sys.executable, "-m", "hemline", "bench", "lag", "--record", str(RESULTS))
    yield Step("bench", bench, RESULTS / "lag.jsonl")


def main() -> None:
    """Makes the data, runs the missing experiments and writes the pages."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, nargs="?", help="takes the data; made and continued")
    parser.add_argument("meshes", nargs="*", help="garments of somebody else's, put on and judged")
    parser.add_argument("--clips", type=Path, help="the folder of recordings")
    parser.add_argument(
        "--only", nargs="+", default=[], help="commands by name, such as laws; default: all but ablations"
    )
    parser.add_argument("--jobs", type=int, default=1, help="processes that simulate takes")
    parser.add_argument("--page", action="store_true", help="write the page from what was measured before")
    asked = parser.parse_args()
    if not asked.page:
        if not asked.folder or not asked.clips:
            parser.error(
                "a FOLDER for the data, and --clips with the folder of recordings, are needed; or --page alone"
            )
        folder, small = asked.folder.resolve(), small_set() if "ablations" in asked.only else ()
        for each in (*sets(asked.meshes, asked.clips), *small):
            command = [*each.command(folder, asked.clips), "--jobs", str(asked.jobs)]
            subprocess.run(command, check=True)
        for step in steps(folder):
            wanted = step.name in asked.only if asked.only else step.name not in LONG
            if wanted and not step.done:
                print(f"--- {step.name}", flush=True)
                subprocess.run(step.command, check=True, cwd=ROOT)
        subprocess.run([sys.executable, "-m", "papers.swingar.unseen_page"], check=True, cwd=ROOT)
    print(write_page(RESULTS))


if __name__ == "__main__":
    main()
