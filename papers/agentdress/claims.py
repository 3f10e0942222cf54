"""All claims about AgentDress by one command: `python -m papers.agentdress.claims FOLDER --motion FILE...`.

FOLDER takes the data, made and continued: the drapes of the light T-shirt that the shipped model is fitted to
(`anchors`), and what each command settles beside them. Then the commands of this folder run, as many beside each other
as `--jobs` says; what they print goes to FOLDER/logs. At last `hemline bench` takes the times, alone. What has a row of
this commit in benchmarks/results is not run again, so that a killed run goes on.

Writes papers/agentdress/pages/claims.md: what the paper says, what was asked, what was measured. With `--page` it writes this
page alone, from the rows that are there.
"""

import argparse
import json
import subprocess
import sys
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from hemline.bench.machine import commit
from papers.agentdress.claims_page import write_page

HERE = Path(__file__).parent
RESULTS = HERE.parents[1] / "benchmarks" / "results"
GARMENT = "tshirt-light"
TRUTH = ("walk", "run", "kick", "jump", "dance")
MATERIALS = ("denim", "silk")
"""Those that the garment is draped in beside its own."""
BODIES, SECONDS = 5, 2.0
WATCHED = (
    *("02_01", "06_05", "13_26", "49_02", "60_08", "90_30", "01_01"),
    *("01_05", "02_05", "02_08", "06_01", "60_01", "61_01", "daz_rig/135_03"),
)
"""Of `watched.py`: recordings, some of people of the fit, some not; they lie beside those of the fit."""


@dataclass(frozen=True)
class Step:
    """A command, and the file that its rows go to."""

    name: str
    words: tuple[str, ...]
    """Of the script of this name, or, where `bench`, of `hemline`."""
    bench: bool = False

    @property
    def results(self) -> Path:
        """Where its rows are."""
        return RESULTS / (f"{self.name}.jsonl" if self.bench else f"agentdress_{self.name}.jsonl")

    @property
    def done(self) -> bool:
        """Whether a row of this commit is there."""
        lines = self.results.read_text().splitlines() if self.results.exists() else []
        return any(json.loads(line)["commit"] == commit() for line in lines[-5:])

    @property
    def command(self) -> list[str]:
        """What is run."""
        if self.bench:
            return [sys.executable, "-m", "hemline", "bench", self.name, "--record", str(RESULTS)]
        return [sys.executable, str(HERE / f"{self.name}.py"), *self.words]


def chains(folder: Path, clips: list[str], pairs: int) -> list[list[Step]]:
    """All commands but those that take times. Chains can run side by side; in one each uses what those before made.

    Args:
        folder: Of the data.
        clips: That the poses of the fit are taken from.
        pairs: Of the test set.
    """
    anchors, test = str(folder / "anchors"), str(folder / "test")
    others = [str(Path(clips[0]).parent / f"{name}.bvh") for name in WATCHED]
    watched = ("-o", str(folder / f"watched-{commit()}"), "--shapes", str(BODIES), "--seconds", str(SECONDS))
    return [
        [
            Step("errors", (anchors, test, "--pairs", str(pairs), "--others", *others_of(folder))),
            Step("model_files", (test, GARMENT, "--pairs", str(pairs))),
            Step("materials", (anchors, *others_of(folder), "--test", str(folder / "materials"))),
            Step("beyond", (anchors, test, "--pairs", str(pairs))),
        ],
        [Step("loose_shapes", (str(folder / "skirt"), str(folder / "skirt-test"), "--motion", *clips))],
        [Step("shape_models", (anchors, str(folder / "shapes"), "--poses", "8", "--shapes", "20"))],
        [Step("watched", (GARMENT, *TRUTH, "turn", *others, *watched))],
        [Step("separability", (GARMENT, anchors, str(folder / "near"), "--walked", "2", "--followed", "3"))],
        [Step("limits", (GARMENT, anchors, str(folder / "limits"), "--poses", "3"))],
        [Step("bodies_apart", (GARMENT,))],
        [Step("damping", (GARMENT, str(folder / "truth")))],
        [Step("sampling", (GARMENT, anchors, "--draws", "1"))],
    ]


