"""All experiments on AgentDress by one command: `python -m papers.agentdress.experiments FOLDER --motion FILE...`.

FOLDER takes the data, made and continued: the drapes of the light T-shirt that the shipped model is fitted to
(`anchors`), and what each experiment simulates. Then the experiments of this folder run, up to `--jobs` at once; their
output goes to FOLDER/logs. At last `hemline bench` measures times, alone. An experiment with a row of this commit in
benchmarks/results is skipped, so that an interrupted run continues.

Writes papers/agentdress/pages/experiments.md: the figures of the paper, the goals of this project and the measurements.
With `--page` it only writes this and all other pages again, from the recorded rows. Run it from the root of a checkout.
"""

import argparse
import subprocess
import sys
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from hemline.bench.machine import commit
from papers.agentdress.report.summary import GARMENT, write_pages, write_summary
from papers.report import RESULTS, ROOT, read_rows

TRUTH = ("walk", "run", "kick", "jump", "dance")
MATERIALS = ("denim", "silk")
"""Other materials in which the garment is draped."""
WATCHED_BODIES, WATCHED_SECONDS = 5, 2.0
WATCHED_CLIPS = (
    *("02_01", "06_05", "13_26", "49_02", "60_08", "90_30", "01_01"),
    *("01_05", "02_05", "02_08", "06_01", "60_01", "61_01", "daz_rig/135_03"),
)
"""Recordings for `watched.py` in the folder of the clips of the fit, some of people of the fit and some of others."""


@dataclass(frozen=True)
class Experiment:
    """A command that records rows."""

    name: str
    words: tuple[str, ...]
    """Arguments of the command."""
    bench: bool = False
    """Whether the command is `hemline bench` rather than a module of this folder."""

    @property
    def is_recorded(self) -> bool:
        """Whether the results hold a row of this commit."""
        rows = read_rows(self.name if self.bench else f"agentdress_{self.name}")
        return any(row["commit"] == commit() for row in rows[-5:])

    @property
    def command(self) -> list[str]:
        """The command line."""
        if self.bench:
            return [sys.executable, "-m", "hemline", "bench", self.name, "--record", str(RESULTS)]
        return [sys.executable, "-m", f"papers.agentdress.{self.name}", *self.words]


TIMES = tuple(Experiment(name, (), bench=True) for name in ("tshirt", "tshirt-paper-size", "crowd-tshirt"))


def chains_of(folder: Path, clips: list[str], pairs: int) -> list[list[Experiment]]:
    """Returns all experiments except times, as chains that can run at once; within a chain one needs those before it.

    Args:
        folder: Folder of the data.
        clips: Clips of the fit.
        pairs: Number of pairs in the test set.
    """
    anchors, test, count = str(folder / "anchors"), str(folder / "test"), ("--pairs", str(pairs))
    others = [str(folder / name) for name in MATERIALS]
    recordings = [str(Path(clips[0]).parent / f"{name}.bvh") for name in WATCHED_CLIPS]
    watched = ("--output", str(folder / f"watched-{commit()}"), "--shapes", str(WATCHED_BODIES))
    return [
        [
            Experiment("errors", (anchors, test, *count, "--others", *others)),
            Experiment("model_files", (test, GARMENT, *count)),
            Experiment("materials", (anchors, *others, "--test", str(folder / "materials"))),
            Experiment("beyond", (anchors, test, *count)),
        ],
        [Experiment("loose_shapes", (str(folder / "skirt"), str(folder / "skirt-test"), "--motion", *clips))],
        [Experiment("shape_models", (anchors, str(folder / "shapes"), "--poses", "8", "--shapes", "20"))],
        [Experiment("watched", (GARMENT, *TRUTH, "turn", *recordings, *watched, "--seconds", str(WATCHED_SECONDS)))],
        [Experiment("separability", (GARMENT, anchors, str(folder / "near"), "--walked", "2", "--followed", "3"))],
        [Experiment("limits", (GARMENT, anchors, str(folder / "limits"), "--poses", "3"))],
        [Experiment("bodies_apart", (GARMENT,))],
        [Experiment("arm_lift", (GARMENT,))],
        [Experiment("damping", (GARMENT, str(folder / "truth")))],
        [Experiment("sampling", (GARMENT, anchors, "--draws", "1"))],
    ]


