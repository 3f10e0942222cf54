"""Many takes into a dataset: clips cut into parts, shared out over processes, continued after a kill.

A take's name is the hash of its inputs, so what is already there is known before it is made, and a command that is
run again makes only what is missing. A part goes on from the end state that the part before it stored.
"""

import functools
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hemline import bodies
from hemline.datasets import Dataset, Row, Take, create, open_dataset, read_take, take_name
from hemline.errors import BadInput
from hemline.garments.garment import Garment
from hemline.motions.motion import Motion
from hemline.sim.settings import SimSettings

from .processes import Report, in_processes
from .rest_states import rest_of
from .simulate import simulate

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

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
    """All that a worker needs, small enough to be sent to another process."""

    folder: Path
    body_name: str
    betas: tuple[float, ...]
    settings: SimSettings
    untangle: bool
    quantised: bool
    part_seconds: float


def produce(
    folder: str | Path,
    garment: Garment,
    clips: Sequence[Clip],
    *,
    betas: Sequence[float] = (),
    settings: SimSettings | None = None,
    untangle: bool = True,
    jobs: int = 1,
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
        quantised: Store vertices in steps of 10 micrometres.
        part_seconds: Length of the parts that clips are cut into [s].
        report: Called with a clip's name, the frames done and the frames asked for.

    Returns:
        The index rows of the takes asked for, failed ones included, in the order of the clips.

    Raises:
        BadDataset: The folder holds another garment's takes.
        BadOutput: It cannot be written.
    """
    plan = Plan(
        Path(folder), garment.body_name, tuple(betas), settings or SimSettings(), untangle, quantised, part_seconds
    )
    dataset = create(folder, garment)
    rest_of(dataset, _shaped(plan.body_name, plan.betas), plan.settings)
    tell = report or (lambda clip, done, total: None)
    names = [name for made in in_processes(_work, [(plan, clip) for clip in clips], jobs, tell) for name in made]
    by_name = {row.name: row for row in dataset.rows()}
    return [by_name[name] for name in names]


def part_inputs(plan: Plan, dataset: Dataset, clip: Clip, part: Motion, index: int, before: str) -> dict[str, Any]:
    """What a part of a clip depends on; the hash of it is its name."""
    return {
        "garment": dataset.garment.hash,
        "body": bodies.load(plan.body_name).hash,
        "betas": list(plan.betas),
        "clip": clip.motion.name,
        "subject": clip.subject,
        "part": index,
        "motion": part.hash,
        "before": before,
        "settings": asdict(plan.settings),
    }


@functools.lru_cache(maxsize=1)
def _shaped(body_name: str, betas: tuple[float, ...]) -> "ShapedBody":
    """The body of all clips: what is prepared for it, such as the balls that untangling fills it with, is kept."""
    return bodies.load(body_name).shaped(betas)


def _parts(motion: Motion, seconds: float) -> Iterator[Motion]:
    length = max(1, round(seconds * motion.fps))
    for first in range(0, len(motion), length):
        yield motion[first : first + length]


def _clip_takes(plan: Plan, dataset: Dataset, clip: Clip, tell: Report) -> list[str]:
    """Make what is missing of one clip; the names of its takes in order."""
    shaped = _shaped(plan.body_name, plan.betas)
    motion = shaped.placed(clip.motion.resampled(plan.settings.fps))
    motion = shaped.untangled_motion(motion) if plan.untangle else motion
    names: list[str] = []
    before: Take | None = None
    done = 0
    for index, part in enumerate(_parts(motion, plan.part_seconds)):
        inputs = part_inputs(plan, dataset, clip, part, index, names[-1] if names else "")
        take = _kept(dataset.path(take_name(inputs)))
        if take is None:
            resume = before.end_state if before else None
            start = rest_of(dataset, shaped, plan.settings) if before is None else None
            began = time.perf_counter()
            offset = done

            def progress(frame: int, total: int, offset: int = offset) -> None:
                tell(clip.motion.name, min(offset + frame, len(motion)), len(motion))

            take = simulate(dataset.garment, shaped, part, plan.settings, start=start, resume=resume, progress=progress)
            take = replace(take, inputs=inputs)
            dataset.add(take, quantised=plan.quantised)
            seconds = time.perf_counter() - began
            dataset.log_timing(
                {
                    "take": take.name,
                    "clip": clip.motion.name,
                    "part": index,
                    "frames": len(take.motion),
                    "seconds": round(seconds, 3),
                }
            )
        names.append(take.name)
        before = take
        done += len(part)
        tell(clip.motion.name, done, len(motion))
        if take.failed:
            break
    return names


def _kept(path: Path) -> Take | None:
    """The take at that path, or None if it is missing or damaged."""
    if not path.exists():
        return None
    try:
        return read_take(path)
    except BadInput:
        path.unlink()
        return None


def _work(given: tuple[Plan, Clip], tell: Report) -> list[str]:
    plan, clip = given
    return _clip_takes(plan, open_dataset(plan.folder), clip, tell)
