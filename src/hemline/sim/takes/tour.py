"""Poses of one body on a tour: a body moves through them one after the other, and the garment that it wears is kept.

A walk into each pose by itself (`make_database`) costs several times as much. In return it starts from the same drape
each time and stands still at the end, so that drapes can be compared to the millimetre.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from hemline.bodies.lifted_arms import LIFT_DEG
from hemline.datasets import Dataset, Take, create, open_dataset, take_name
from hemline.datasets.joint_sensitivity import joint_weights, mean_sensitivity
from hemline.errors import SimulationFailed
from hemline.garments.garment import Garment
from hemline.motions.motion import JOINT_COUNT, Motion, Pose
from hemline.motions.pose_clusters import cluster_poses
from hemline.motions.pose_tour import order_poses, pose_tour
from hemline.sim.settings import SimSettings

from .anchors import produce_scattered
from .database import sample_poses
from .jobs import Report
from .produce import ClipRequest, produce
from .setup import Setup

TOUR = "tour 2"
"""Name of this protocol, which drapes of a tour have among their inputs. A change of the numbers needs a new name."""
TOUR_FRAMES, TOUR_FPS = 8, 30.0
"""Number of frames in which the body moves from one pose to the next, and frame rate [frames/s]."""
PART_POSES = 37
"""Number of poses of one clip: with so many it stays below ten seconds, and a killed run loses at most one."""


def make_tour(
    folder: str | Path,
    garment: Garment,
    clips: Sequence[Motion],
    count: int,
    *,
    tour: str | Path,
    seed: int = 0,
    jobs: int = 1,
    scheduler: str | None = None,
    settings: SimSettings | None = None,
    progress: Report | None = None,
) -> int:
    """Puts a garment into representative poses of some clips, on the mean body, along a tour, into a dataset.

    The garment is first settled in the T-pose with derivatives by every joint, which weight the joints, as in
    `make_database`. Existing takes are kept.

    Args:
        folder: The dataset of drapes; created if missing.
        garment: The garment.
        clips: Clips that the poses are taken from.
        count: Number of poses; fewer if the clips have fewer.
        tour: Dataset of the simulated tour; created if missing.
        seed: Seed of the clustering.
        jobs: Number of processes. The results do not depend on it.
        scheduler: Address of a dask scheduler whose workers simulate instead; see `workers`.
        settings: Settings of the simulator.
        progress: Called with the name of a stage, the steps done and the total number of steps.

    Returns:
        The number of drapes. Parts of the tour in which a limb is through the cloth or the cloth is torn are left out.
        Those that were simulated are kept if a callback stops the work by an exception.

    Raises:
        SimulationFailed: The garment does not come to rest in the T-pose.
        BadDataset: A folder holds another garment's takes.
        BadOutput: A folder cannot be written.
        BadCluster: No scheduler answers, it went away, or its workers cannot make the calls; finished takes are kept.
    """
    tell = progress or (lambda stage, done, total: None)
    body = Setup.of(garment, settings).body.shaped()
    upright = Pose(np.tile([1.0, 0.0, 0.0, 0.0], (JOINT_COUNT, 1)), body.rest_pose.translation)
    every = range(JOINT_COUNT)
    (t_pose,) = produce_scattered(folder, garment, [upright], [()], turns=every, settings=settings, jobs=1)
    if t_pose is None:
        raise SimulationFailed(f"'{garment.name}' does not come to rest in the T-pose")
    weights = joint_weights(mean_sensitivity([open_dataset(folder).take(t_pose.names[0])], body.body))
    poses = sample_poses(clips)
    chosen = [poses[each[0]] for each in cluster_poses(poses, weights, min(count, len(poses)), seed=seed).members]
    ordered = np.array(chosen)[order_poses(np.array(chosen), weights)]
    requests = [
        ClipRequest(_part(ordered[first : first + PART_POSES], body.leg_length, body.rest_pose.translation, number), "")
        for number, first in enumerate(range(0, len(ordered), PART_POSES))
    ]
    report = _counter(tell, len(requests))
    try:
        produce(tour, garment, requests, settings=settings, jobs=jobs, scheduler=scheduler, report=report)
    finally:
        kept = keep_poses(create(tour, garment), folder)
    return kept


def keep_poses(tour: Dataset, folder: str | Path) -> int:
    """Writes the garment in each pose of a tour into a dataset of drapes; existing ones are kept.

    Args:
        tour: Dataset of the simulated tour.
        folder: The dataset of drapes; created if missing.

    Returns:
        The number of poses of the tour.
    """
    drapes, count = create(folder, tour.garment), 0
    for row in tour.clips():
        take = tour.take(row)
        for frame in take.clip_frames[::TOUR_FRAMES]:
            drape = _drape(take, int(frame))
            count += 1
            if not drapes.path(take_name(drape.inputs)).exists():
                drapes.add(drape)
    return count


def _part(poses: np.ndarray, leg_length: float, place: np.ndarray, number: int) -> Motion:
    name = f"tour {number}"
    return pose_tour(poses, place, TOUR_FRAMES, fps=TOUR_FPS, leg_length=leg_length, name=name)


def _drape(take: Take, frame: int) -> Take:
    """Returns one frame of a take as an anchor."""
    motion = take.motion[frame : frame + 1]
    inputs = {name: take.inputs[name] for name in ("garment", "body", "settings", "simulator")}
    inputs |= {
        "kind": "anchor",
        "protocol": TOUR,
        "lift_deg": LIFT_DEG,
        "take": take.name,
        "frame": frame,
        "pose": motion[0].hash,
    }
    return Take(
        kind="anchor",
        vertices=take.vertices[frame : frame + 1],
        motion=motion,
        betas=take.betas,
        lead_in=np.zeros(1, bool),
        pinched=take.pinched[frame : frame + 1],
        figures={},
        inputs=inputs | {"betas": [float(beta) for beta in take.betas]},
        made_with=take.made_with,
    )


def _counter(tell: Report, parts: int) -> Report:
    """Returns a report that adds up the frames of all parts."""
    done: dict[str, tuple[int, int]] = {}

    def report(name: str, one: int, of: int) -> None:
        done[name] = one, of
        total = sum(of for _, of in done.values()) * parts // len(done)
        tell("poses", sum(one for one, _ in done.values()), total)

    return report