TIMES = tuple(Step(name, (), bench=True) for name in ("tshirt", "tshirt-paper-size", "crowd-tshirt"))


def others_of(folder: Path) -> list[str]:
    """Datasets of the garment of other materials."""
    return [str(folder / name) for name in MATERIALS]


def main() -> None:
    """Make the data, run what is missing, write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, nargs="?", help="takes the data; made and continued")
    parser.add_argument("--motion", nargs="+", default=[], help="clips that the poses of the fit are taken from")
    parser.add_argument("--only", nargs="+", default=[], help="commands by name, such as errors; default: all")
    parser.add_argument("--jobs", type=int, default=1, help="processes that settle anchors, then commands")
    parser.add_argument("--random", type=int, default=400, help="random bodies of the fit; fewer take less time")
    parser.add_argument("--pairs", type=int, default=96, help="of a pose and a random body, to judge the fit by")
    parser.add_argument("--page", action="store_true", help="write the page from the rows that are there")
    asked = parser.parse_args()
    if not asked.page:
        if not asked.folder or not asked.motion:
            parser.error("a FOLDER for the data, and --motion with clips, are needed; or --page alone")
        _make_data(asked.folder, asked.motion, asked.random, asked.jobs)
        failed = _run(chains(asked.folder, asked.motion, asked.pairs), asked.folder / "logs", asked.only, asked.jobs)
        if failed:
            raise SystemExit(f"failed: {', '.join(failed)}; what they printed is in {asked.folder / 'logs'}")
    print(write_page(RESULTS))


def _run(commands: Sequence[Sequence[Step]], logs: Path, only: Sequence[str], jobs: int) -> list[str]:
    """Run those that are asked for and not done, then take times.

    Returns:
        Names of the commands that failed; the others ran to their end.
    """
    logs.mkdir(exist_ok=True)

    def run_chain(steps: Sequence[Step]) -> list[str]:
        for number, step in enumerate(steps):
            if step.done or (only and step.name not in only):
                continue
            begun = time.monotonic()
            with (logs / f"{step.name}.txt").open("w") as log:
                code = subprocess.run(
                    step.command, cwd=HERE, stdout=log, stderr=subprocess.STDOUT, check=False
                ).returncode
            print(f"--- {step.name}: {time.monotonic() - begun:.0f} s, exit status {code}", flush=True)
            if code:
                return [each.name for each in steps[number:]]
        return []

    with ThreadPoolExecutor(jobs) as pool:
        failed = sum(pool.map(run_chain, commands), [])
    return failed + [name for step in TIMES for name in run_chain([step])]


def _make_data(folder: Path, clips: list[str], random: int, jobs: int) -> None:
    """The drapes that ship, and simulated clips; all commands continue what is there.

    Status 1 of `drape` says that the garment came to rest in fewer poses than asked; rows count those that it did in.
    """
    drape = ["drape", GARMENT, "--anchors", "16", "--poses", "150", "--random", str(random), "--derivatives"]
    simulate = ["simulate", GARMENT, "-m", *TRUTH, "-o", str(folder / "truth")]
    again = ["drape", GARMENT, "--poses-of", str(folder / "anchors"), "--poses", "48", "--jobs", str(jobs)]
    others = [[*again, "--material", name, "-o", str(folder / name)] for name in MATERIALS]
    for words in ([*drape, "--motion", *clips, "-o", str(folder / "anchors"), "--jobs", str(jobs)], simulate, *others):
        code = subprocess.run([sys.executable, "-m", "hemline", *words], check=False).returncode
        if not 0 <= code <= (words[0] == "drape"):
            raise SystemExit(f"hemline {words[0]} ended with status {code}; run this again to go on")


if __name__ == "__main__":
    main()
