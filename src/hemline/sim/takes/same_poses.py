"""Settles the garment of a dataset again in some of its poses, in another material, to measure the effect of the
material.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from hemline.datasets import Dataset
from hemline.datasets.arm_lift import arm_lift_deg
from hemline.datasets.joint_sensitivity import joint_weights, mean_sensitivity
from hemline.datasets.take import Take
from hemline.errors import BadInput
from hemline.garments.garment import Garment
from hemline.motions.motion import Pose
from hemline.motions.pose_clusters import cluster_poses
from hemline.sim.settings import SimSettings

from .anchor_jobs import HANGING, WalkRules
from .anchors import MAX_STAND_INS, PosedTakes, produce_posed
from .jobs import Report


def produce_in_poses_of(
    folder: str | Path,
    garment: Garment,
    other: Dataset,
    count: int,
    *,
    seed: int = 0,
    jobs: int = 1,
    scheduler: str | None = None,
    settings: SimSettings | None = None,
    report: Report | None = None,
) -> list[PosedTakes | None]:
    """Settles a garment in poses of another dataset on the mean shape, into a dataset of its own.

    The poses are the centres of as many clusters; existing takes are kept.

    Args:
        folder: The dataset; created if missing.
        garment: The garment of the other dataset, in another material.
        other: A dataset made by `make_database`.
        count: Number of poses.
        seed: Seed of the clustering.
        jobs: Number of processes. The results do not depend on it.
        scheduler: Address of a dask scheduler whose workers settle instead; see `workers`.
        settings: Settings of the simulator.
        report: See `produce_posed`.

    Returns:
        The takes of each pose; None if the garment came to rest in no pose of its cluster.

    Raises:
        BadInput: The garment is another one or in its own material, or there are fewer poses than requested.
        BadGarment: The garment has several pieces.
        BadDataset: The other dataset has no T-pose with derivatives, or the folder holds another garment's takes.
        BadOutput: The folder cannot be written.
        BadCluster: No scheduler answers, it went away, or its workers cannot make the calls; finished takes are kept.
    """
    if garment.in_material(other.garment.material).hash != other.garment.hash:
        got = f"'{garment.name}' and '{other.garment.name}' of {other.folder}"
        raise BadInput("the poses of a dataset are for its own garment, of any material", got, "name that garment")
    if garment.material == other.garment.material:
        what = f"{other.folder} has '{garment.name}' of that material"
        raise BadInput(what, garment.material.name, "name another material")
    takes = [other.take(row) for row in other.anchors()]
    weights = joint_weights(mean_sensitivity(takes, other.body))
    poses = on_the_mean_shape(takes)
    if not 1 <= count <= len(poses):
        cure = f"ask for 1 to {len(poses)} of them (--poses)"
        raise BadInput(f"{other.folder} has {len(poses)} poses on the mean shape", count, cure)
    clusters = cluster_poses(np.array([pose.rotations for pose in poses], np.float64), weights, count, seed=seed)
    candidates = [[poses[index] for index in members[:MAX_STAND_INS]] for members in clusters.members]
    lift_deg = arm_lift_deg(other)
    rules, how = WalkRules(lift_deg=lift_deg) if lift_deg else HANGING, {"settings": settings, "jobs": jobs}
    return produce_posed(folder, garment, candidates, rules=rules, scheduler=scheduler, report=report, **how)


def on_the_mean_shape(takes: Sequence[Take]) -> list[Pose]:
    """Returns the poses of settled takes on the mean shape, each once, without takes that have derivatives."""
    plain = [take for take in takes if not take.derivatives and not np.any(take.betas)]
    return list({take.motion[0].hash: take.motion[0] for take in plain}.values())
