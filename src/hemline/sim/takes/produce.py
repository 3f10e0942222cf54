"""Many takes into a dataset: clips cut into parts, shared out over processes, continued after a kill.

A take's name is the hash of its inputs, so what is already there is known before it is made, and a command that is
run again makes only what is missing. A part goes on from the end state that the part before it stored.
"""

import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from hemline.datasets import Dataset, Row, Take
from hemline.garments.garment import Garment
from hemline.motions.motion import Motion
from hemline.sim.settings import SIMULATOR, SimSettings

from .start_dataset import start_dataset
from .end_state import EndState, check_end_of_take
from .jobs import Call, Job, Report, Progress, run_jobs
from .rest_states import rest_job
from .setup import Setup, shaped
from .simulate import simulate
from .workers import workers

PART_SECONDS = 10.0
"""Clips are cut into parts of this length: a killed run loses at most that much cloth time."""


@dataclass(frozen=True)
class Clip:
    """One clip to simulate."""

    motion: Motion
    """As read, at its own frame rate."""
    subject: str
    """Who was captured."""


@dataclass(frozen=True)
class Plan:
    """What the takes of some clips have in common, besides their setup."""

    betas: tuple[float, ...] = ()
    """Shape of the body."""
    untangle: bool = True
    """Lift limbs out of each other first."""
    quantised: bool = False
    """Store vertices in steps of 10 micrometres."""
    part_seconds: float = PART_SECONDS
    """Length of the parts that clips are cut into [s]."""


def produce(
    folder: str | Path,
    garment: Garment,
    clips: Sequence[Clip],
    *,
    betas: Sequence[float] = (),
    settings: SimSettings | None = None,
    untangle: bool = True,
    jobs: int = 1,
    scheduler: str | None = None,
    quantised: bool = False,
    part_seconds: float = PART_SECONDS,
    report: Report | None = None,
) -> list[Row]:
    """Simulate a garment against clips into a dataset; what is there already is kept.

    Args:
        folder: The dataset; made when missing.
        garment: The garment, made on the body of `garment.body_name`.
        clips: The clips.
        betas: Shape of the body.
        settings: Settings of the simulator.
        untangle: Lift limbs out of each other first.
        jobs: Processes. The takes do not depend on it.
        scheduler: Address of a dask scheduler whose workers simulate instead; see `workers`.
        quantised: Store vertices in steps of 10 micrometres.
        part_seconds: Length of the parts that clips are cut into [s].
        report: Called with a clip's name, the frames done and the frames asked for; first with 0 for each clip.

    Returns:
        The index rows of the takes asked for, failed ones included, in the order of the clips.

    Raises:
        BadDataset: The folder holds another garment's takes, or one that cannot be read or gone on from.
        BadOutput: It cannot be written.
        BadCluster: No scheduler answers, it went away, or its workers cannot do it; what is done is kept.
    """
    plan = Plan(tuple(betas), untangle, quantised, part_seconds)
    setup = Setup.of(garment, settings)
    tell = report or (lambda clip, done, total: None)
    called = _told_apart([clip.motion.name for clip in clips])
    with workers(jobs, scheduler) as those:
        dataset = start_dataset(folder, garment)
        for name, clip in zip(called, clips, strict=True):
            tell(name, 0, clip.motion.frames_at(setup.settings.fps))
        (rest,) = run_jobs([rest_job(dataset, setup, plan.betas)], those)
        work = (
            clip_job(dataset, setup, plan, clip, rest, lambda done, total, name=name: tell(name, done, total))
            for name, clip in zip(called, clips, strict=True)
        )
        names = [name for made in run_jobs(work, those) for name in made]
    by_name = {row.name: row for row in dataset.rows()}
    return [by_name[name] for name in names]


def clip_job(dataset: Dataset, setup: Setup, plan: Plan, clip: Clip, rest: Take, tell: Progress) -> Job[list[str]]:
    """Make what a dataset lacks of a clip, part after part.

    Args:
        dataset: The dataset.
        setup: Garment, body, settings.
        plan: The rest of what parts depend on.
        clip: The clip.
        rest: The settled drape on the body.
        tell: Called with frames done and frames in all.

    Returns:
        Names of its takes in order; the last may have failed.

    Raises:
        BadDataset: A take that is there cannot be read, or ends in a state that no simulation goes on from.
    """
    motion: Motion = yield Call(_placed, setup, (plan, clip.motion))
    names: list[str] = []
    end: EndState | None = None
    done = 0
    for index, part in enumerate(_parts(motion, plan.part_seconds)):
        inputs = part_inputs(setup, plan, clip, part, index, names[-1] if names else "")
        take = dataset.kept(inputs)
        if take is None:

            def heard(frame: int, total: int, offset: int = done) -> None:
                tell(min(offset + frame, len(motion)), len(motion))

            start = rest if end is None else None
            take, seconds = yield Call(_simulated, setup, (plan.betas, part, start, end), heard)
            take = replace(take, inputs=inputs)
            dataset.add(take, quantised=plan.quantised)
            dataset.log_timing(
                {
                    "take": take.name,
                    "clip": clip.motion.name,
                    "part": index,
                    "frames": len(take.motion),
                    "seconds": round(seconds, 3),
                }
            )
        else:
            check_end_of_take(take.end_state, setup, plan.betas, str(dataset.path(take.name)))
        names.append(take.name)
        end = take.end_state
        done += len(part)
        tell(done, len(motion))
        if take.failed:
            break
    return names


def part_inputs(setup: Setup, plan: Plan, clip: Clip, part: Motion, index: int, before: str) -> dict[str, Any]:
    """What a part of a clip depends on; the hash of it is its name."""
    return {
        "garment": setup.garment.hash,
        "body": setup.body.hash,
        "betas": list(plan.betas),
        "clip": clip.motion.name,
        "subject": clip.subject,
        "part": index,
        "motion": part.hash,
        "before": before,
        "settings": asdict(setup.settings),
        "simulator": SIMULATOR,
    }


def _placed(setup: Setup, given: tuple[Plan, Motion], tell: Progress) -> Motion:
    """A clip as the body makes it."""
    plan, motion = given
    body = shaped(setup, plan.betas)
    motion = body.placed(motion.resampled(setup.settings.fps))
    return body.untangled_motion(motion) if plan.untangle else motion


def _simulated(
    setup: Setup, given: tuple[tuple[float, ...], Motion, Take | None, EndState | None], tell: Progress
) -> tuple[Take, float]:
    """One part of a clip, and the seconds that it took."""
    betas, part, start, resume = given
    began = time.perf_counter()
    body = shaped(setup, betas)
    take = simulate(setup.garment, body, part, setup.settings, start=start, resume=resume, progress=tell)
    return take, time.perf_counter() - began


def _parts(motion: Motion, seconds: float) -> Iterator[Motion]:
    length = max(1, round(seconds * motion.fps))
    for first in range(0, len(motion), length):
        yield motion[first : first + length]


def _told_apart(names: Sequence[str]) -> list[str]:
    """The names of clips; where several have one, they are numbered."""
    met, count = Counter(names), Counter[str]()
    found = []
    for name in names:
        count[name] += 1
        found.append(f"{name} #{count[name]}" if met[name] > 1 else name)
    return found
