"""Makes a model of any garment mesh: try on, look, choose data, fit, compare, report."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from hemline import bodies, sim
from hemline.animators import Progress
from hemline.animators.model_file import copy_with_entry
from hemline.bodies import ShapedBody
from hemline.datasets import Dataset, open_dataset
from hemline.errors import SimulationFailed
from hemline.files import check_writable
from hemline.garments import Garment
from hemline.metrics import model_mb
from hemline.motions import Motion, open_motion
from hemline.tryon import open_garment
from hemline.version import VERSION

from .candidates import make_candidate, remove_candidates, suitable_methods, try_candidate
from .choice import choose, faults
from .clips import CHECK_CLIP, FPS, clean_part, open_clips, requests
from .clock import Clock
from .plan import DataPlan, plan_data
from .regions import Regions
from .report import Report, write_report
from .settings import MakeSettings
from .trial import Played, Trial, run_trial, truth_trial
from .work_folder import WorkFolder, inputs_hash, open_work_folder

PROBE_CLIP, PROBE_FRAMES = "turn", slice(30, 91)
"""Clip, and its frames, on which it is measured where the garment hangs."""


@dataclass(frozen=True)
class Outcome:
    """A model that was made.

    Attributes:
        model: The model file.
        report: The page about it.
        folder: Folder with garment, datasets and the models of all methods.
        chosen: Figures of the method that was chosen.
        trials: Figures of all methods that were compared.
        truth: Figures of the simulation.
        faults: What is wrong with the chosen one, one phrase each; empty if it is sound.
        seconds: Time that it took [s].
    """

    model: Path
    report: Path
    folder: Path
    chosen: Trial
    trials: tuple[Trial, ...]
    truth: Trial
    faults: tuple[str, ...]
    seconds: float


@dataclass(frozen=True)
class _Job:
    """What all steps need."""

    settings: MakeSettings
    jobs: int
    scheduler: str | None
    clips: list[Motion]
    check: Motion
    body: ShapedBody
    work: WorkFolder
    clock: Clock
    progress: Progress


def make_model(
    garment: str,
    model: str | Path,
    settings: MakeSettings | None = None,
    *,
    clips: Sequence[str] = (),
    up: str | None = None,
    material: str | None = None,
    body: str = "anny24",
    jobs: int = 1,
    scheduler: str | None = None,
    say: Callable[[str], None] | None = None,
    progress: Progress | None = None,
) -> Outcome:
    """Makes the model that plays a garment best, chosen by measurement, and a report.

    A run that was killed continues if it is started again. Its folder is kept beside the model.

    Args:
        garment: A mesh file, a garment file or the name of a garment, as for `hemline.open_garment`.
        model: The model file to write (.safetensors).
        settings: Options.
        clips: Clips to simulate, as for `hemline.motions.open_motion`; the shipped ones if none is named.
        up: Axis of the clips that points up, as for `hemline.motions.open_motion`; None to find it.
        material: Material of the garment; None for its own.
        body: Name or file of the body.
        jobs: Number of processes.
        scheduler: Address of a dask scheduler whose workers simulate instead.
        say: Called with a line of text before each step.
        progress: Called with the stage, the steps done and the total number of steps.

    Raises:
        BadGarment: The garment cannot be worn; the reason is given before anything is simulated on clips.
        BadInput: An option or a clip is bad.
        BadOutput: The model cannot be written, or another run works in its folder.
        SimulationFailed: The garment cannot be simulated, or every method failed.
    """
    settings, tell = settings or MakeSettings(), say or (lambda line: None)
    path = Path(model)
    check_writable(path)
    motions, shaped = open_clips(clips, up), bodies.load(body).shaped()
    check = clean_part(open_motion(CHECK_CLIP))[: round(settings.seconds * FPS) + 1]
    inputs = inputs_hash(
        garment, {"material": material, "body": shaped.body.hash, "clips": [clip.hash for clip in motions]}
    )
    with open_work_folder(path, inputs) as work:
        if not work.fresh:
            tell(f"Continuing in {work.folder}, {work.spent_s / 60:.1f} minutes in.")
        clock = Clock(60 * settings.minutes, work, tell)
        clock.begin(f"trying {garment} on", None)
        worn = open_garment(
            garment,
            shaped,
            dressed=False,
            material=material,
            dataset=work.folder,
            say=tell,
            progress=None if progress is None else lambda done, total: progress("try on", done, total),
        )
        worn.save(work.folder / "garment.safetensors")
        job = _Job(settings, jobs, scheduler, motions, check, shaped, work, clock, progress or (lambda *step: None))
        return _make(job, worn, path)


def _make(job: _Job, garment: Garment, path: Path) -> Outcome:
    work, clock = job.work, job.clock
    regions, frame_s = _probe(job, garment)
    plan = _plan(job, regions, frame_s)
    expected = plan.seconds(frame_s, job.jobs)
    check = _simulate(job, "check", garment, [job.check], frame_s)
    if plan.frames:
        clips = requests(job.clips, plan.frames)
        count = sum(len(clip.motion) for clip in clips)
        clock.begin(f"simulating {count} frames of {len(clips)} clips", expected["simulate"])
        _produce(job, "takes", garment, clips)
    if plan.anchors:
        clock.begin(f"settling {plan.drapes} drapes in {plan.anchors + plan.poses} poses", expected["drape"])
        _drape(job, garment, plan)
    played, failed = _compare(job, garment, plan, check)
    truth = truth_trial(check, job.check, job.body)
    trials = [each.trial for each in played] + failed
    chosen = choose(trials, truth, job.settings.ms)
    if chosen is None:
        raise SimulationFailed("every method failed: " + "; ".join(f"{t.method}: {t.failed}" for t in failed))
    wrong = tuple(faults(chosen, truth))
    candidate = work.folder / "candidates" / f"{chosen.method}.safetensors"
    table = {"chosen": chosen.method, "trials": [trial.entries() for trial in trials], "truth": truth.entries()}
    copy_with_entry(candidate, path, "made", table | {"clip": job.check.name, "hanging": regions.hanging_fraction})
    clock.begin("writing the report", None)
    best = next(each for each in played if each.trial is chosen)
    report = Report(garment, regions, plan, tuple(trials), truth, best, check, job.check, path, work.spent_s)
    page = write_report(path.with_suffix(".html"), report)
    work.note(done=True)
    return Outcome(path, page, work.folder, chosen, tuple(trials), truth, wrong, work.spent_s)


def _probe(job: _Job, garment: Garment) -> tuple[Regions, float]:
    """Simulates two seconds; returns where the garment hangs, and the time of a frame [s]."""
    work = job.work
    motion = clean_part(open_motion(PROBE_CLIP))[PROBE_FRAMES]
    job.clock.begin("simulating two seconds to see what hangs", None)
    times: list[float] = []

    def report(clip: str, done: int, total: int) -> None:
        if done:
            times.append(time.monotonic())
        job.progress(clip, done, total)

    probe = _produce(replace(job, progress=report), "probe", garment, [sim.ClipRequest(motion, "")])
    frame_s = (times[-1] - times[0]) / (len(times) - 1) if len(times) > 1 else work.state.get("frame_s", 1.0)
    (row,) = probe.clips() or [None]
    if row is None:
        raise SimulationFailed(f"{garment.name} cannot be simulated: {probe.rows()[0].failed}")
    rest = probe.rest(garment.body_betas).vertices[0]
    regions = Regions.of(probe.take(row), rest, garment.faces, job.body)
    work.note(frame_s=frame_s)
    return regions, frame_s


def _plan(job: _Job, regions: Regions, frame_s: float) -> DataPlan:
    """Returns the plan of the run that is continued, or makes one."""
    work, settings = job.work, job.settings
    asked = {"minutes": settings.minutes, "animator": settings.animator, "seed": settings.seed, "version": VERSION}
    if work.state.get("asked") == asked:
        return DataPlan.of_entries(work.state["plan"])
    methods, left_out = suitable_methods(settings.animator, job.body.body)
    seconds_left = job.clock.remaining_s - frame_s * len(job.check)
    plan = plan_data(methods, regions.hanging_fraction, frame_s, seconds_left, job.jobs)
    plan = replace(plan, left_out=left_out + plan.left_out)
    remove_candidates(work)
    work.note(asked=asked, plan=plan.entries())
    job.clock.say(f"{100 * regions.hanging_fraction:.0f} % of the cloth hangs; comparing {', '.join(plan.methods)}.")
    for reason in plan.left_out:
        job.clock.say(f"Not compared: {reason}")
    return plan


def _simulate(job: _Job, name: str, garment: Garment, clips: list[Motion], frame_s: float) -> Dataset:
    """Simulates whole clips into a dataset of the folder; fails if a clip fails."""
    job.clock.begin("simulating the clip that methods are compared on", frame_s * sum(map(len, clips)))
    data = _produce(job, name, garment, [sim.ClipRequest(clip, "") for clip in clips])
    failed = [row.failed for row in data.rows() if row.failed]
    if failed:
        raise SimulationFailed(f"{garment.name} cannot be simulated: {failed[0]}")
    return data


def _produce(job: _Job, name: str, garment: Garment, clips: Sequence[sim.ClipRequest]) -> Dataset:
    sim.produce(
        job.work.folder / name,
        garment,
        clips,
        jobs=job.jobs,
        scheduler=job.scheduler,
        report=job.progress,
    )
    return open_dataset(job.work.folder / name)


def _drape(job: _Job, garment: Garment, plan: DataPlan) -> None:
    sim.make_database(
        job.work.folder / "drapes",
        garment,
        job.clips,
        plan.anchors,
        beside=plan.poses,
        random=plan.random,
        seed=job.settings.seed,
        jobs=job.jobs,
        scheduler=job.scheduler,
        progress=job.progress,
    )


def _compare(job: _Job, garment: Garment, plan: DataPlan, check: Dataset) -> tuple[list[Played], list[Trial]]:
    """Makes each candidate and plays it; returns those that played, and those that failed with the reason."""
    played: list[Played] = []
    failed: list[Trial] = []
    for method in plan.methods:
        job.clock.begin(f"comparing {method}", None)
        made = try_candidate(
            lambda method=method: make_candidate(method, job.work, garment, job.body, job.settings.seed, job.progress)
        )
        if isinstance(made, str):
            failed.append(Trial(method, failed=made))
            continue
        animator, file = made
        played.append(run_trial(animator, job.body, job.check, check, model_mb(file)))
    return played, failed
