"""Poses of anchors with their seventeen shapes, and the same garment walked into them on random bodies."""

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hemline import bodies
from hemline.animators.agentdress.fit.anchor_set import AnchorSet
from hemline.arrays import Float, Int
from hemline.bodies import Body
from hemline.datasets import open_dataset
from hemline.garments import Garment
from hemline.motions.motion import Pose
from hemline.sim import produce_posed, random_shapes

Shapes = Float[np.ndarray, "shapes betas"]
Worn = Float[np.ndarray, "shapes verts 3"]


@dataclass(frozen=True)
class Drapes:
    """One pose: the garment on the shapes that models are fitted to, and on random ones.

    Attributes:
        anchor: Number of the anchor.
        pose: The pose.
        fitted: The garment on each shape of the anchors [m].
        betas: Random shapes on which the garment came to rest.
        unseen: The garment on each of them [m].
    """

    anchor: int
    pose: Pose
    fitted: Worn
    betas: Shapes
    unseen: Worn


def worn_at(anchors: AnchorSet, body: Body, number: int) -> tuple[Pose, Worn]:
    """The pose of an anchor, and the garment on each of its shapes in the world [m]."""
    pose = Pose(anchors.rotations[number].astype(np.float32), body.shaped().rest_pose.translation)
    rests = anchors.rest.at(anchors.betas).reshape(len(anchors.betas), -1, 3)
    worn = [
        anchors.binding.skin(body.shaped(betas).posed(pose).transforms, rest, offsets)
        for betas, rest, offsets in zip(anchors.betas.astype(np.float32), rests, anchors.offsets[number], strict=True)
    ]
    return pose, np.array(worn)


def some_shapes(body: Body, count: int, betas: int, seed: int) -> list[tuple[float, ...]]:
    """Random bodies of which only so many betas are not 0; the paper maps four."""
    return [each[:betas] for each in random_shapes(body, count, seed)]


def settled_drapes(
    anchors: AnchorSet,
    folder: Path,
    garment: Garment,
    *,
    poses: int,
    shapes: list[tuple[float, ...]],
    seed: int,
    jobs: int,
) -> list[Drapes]:
    """Poses of some anchors with their drapes; what the folder lacks is settled now.

    Args:
        anchors: What the shape models are fitted to.
        folder: A dataset, made when missing.
        garment: The garment.
        poses: How many anchors.
        shapes: Betas of the bodies that nobody fits to.
        seed: Another number chooses other anchors.
        jobs: Processes.
    """
    body = bodies.load(garment.body_name)
    chosen: Int[np.ndarray, " some"] = np.random.default_rng(seed).permutation(len(anchors.rotations))[:poses]
    known = [worn_at(anchors, body, int(number)) for number in chosen]
    found: list[dict[int, np.ndarray]] = [{} for _ in chosen]
    for number, betas in enumerate(shapes):
        made = produce_posed(folder, garment, [[pose] for pose, _ in known], [betas], jobs=jobs)
        dataset = open_dataset(folder)
        for at, each in zip(found, made, strict=True):
            if each is not None:
                at[number] = dataset.take(each.names[0]).vertices[0].astype(np.float64)
        print(f"{number + 1} of {len(shapes)} shapes", file=sys.stderr, flush=True)
    return [
        Drapes(int(number), pose, worn, np.array([shapes[each] for each in at]), np.array(list(at.values())))
        for number, (pose, worn), at in zip(chosen, known, found, strict=True)
    ]
