"""Simulates and settles what methods are fitted to and compared on, within the time that there is."""

import time
from dataclasses import replace
from pathlib import Path

from hemline import sim
from hemline.animators import Progress
from hemline.datasets import Dataset, open_dataset
from hemline.errors import SimulationFailed
from hemline.garments import Garment
from hemline.motions import open_motion

from .clips import FPS, clean_part, posed_clips, requests
from .clock import OutOfTime
from .job import Job
from .plan import DataPlan
from .regions import Regions

PROBE_CLIP, PROBE_FRAMES = "turn", slice(30, 91)
"""Clip, and its frames, on which it is measured where the garment hangs."""
CHECK_SHARE, LEAST_CHECK_S = 0.15, 1.0
"""Share of the time that may be spent on simulating the clip for the comparison, and its least length [s]."""


def probe_garment(job: Job) -> tuple[Regions, float]:
    """Simulates two seconds; returns where the garment hangs, and the time of a frame in one process [s].

    The time is that of the mesh that is simulated for fits, see `DataMesh`.
    """
    work, garment = job.work, job.garment
    motion = clean_part(open_motion(PROBE_CLIP))[PROBE_FRAMES]
    job.clock.begin("simulating two seconds to see what hangs", None)
    times: list[float] = []

    def report(clip: str, done: int, total: int) -> None:
        if done:
            times.append(time.monotonic())
        job.progress(clip, done, total)

    clips = [sim.ClipRequest(motion, "")]
    job.collect("probe", lambda folder, mesh: job.produce(folder, mesh, clips, report))
    probe = open_dataset(work.folder / "probe")
    frame_s = (times[-1] - times[0]) / (len(times) - 1) if len(times) > 1 else work.state.get("frame_s", 1.0)
    (row,) = probe.clips() or [None]
    if row is None:
        raise SimulationFailed(f"{garment.name} cannot be simulated: {probe.rows()[0].failed}")
    rest = job.settled()
    regions = Regions.of(probe.take(row), rest, garment.faces, job.body)
    work.note(frame_s=frame_s)
    return regions, frame_s


def shorten_check(job: Job, frame_s: float) -> Job:
    """Returns the run with a clip for the comparison that takes no more than `CHECK_SHARE` of the time to simulate.

    Args:
        job: The run.
        frame_s: Time of a simulated frame of the garment in one process [s].
    """
    frames = max(round(LEAST_CHECK_S * FPS) + 1, int(CHECK_SHARE * job.clock.total_s / max(frame_s, 1e-6)))
    return job if frames >= len(job.check) else replace(job, check=job.check[:frames])


def simulate_check(job: Job, frame_s: float) -> Dataset:
    """Simulates the clip that methods are compared on.

    Args:
        job: The run.
        frame_s: Time of a simulated frame of the garment in one process [s].

    Raises:
        SimulationFailed: The clip cannot be simulated to its end.
    """
    job.clock.begin("simulating the clip that methods are compared on", frame_s * len(job.check))
    data = job.simulate("check", [sim.ClipRequest(job.check, "")], job.progress)
    failed = [row.failed for row in data.rows() if row.failed]
    if failed:
        raise SimulationFailed(f"{job.garment.name} cannot be simulated: {failed[0]}")
    return data


def simulate_takes(job: Job, plan: DataPlan, expected_s: float, limit_s: float) -> None:
    """Simulates the clips of a plan, or as many as can be simulated within a time limit [s]."""
    clips = requests(job.clips, plan.frames)
    count = sum(len(clip.motion) for clip in clips)
    job.clock.begin(f"simulating {count} frames of {len(clips)} clips", expected_s)
    try:
        progress = job.clock.stop_late(job.progress, limit_s)
        job.collect("takes", lambda folder, mesh: job.produce(folder, mesh, clips, progress))
    except OutOfTime:
        job.clock.say("Not all clips were simulated: the time that is left is needed for the fit.")


def settle_drapes(job: Job, plan: DataPlan, expected_s: float, limit_s: float) -> DataPlan:
    """Settles the drapes of a plan, or as many as come to rest within a time limit [s].

    Returns:
        The plan; without AgentDress if the garment does not come to rest in the T-pose, from which drapes start.
    """
    bodies = f", {plan.anchors} of them on bodies of other shapes" if plan.anchors else ""
    job.clock.begin(f"putting the garment into {plan.poses + plan.anchors} poses{bodies}", expected_s)
    try:
        progress = job.clock.stop_late(job.progress, limit_s)
        job.collect("drapes", lambda folder, mesh: _make_database(job, plan, folder, mesh, progress))
    except OutOfTime:
        job.clock.say("Not all drapes were settled: the time that is left is needed for the fit.")
    except SimulationFailed as reason:
        left_out = f"agentdress needs drapes, and {reason}."
        job.clock.say(f"Not compared: {left_out}")
        methods = tuple(method for method in plan.methods if method != "agentdress")
        return replace(plan, methods=methods, poses=0, anchors=0, random=0, left_out=(*plan.left_out, left_out))
    return plan


def _make_database(job: Job, plan: DataPlan, folder: Path, mesh: Garment, progress: Progress) -> None:
    how = {"seed": job.settings.seed, "jobs": job.jobs, "scheduler": job.scheduler}
    how |= {"settings": job.simulation, "progress": progress}
    clips = posed_clips(job.clips)
    sim.make_tour(folder, mesh, clips, plan.poses, tour=folder.with_name("tour"), **how)
    if plan.anchors:
        sim.make_database(folder, mesh, clips, plan.anchors, random=plan.random, **how)
