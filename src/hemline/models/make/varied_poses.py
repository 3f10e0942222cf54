"""Chooses the shipped poses: `python -m hemline.models.make.varied_poses FOLDER` writes `models/poses.safetensors`.

FOLDER is the folder of the clips of `fit.clips`, whose people are not those of the shipped clips (but for `turn`).
"""

import sys
from pathlib import Path

import numpy as np

from hemline import bodies, motions, sim
from hemline.arrays import Float
from hemline.bodies import ShapedBody
from hemline.motions.motion import PARENTS, Motion
from hemline.motions.pose_clusters import cluster_poses
from hemline.motions.store import write_many
from hemline.motions.terms import CMU_TERMS
from hemline.motions.varied_poses import POSES_FPS, SHIPPED_POSES

FIT_CLIPS = Path(__file__).parents[1] / "fit.clips"
COUNT, SEED = 400, 0
"""Number of poses, and seed of their clusters."""
MOST_SAMPLES = 6000
"""Number of poses of all clips that are clustered."""


def skin_weights(shaped: ShapedBody) -> Float[np.ndarray, " joints"]:
    """Returns the mean motion of the skin when a joint turns, divided by the largest.

    The pelvis counts no more than the first joint of the spine, as in `datasets.joint_sensitivity.joint_weights`.

    Args:
        shaped: The body.
    """
    weights = np.zeros(len(PARENTS))
    dense = np.zeros((len(shaped.vertices), len(PARENTS)))
    np.add.at(dense, (np.arange(len(dense))[:, None], shaped.body.weight_indices), shaped.body.weights)
    for joint in reversed(range(len(PARENTS))):
        distances = np.linalg.norm(shaped.vertices - shaped.joints[joint], axis=1)
        weights[joint] = (dense[:, joint] * distances).sum()
        if joint:
            dense[:, PARENTS[joint]] += dense[:, joint]
    weights[0] = min(weights[0], weights[3])
    return weights / weights.max()


def choose_poses(clips: list[Motion]) -> Motion:
    """Returns the poses nearest to the means of clusters, as the frames of a clip.

    Args:
        clips: The clips.
    """
    body = bodies.load("anny24").shaped()
    poses = sim.sample_poses(clips)
    random = np.random.default_rng(SEED)
    poses = poses[random.permutation(len(poses))[:MOST_SAMPLES]]
    members = cluster_poses(poses, skin_weights(body), COUNT, seed=SEED).members
    chosen = np.array([poses[each[0]] for each in members], np.float32)
    place = np.tile(body.rest_pose.translation, (len(chosen), 1)).astype(np.float32)
    return Motion(
        chosen, place, fps=POSES_FPS, leg_length=body.leg_length, name="poses", source="fit.clips", licence=CMU_TERMS
    )


def main(folder: str) -> None:
    """Writes the file."""
    names = FIT_CLIPS.read_text().split()
    write_many(SHIPPED_POSES, {"poses": choose_poses([motions.read(Path(folder) / name) for name in names])})


if __name__ == "__main__":
    main(sys.argv[1])
