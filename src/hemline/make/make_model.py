"""Makes a model of any garment mesh: try on, look, choose data, fit, compare, report."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hemline import bodies, sim
from hemline.animators import Progress
from hemline.animators.model_file import copy_with_entry
from hemline.errors import SimulationFailed
from hemline.files import check_writable
from hemline.motions import open_motion
from hemline.tryon import open_garment
from hemline.version import VERSION

from .candidates import candidate_path, remove_candidates, suitable_methods
from .choice import choose, faults
from .clips import ALL_FRAMES, CHECK_CLIP, FPS, clean_part, open_clips, posed_clips, requests
from .clock import Clock
from .comparison import Comparison
from .data_mesh import DataMesh
from .job import Job
from .plan import RESERVE, DataPlan, agentdress_seconds, plan_data, ropes_seconds
from .regions import Regions
from .report import Report, write_report
from .settings import MakeSettings
from .simulations import probe_garment, settle_drapes, shorten_check, simulate_check, simulate_takes
from .slowness import measure_slowness
from .trial import Trial, truth_trial
from .work_folder import inputs_hash, open_work_folder


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
    check = clean_part(open_motion(CHECK_CLIP))[: round(settings.check_seconds * FPS) + 1]
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
        ignore = progress or (lambda *step: None)
        mesh = DataMesh.of(worn, settings.minutes)
        simulation = sim.SimSettings()
        job = Job(settings, jobs, scheduler, motions, check, shaped, worn, mesh, simulation, work, clock, ignore)
        return _make(job.adapt_simulation(), path)


def _make(job: Job, path: Path) -> Outcome:
    work, clock = job.work, job.clock
    methods, left_out = _begin(job)
    regions, frame_s = probe_garment(job)
    job = shorten_check(job, frame_s * job.mesh.cost_ratio)
    check = simulate_check(job, frame_s * job.mesh.cost_ratio)
    found = Comparison(job, check)
    found.compare_unfitted(methods)
    plan = _plan(job, methods, left_out, regions, frame_s, found)
    expected = plan.seconds(frame_s, job.jobs, measure_slowness())
    if plan.frames:
        simulate_takes(job, plan, expected["simulate"], clock.remaining_s - found.later_s(plan.methods) - _fits(plan))
    if plan.poses:
        limit_s = clock.remaining_s - found.later_s(plan.methods) - _fits(plan)
        plan = settle_drapes(job, plan, expected["drape"], limit_s)
    found.compare_fitted(plan.methods)
    plan = replace(plan, left_out=plan.left_out + tuple(found.late))
    truth = truth_trial(check, job.check, job.body)
    chosen = choose(found.trials, truth, job.settings.ms)
    if chosen is None:
        reasons = [f"{trial.method}: {trial.failed}" for trial in found.failed] + list(plan.left_out)
        raise SimulationFailed("no method can play this garment: " + " ".join(reasons))
    trials, wrong = tuple(found.trials), tuple(faults(chosen, truth))
    table = {"chosen": chosen.method, "trials": [trial.entries() for trial in trials], "truth": truth.entries()}
    table |= {"clip": job.check.name, "hanging": regions.hanging_fraction}
    copy_with_entry(candidate_path(work, chosen.method), path, "made", table)
    clock.begin("writing the report", None)
    best = next(each for each in found.played if each.trial is chosen)
    count = len(job.mesh.vertex_ids)
    report = Report(job.garment, regions, plan, trials, truth, best, check, job.check, path, work.spent_s, count)
    page = write_report(path.with_suffix(".html"), report)
    work.note(done=True)
    return Outcome(path, page, work.folder, chosen, trials, truth, wrong, work.spent_s)


def _begin(job: Job) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Forgets the plan of another request; returns the methods, and why others are left out."""
    work, settings = job.work, job.settings
    asked = {"minutes": settings.minutes, "animator": settings.animator, "seed": settings.seed, "version": VERSION}
    if work.state.get("asked") != asked:
        remove_candidates(work)
        work.note(asked=asked, plan=None)
    return suitable_methods(settings.animator, job.body.body)


def _plan(
    job: Job,
    methods: tuple[str, ...],
    left_out: tuple[str, ...],
    regions: Regions,
    frame_s: float,
    found: Comparison,
) -> DataPlan:
    """Returns the plan of the run that is continued, or makes one."""
    work = job.work
    if work.state.get("plan"):
        return DataPlan.of_entries(work.state["plan"])
    seconds_left = job.clock.remaining_s - found.later_s(methods)
    most_frames = sum(len(each.motion) for each in requests(job.clips, ALL_FRAMES))
    most_poses = len(np.unique(sim.sample_poses(posed_clips(job.clips)), axis=0))
    plan = plan_data(
        methods,
        regions.hanging_fraction,
        frame_s,
        seconds_left,
        job.jobs,
        slowness=measure_slowness(),
        most_frames=most_frames,
        most_poses=most_poses,
    )
    plan = replace(plan, left_out=left_out + plan.left_out)
    work.note(plan=plan.entries())
    job.clock.say(f"{100 * regions.hanging_fraction:.0f} % of the cloth hangs; comparing {', '.join(plan.methods)}.")
    for reason in plan.left_out:
        job.clock.say(f"Not compared: {reason}")
    if plan.frames == most_frames:
        job.clock.say("All that the clips have is used, so the run may end early; more clips (-m) make a better model.")
    return plan


def _fits(plan: DataPlan) -> float:
    """Returns the least time that the fits of a plan take now [s]."""
    now = measure_slowness()
    ropes = ropes_seconds(plan.frames, now) if plan.frames else 0.0
    return (ropes + agentdress_seconds(plan.drapes, now)) / (1 - RESERVE)
