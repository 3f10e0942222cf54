"""The database of AgentDress: poses chosen from clips, and the garment settled in them on bodies of many shapes."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hemline.arrays import Float, Int
from hemline.bodies.lifted_arms import LIFT_DEG, lift_pose_arms
from hemline.datasets import Dataset, open_dataset
from hemline.datasets.joint_sensitivity import joint_weights, mean_sensitivity
from hemline.errors import BadInput, SimulationFailed
from hemline.garments.garment import Garment
from hemline.motions.motion import JOINT_COUNT, Motion, Pose
from hemline.motions.pose_clusters import PoseClusters, cluster_poses, farthest_poses, square_distances, without_heading
from hemline.motions.quaternions import angle, inverse, multiply
from hemline.sim.settings import SimSettings

from .anchor_jobs import HANGING, LIFTED, WalkRules
from .anchors import MAX_STAND_INS, PosedTakes, produce_posed, produce_scattered
from .jobs import Report
from .rest_states import axis_shapes, random_shapes
from .setup import Setup

SAMPLED_FPS, SAMPLE_STRIDE = 30.0, 4
"""Frame rate at which clips are sampled, and number of its frames from one pose to the next."""

SHAPE_BETAS = 4
"""Number of betas that are each -2, -1, 1 and 2 in turn, which gives seventeen shapes with the mean one."""

SEED_OF_BODIES = 1_000_000
"""Added to the seed for random bodies, so that they differ from those that a test is likely to draw."""


HANGING_LIFT_DEG = 3.0
"""Arms hang in a pose if they would be lifted by more than this [deg]."""

RANDOM_HANGING = 3
"""One of so many random bodies is settled in a pose with hanging arms, if there are such poses."""


@dataclass(frozen=True)
class Database:
    """The contents of a database.

    Attributes:
        clusters: Clusters of the poses of the clips.
        weights: Weight of each joint in the comparison of poses.
        anchors: Takes of each cluster, on the bodies on which the garment came to rest; None if it came to rest in no
            pose of the cluster.
        beside: Takes of the poses on the mean shape alone, or None likewise.
        far: Takes of the poses far from all of these, on the mean shape alone, or None likewise.
        hanging: Takes of the poses with hanging arms on the mean shape alone, or None likewise.
        random: Takes of the random bodies, each in a pose of `beside` or `far`, or of `anchors` if there is none, or of
            `hanging`, or None likewise.
        shapes: Betas of the bodies of the anchors.
    """

    clusters: PoseClusters
    weights: Float[np.ndarray, " joints"]
    anchors: list[PosedTakes | None]
    beside: list[PosedTakes | None]
    far: list[PosedTakes | None]
    hanging: list[PosedTakes | None]
    random: list[PosedTakes | None]
    shapes: list[tuple[float, ...]]

    def shortfall(self) -> str | None:
        """Says in one line with counts how the database differs from what was asked for; None if it does not."""
        found = [anchor for anchor in self.anchors if anchor is not None]
        partial = [len(self.shapes) - len(anchor.names) for anchor in found if len(anchor.names) < len(self.shapes)]
        others = sum(anchor.candidate > 0 for anchor in found)
        empty = len(self.anchors) - len(found)
        parts = [f"{others} in another pose of their cluster"] * bool(others)
        if partial:
            parts.append(f"{len(partial)} without some bodies ({sum(partial)} of {len(self.shapes) * len(partial)})")
        parts += [f"{empty} left out, as no pose of their cluster came to rest"] * bool(empty)
        parts = [f"of {len(self.anchors)} anchors " + ", ".join(parts)] * bool(parts)
        for name, takes in (
            ("poses on one body", self.beside),
            ("far poses", self.far),
            ("poses with hanging arms", self.hanging),
            ("random bodies", self.random),
        ):
            missing = sum(each is None for each in takes)
            parts += [f"{missing} of {len(takes)} {name} left out"] * bool(missing)
        return "; ".join(parts) or None


def make_database(
    folder: str | Path,
    garment: Garment,
    clips: Sequence[Motion],
    count: int,
    *,
    beside: int = 0,
    far: int = 0,
    hanging: int = 0,
    random: int = 0,
    derivatives: bool = False,
    seed: int = 0,
    jobs: int = 1,
    scheduler: str | None = None,
    settings: SimSettings | None = None,
    progress: Report | None = None,
) -> Database:
    """Settles a garment in representative poses of some clips, on seventeen shapes, into a dataset.

    The garment is first settled in the T-pose with derivatives by every joint, which weight the joints. It is then
    settled in the central poses of the requested number of clusters, with arms lifted off the torso (`lift_pose_arms`).
    Existing takes are kept.

    Args:
        folder: The dataset; created if missing.
        garment: The garment.
        clips: Clips that the poses are taken from.
        count: Number of anchors.
        beside: Number of additional poses, the centres of as many clusters of their own, in which the garment is
            settled on the mean shape alone. Effects of poses need more takes than effects of shapes, and each costs a
            seventeenth.
        far: Number of additional poses that are farthest from all of these, such as high kicks, in which the garment is
            settled on the mean shape alone. The middles of clusters are common poses.
        hanging: Number of additional poses with hanging arms, which are not lifted, in which the garment is settled on
            the mean shape alone. Cloth is pinched in the armpits there. A model that is fitted to such poses need not
            lift arms, nor hand a garment back by skinning.
        random: Number of bodies of random shapes, with all betas drawn, on each of which the garment is settled in one
            of the poses beside the anchors or far from them, in turn, or of the anchors; and on one body of three in a
            pose with hanging arms, if there are any. The seventeen bodies vary the first four betas alone, one at a
            time.
        derivatives: Whether to settle the garment on the mean shape in each anchor's pose once more, with derivatives
            by every joint, for sensitivity-optimised rigging.
        seed: Seed of the clustering and of the random bodies.
        jobs: Number of processes. The results do not depend on it.
        scheduler: Address of a dask scheduler whose workers settle instead; see `workers`.
        settings: Settings of the simulator.
        progress: Called with the name of a stage, the steps done and the total number of steps.

    Raises:
        BadInput: There are fewer poses than anchors, or the body has only one shape.
        SimulationFailed: The garment comes to rest in the T-pose on no body.
        BadDataset: The folder holds another garment's takes.
        BadOutput: The folder cannot be written.
        BadCluster: No scheduler answers, it went away, or its workers cannot make the calls; finished takes are kept.

    Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations", 2021,
        section 3.6. Differs: see `walk.WALK` and `lift_pose_arms` for the path of a garment into a pose.
    """
    tell = progress or (lambda stage, done, total: None)
    for name, number in (
        ("poses beside the anchors", beside),
        ("far poses", far),
        ("poses with hanging arms", hanging),
        ("random bodies", random),
    ):
        if number < 0:
            raise BadInput(f"the number of {name} must not be negative", number, "leave it out for none")
    if count < 1:
        raise BadInput("the number of anchors must be positive", count, "the paper has 150")
    poses = sample_poses(clips)
    body = Setup.of(garment, settings).body
    if not len(body.shapedirs):
        cure = "simulate it and fit ropes, or play it with live or lag"
        raise BadInput("anchors are for bodies of many shapes", f"'{body.name}', which has no betas", cure)
    shapes = axis_shapes(min(SHAPE_BETAS, len(body.shapedirs)))
    rest = body.shaped().rest_pose.translation
    upright = Pose(np.tile([1.0, 0.0, 0.0, 0.0], (JOINT_COUNT, 1)), rest)
    t_poses = produce_scattered(
        folder,
        garment,
        [upright],
        shapes,
        turns=range(JOINT_COUNT),
        settings=settings,
        jobs=jobs,
        scheduler=scheduler,
        report=_counter(tell, "T-pose", len(shapes)),
    )
    dataset = open_dataset(folder)
    _check_t_poses(dataset, garment, t_poses)
    sensitivity = mean_sensitivity([dataset.take(each.names[0]) for each in t_poses if each is not None], body)
    weights = joint_weights(sensitivity)
    tell("clusters", 0, 1)
    clusters = cluster_poses(poses, weights, count, seed=seed)
    tell("clusters", 1, 1)

    def settle_in(
        stage: str,
        members: Sequence[Sequence[int]],
        of: np.ndarray,
        on: list[tuple[float, ...]],
        rules: WalkRules = LIFTED,
    ) -> list[PosedTakes | None]:
        """Settles the garment in the pose in the middle of each cluster, or in one of the next ones."""
        return produce_posed(
            folder,
            garment,
            [[Pose(of[index], rest) for index in each[:MAX_STAND_INS]] for each in members],
            on,
            rules=rules,
            settings=settings,
            jobs=jobs,
            scheduler=scheduler,
            report=_counter(tell, stage, len(members) * len(on)),
        )

    def scatter(
        takes: Sequence[PosedTakes | None], bodies: list[tuple[float, ...]], rules: WalkRules
    ) -> list[PosedTakes | None]:
        """Settles the garment on each of some bodies, in the poses of some takes in turn."""
        return produce_scattered(
            folder,
            garment,
            [each.pose for each in takes if each is not None],
            bodies if any(takes) else [],
            rules=rules,
            settings=settings,
            jobs=jobs,
            scheduler=scheduler,
            report=_counter(tell, "random bodies", len(bodies)),
        )

    # first, since no fit does without them: a run that is stopped early has them
    anchors = settle_in("anchors", clusters.members, poses, shapes)
    single = cluster_poses(poses, weights, beside, seed=seed + 1).members if beside else ()
    beside_takes = settle_in("poses", single, poses, [()])
    far_takes = settle_in("far poses", _far_members(poses, [*clusters.members, *single], weights, far), poses, [()])
    low = hanging_poses(clips) if hanging else poses[:0]
    low_members = cluster_poses(low, weights, hanging, seed=seed + 2).members if hanging else ()
    hanging_takes = settle_in("hanging arms", low_members, low, [()], HANGING)
    drawn = random_shapes(body, random, seed + SEED_OF_BODIES)
    lifted = random - random // RANDOM_HANGING if any(hanging_takes) else random
    scattered = scatter([*beside_takes, *far_takes] or anchors, drawn[:lifted], LIFTED)
    scattered += scatter(hanging_takes, drawn[lifted:], HANGING)
    if derivatives:
        produce_posed(
            folder,
            garment,
            [[anchor.pose] for anchor in anchors if anchor is not None],
            turns=range(JOINT_COUNT),
            settings=settings,
            jobs=jobs,
            scheduler=scheduler,
            report=_counter(tell, "derivatives", count),
        )
    return Database(clusters, weights, anchors, beside_takes, far_takes, hanging_takes, scattered, shapes)


def _far_members(
    poses: Float[np.ndarray, "poses joints 4"],
    members: Sequence[Int[np.ndarray, " _members"]],
    weights: Float[np.ndarray, " joints"],
    count: int,
) -> list[Int[np.ndarray, " _members"]]:
    """Returns for each pose far from the first ones of all clusters that pose, and then those nearest to it."""
    if not count:
        return []
    chosen = farthest_poses(poses, poses[[each[0] for each in members]], weights, count)
    away = square_distances(poses[chosen], poses, weights)
    return [np.argsort(each, kind="stable")[:MAX_STAND_INS] for each in away]


def _check_t_poses(dataset: Dataset, garment: Garment, t_poses: Sequence[PosedTakes | None]) -> None:
    """Raises a SimulationFailed with its reason if the garment came to rest in the T-pose on no body."""
    if any(t_poses):
        return
    reason = next((row.failed for row in dataset.rows() if row.kind == "anchor" and row.failed), "no reason is known")
    raise SimulationFailed(
        f"'{garment.name}' comes to rest in the T-pose on none of {len(t_poses)} bodies, which 'fit --animator "
        f"agentdress' starts from: {reason}; simulate it with 'hemline simulate' and fit ropes, or play it with live"
    )


def hanging_poses(clips: Sequence[Motion]) -> Float[np.ndarray, "poses joints 4"]:
    """Returns those poses of clips in which an arm hangs, as `sample_poses` does but with arms where they are.

    Raises:
        BadInput: There is none.
    """
    poses, lifted = sample_poses(clips, lift_deg=0.0), sample_poses(clips)
    turns = angle(multiply(inverse(poses), lifted)).max(axis=1)
    chosen = poses[turns > np.deg2rad(HANGING_LIFT_DEG)]
    if not len(chosen):
        raise BadInput("no arm hangs in any pose of the clips", f"{len(poses)} poses", "leave out the hanging poses")
    return chosen


def sample_poses(clips: Sequence[Motion], *, lift_deg: float = LIFT_DEG) -> Float[np.ndarray, "poses joints 4"]:
    """Returns every fourth frame of clips in single precision, with arms lifted and without heading, for settling.

    Args:
        clips: The clips.
        lift_deg: Angle by which hanging arms are lifted [deg].

    Returns:
        Local rotations of the joints as unit quaternions, wxyz (poses, joints, 4).
    """
    poses = []
    for clip in clips:
        motion = clip.resample(SAMPLED_FPS)[::SAMPLE_STRIDE]
        poses += [lift_pose_arms(motion[frame], lift_deg).rotations for frame in range(len(motion))]
    return without_heading(np.asarray(poses)).astype(np.float32).astype(np.float64)


def _counter(tell: Report, stage: str, total: int) -> Report:
    """Returns a report that counts its calls, each of which is one anchor."""
    done = 0

    def report(name: str, one: int, of: int) -> None:
        nonlocal done
        done += 1
        tell(stage, min(done, total), total)

    return report
