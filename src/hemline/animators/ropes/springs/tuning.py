"""Spring bones tuned to simulated takes, and compared with them."""

import numpy as np

from hemline.animators.base import Progress
from hemline.animators.ropes.bones.chains import Ropes
from hemline.animators.ropes.model import AnimatorRopes
from hemline.arrays import Float, Nodes
from hemline.bodies.body import PosedBody, ShapedBody
from hemline.datasets import Dataset, Row
from hemline.errors import BadDataset
from hemline.motions import Motion
from hemline.springs import FRAME_SECONDS, SKIN_EVERY, SkeletonMotion, SpringConstants, SpringTarget, tune

from .chains import LEGS, resting_chains, skeleton_of, t_pose

TAKE_COUNT, TAKE_SECONDS = 12, 4.0
"""Number of takes that are compared with, and the length of each [s]."""
SKIN_POINTS = 300
"""Number of vertices of the legs that should stay behind the cloth."""
_FPS = 30.0
_SETTLING_STEPS = 120
"""Steps of a thirtieth of a second in which the ropes settle in the T-pose."""


def tune_springs(
    animator: AnimatorRopes, dataset: Dataset, progress: Progress | None = None
) -> tuple[SpringConstants, dict[str, float]]:
    """Returns the constants with which the spring bones of a model are closest to the takes of a dataset.

    Args:
        animator: The model whose chains swing.
        dataset: Takes of its garment. A dozen of those of the training split are used.
        progress: Called with "springs", the number of constants tried and that of all.

    Returns:
        The constants, and the figures of `springs.tune`.

    Raises:
        BadDataset: The takes are of another garment than the model, or there is none of the shape of the garment.
    """
    if dataset.garment.hash != animator.garment.hash:
        cure = f"name a dataset made by 'hemline simulate {animator.garment.name}'"
        raise BadDataset(f"{dataset.folder} has takes of another garment", dataset.garment.name, cure)
    shaped = dataset.body.shaped(animator.garment.body_betas)
    rest = t_pose(shaped)
    chains, capsules = resting_chains(animator.ropes, _settled(animator, rest), rest)
    targets = _targets(animator.ropes, dataset, _spread(dataset), rest)
    pairs = animator.ropes.chains.pairs - int(animator.ropes.chains.offsets[0])
    show = (lambda done, count: progress("springs", done, count)) if progress else lambda done, count: None
    return tune(chains, capsules, LEGS, targets, pairs, animator.springs, show)


def _settled(animator: AnimatorRopes, rest: PosedBody) -> Nodes:
    state = animator.start(rest)
    for _ in range(_SETTLING_STEPS):
        state, vertices = animator.step(state, rest, 1 / _FPS)
    return animator.ropes.positions_on(vertices)


def _spread(dataset: Dataset) -> list[Row]:
    """Returns takes of the training split on the shape of the garment, evenly spaced over their list."""
    shape = np.trim_zeros(np.asarray(dataset.garment.body_betas), "b")
    rows = [
        row
        for row in dataset.split("train")
        if row.clip_frames > _FPS and np.array_equal(np.trim_zeros(np.asarray(row.betas), "b"), shape)
    ]
    if not rows:
        cure = "simulate clips with 'hemline simulate', without --betas"
        raise BadDataset(f"{dataset.folder} has no take to tune spring bones to", "0 takes of a second or more", cure)
    return [rows[index] for index in np.unique(np.linspace(0, len(rows) - 1, TAKE_COUNT).round().astype(int))]


def _targets(ropes: Ropes, dataset: Dataset, rows: list[Row], rest: PosedBody) -> list[SpringTarget]:
    skin = _leg_vertices(rest.shaped)
    return [_target(ropes, dataset, row, rest, skin) for row in rows]


def _target(ropes: Ropes, dataset: Dataset, row: Row, rest: PosedBody, skin: np.ndarray) -> SpringTarget:
    take = dataset.take(row)
    first = int(take.lead_in.sum())
    last = min(len(take.vertices), first + round(TAKE_SECONDS * _FPS))
    motion, chain = take.motion[first:last], int(ropes.chains.offsets[0])
    bones = np.array([ropes.positions_on(vertices)[chain:] for vertices in take.vertices[first:last]], np.float64)
    return SpringTarget(_skeleton(rest, motion), bones, _skin_in(rest.shaped, motion, skin))


def _skeleton(rest: PosedBody, motion: Motion) -> SkeletonMotion:
    """Returns the skeleton of a clip at the rate of the engine, up to its last frame."""
    fast = motion.resample(1 / FRAME_SECONDS)
    count = round(1 / FRAME_SECONDS / _FPS) * (len(motion) - 1) + 1
    return skeleton_of(rest, fast[:count])


def _skin_in(shaped: ShapedBody, motion: Motion, skin: np.ndarray) -> Float[np.ndarray, "tenths points 6"]:
    posed = [shaped.posed(pose) for pose in motion[::SKIN_EVERY]]
    return np.array([np.concatenate([each.vertices[skin], each.normals[skin]], axis=1) for each in posed], np.float64)


def _leg_vertices(shaped: ShapedBody) -> np.ndarray:
    """Returns vertices spread over the legs."""
    body = shaped.body
    largest = np.take_along_axis(body.weight_indices, body.weights.argmax(axis=1)[:, None], axis=1)[:, 0]
    legs = np.flatnonzero(np.isin(largest, LEGS))
    return legs[np.linspace(0, len(legs) - 1, min(SKIN_POINTS, len(legs))).astype(int)]
