"""Simulates many clips into a dataset: clips are cut into parts, shared out over processes, and continued after a kill.

The name of a take is the hash of its inputs, so that existing takes are known before anything is made, and a repeated
command makes only what is missing. A part continues from the end state that the part before it stored.
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

from .end_state import EndState, check_end_of_take
from .jobs import Call, Job, Progress, Report, run_jobs
from .rest_states import rest_job
from .setup import Setup, shaped_body
from .simulate import simulate
from .start_dataset import start_dataset
from .workers import workers

PART_SECONDS = 10.0
"""Length of the parts that clips are cut into: a killed run loses at most this much cloth time [s]."""


@dataclass(frozen=True)
class ClipRequest:
    """One clip to simulate."""

    motion: Motion
    """The clip as it was read, at its own frame rate."""
    subject: str
    """Name of the person who was captured."""


@dataclass(frozen=True)
class Plan:
    """The inputs that all takes of some clips share, besides their setup."""

    betas: tuple[float, ...] = ()
    """Shape of the body."""
    untangle: bool = True
    """Whether to lift intersecting limbs out of each other first."""
    quantised: bool = False
    """Whether to store vertices in steps of 10 micrometres."""
    part_seconds: float = PART_SECONDS
    """Length of the parts that clips are cut into [s]."""


def produce(
    folder: str | Path,
    garment: Garment,
    clips: Sequence[ClipRequest],
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
    """Simulates a garment against clips into a dataset; existing takes are kept.

    Args:
        folder: The dataset; created if missing.
        garment: The garment, made on the body of `garment.body_name`.
        clips: The clips.
        betas: Shape of the body.
        settings: Settings of the simulator.
        untangle: Whether to lift intersecting limbs out of each other first.
        jobs: Number of processes. The takes do not depend on it.
        scheduler: Address of a dask scheduler whose workers simulate instead; see `workers`.
        quantised: Whether to store vertices in steps of 10 micrometres.
        part_seconds: Length of the parts that clips are cut into [s].
        report: Called with the name of a clip, the frames done and the total number of frames; first with 0 for each
            clip.

    Returns:
        The index rows of the takes, including failed ones, in the order of the clips.

    Raises:
        BadDataset: The folder holds another garment's takes, or one that cannot be read or continued.
        BadOutput: The folder cannot be written.
        BadCluster: No scheduler answers, it went away, or its workers cannot make the calls; finished takes are kept.
    """
    plan = Plan(tuple(betas), untangle, quantised, part_seconds)
    setup = Setup.of(garment, settings)
    tell = report or (lambda clip, done, total: None)
    names_of_clips = _unique_names([clip.motion.name for clip in clips])
    with workers(jobs, scheduler) as makers:
        dataset = start_dataset(folder, garment)
        for name, clip in zip(names_of_clips, clips, strict=True):
            tell(name, 0, clip.motion.frames_at(setup.settings.fps))
        (rest,) = run_jobs([rest_job(dataset, setup, plan.betas)], makers)
        work = (
            clip_job(dataset, setup, plan, clip, rest, lambda done, total, name=name: tell(name, done, total))
            for name, clip in zip(names_of_clips, clips, strict=True)
        )
        names = [name for made in run_jobs(work, makers) for name in made]
    by_name = {row.name: row for row in dataset.rows()}
    return [by_name[name] for name in names]


def clip_job(
    dataset: Dataset, setup: Setup, plan: Plan, clip: ClipRequest, rest: Take, tell: Progress
) -> Job[list[str]]:
    """Makes the missing takes of a clip, part after part.

    Args:
        dataset: The dataset.
        setup: Garment, body, settings.
        plan: Other inputs of the parts.
        clip: The clip.
        rest: The settled drape on the body.
        tell: Called with the frames done and the total number of frames.

    Returns:
        Names of the takes in order; the last may have failed.

    Raises:
        BadDataset: An existing take cannot be read, or ends in a state that no simulation can continue from.
    """
    motion: Motion = yield Call(_place_motion, setup, (plan, clip.motion))
    names: list[str] = []
    end: EndState | None = None
    done = 0
    for index, part in enumerate(_parts(motion, plan.part_seconds)):
        inputs = part_inputs(setup, plan, clip, part, index, names[-1] if names else "")
        take = dataset.find_by_inputs(inputs)
        if take is None:

            def on_progress(frame: int, total: int, offset: int = done) -> None:
                tell(min(offset + frame, len(motion)), len(motion))

            start = rest if end is None else None
            take, seconds = yield Call(_simulate_part, setup, (plan.betas, part, start, end), on_progress)
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


def part_inputs(setup: Setup, plan: Plan, clip: ClipRequest, part: Motion, index: int, before: str) -> dict[str, Any]:
    """Returns the inputs of a part of a clip, whose hash is its name."""
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


def _place_motion(setup: Setup, argument: tuple[Plan, Motion], tell: Progress) -> Motion:
    """Returns a clip as the body performs it."""
    plan, motion = argument
    body = shaped_body(setup, plan.betas)
    motion = body.placed(motion.resample(setup.settings.fps))
    return body.untangle_motion(motion) if plan.untangle else motion


def _simulate_part(
    setup: Setup, argument: tuple[tuple[float, ...], Motion, Take | None, EndState | None], tell: Progress
) -> tuple[Take, float]:
    """Simulates one part of a clip; returns the take and the seconds it took."""
    betas, part, start, resume = argument
    began = time.perf_counter()
    body = shaped_body(setup, betas)
    take = simulate(setup.garment, body, part, setup.settings, start=start, resume=resume, progress=tell)
    return take, time.perf_counter() - began


def _parts(motion: Motion, seconds: float) -> Iterator[Motion]:
    """Yields parts of a motion."""
    length = max(1, round(seconds * motion.fps))
    for first in range(0, len(motion), length):
        yield motion[first : first + length]


def _unique_names(names: Sequence[str]) -> list[str]:
    """Returns the names of clips; if several clips share a name, they are numbered."""
    total, count = Counter(names), Counter[str]()
    unique = []
    for name in names:
        count[name] += 1
        unique.append(f"{name} #{count[name]}" if total[name] > 1 else name)
    return unique