def main() -> None:
    """Makes the data, runs what is missing and writes the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, nargs="?", help="a folder for the data; made and continued")
    parser.add_argument("--motion", nargs="+", default=[], help="clips that the poses of the fit are taken from")
    parser.add_argument("--only", nargs="+", default=[], help="experiments by name, such as errors; default: all")
    parser.add_argument("--jobs", type=int, default=1, help="number of processes")
    parser.add_argument("--random", type=int, default=375, help="number of random bodies of the fit")
    parser.add_argument("--pairs", type=int, default=96, help="number of pairs of a pose and a body in the test set")
    parser.add_argument("--page", action="store_true", help="write all pages again from the recorded rows")
    options = parser.parse_args()
    if options.page:
        write_pages()
        return
    if not options.folder or not options.motion:
        parser.error("a FOLDER for the data, and --motion with clips, are needed; or --page alone")
    folder = options.folder.resolve()
    make_data(folder, options.motion, options.random, options.jobs)
    chains = chains_of(folder, options.motion, options.pairs)
    failed = run(chains, folder / "logs", options.only, options.jobs)
    if failed:
        raise SystemExit(f"failed: {', '.join(failed)}; see their output in {folder / 'logs'}")
    print(write_summary())


def run(chains: Sequence[Sequence[Experiment]], logs: Path, only: Sequence[str], jobs: int) -> list[str]:
    """Runs the experiments that have no row of this commit, then measures times.

    Args:
        chains: See `chains_of`.
        logs: Folder for the output of the commands.
        only: Names of the experiments to run; empty: all.
        jobs: Number of chains at once.

    Returns:
        Names of the experiments that failed or could not start; the others ran to their end.
    """
    logs.mkdir(exist_ok=True)

    def run_chain(chain: Sequence[Experiment]) -> list[str]:
        for number, experiment in enumerate(chain):
            if experiment.is_recorded or (only and experiment.name not in only):
                continue
            start = time.monotonic()
            with (logs / f"{experiment.name}.txt").open("w") as log:
                done = subprocess.run(experiment.command, cwd=ROOT, stdout=log, stderr=subprocess.STDOUT, check=False)
            seconds = time.monotonic() - start
            print(f"--- {experiment.name}: {seconds:.0f} s, exit status {done.returncode}", flush=True)
            if done.returncode:
                return [each.name for each in chain[number:]]
        return []

    with ThreadPoolExecutor(jobs) as pool:
        failed = sum(pool.map(run_chain, chains), [])
    return failed + [name for experiment in TIMES for name in run_chain([experiment])]


def make_data(folder: Path, clips: list[str], random: int, jobs: int) -> None:
    """Makes the drapes that ship, and simulated clips; all commands continue existing folders.

    Status 1 of `drape` means that the garment came to rest in fewer poses than requested.
    """
    poses = ["--anchors", "100", "--poses", "60", "--hanging", "150"]
    drape = ["drape", GARMENT, *poses, "--random", str(random), "--derivatives"]
    simulate = ["simulate", GARMENT, "-m", *TRUTH, "-o", str(folder / "truth")]
    again = ["drape", GARMENT, "--poses-of", str(folder / "anchors"), "--poses", "48", "--jobs", str(jobs)]
    others = [[*again, "--material", name, "-o", str(folder / name)] for name in MATERIALS]
    for words in ([*drape, "--motion", *clips, "-o", str(folder / "anchors"), "--jobs", str(jobs)], simulate, *others):
        code = subprocess.run([sys.executable, "-m", "hemline", *words], check=False).returncode
        if not 0 <= code <= (words[0] == "drape"):
            raise SystemExit(f"hemline {words[0]} ended with status {code}; run this again to continue")


if __name__ == "__main__":
    main()
