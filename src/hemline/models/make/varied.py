"""Chooses poses and sections of recordings: `python -m hemline.models.make.varied FOLDER` writes `varied.safetensors`.

FOLDER is the folder of the clips of `fit.clips`, whose people are not those of the shipped clips (but for `turn`). Only
recordings of the CMU Graphics Lab Motion Capture Database are used.
"""

import sys
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np

from hemline import bodies, motions, sim
from hemline.arrays import Float
from hemline.bodies import ShapedBody
from hemline.motions import subject_of
from hemline.motions.motion import PARENTS, Motion
from hemline.motions.pose_clusters import cluster_poses
from hemline.motions.quaternions import angle, inverse, multiply
from hemline.motions.store import write_many
from hemline.motions.terms import CMU_TERMS
from hemline.motions.varied import POSES, POSES_FPS, VARIED

FIT_CLIPS = Path(__file__).parents[1] / "fit.clips"
COUNT, SEED = 400, 0
"""Number of poses, and seed of their clusters."""
MOST_SAMPLES = 6000
"""Number of poses of all clips that are clustered."""
SECTIONS, SECTION_S, FPS = 24, 2.5, 30.0
"""Number of sections, length of each [s], and their frame rate [frames/s]."""
MOST_OF_SUBJECT = 3
"""Largest number of sections of one person."""


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
        chosen, place, fps=POSES_FPS, leg_length=body.leg_length, name=POSES, source="fit.clips", licence=CMU_TERMS
    )


def liveliest_section(motion: Motion, weights: Float[np.ndarray, " joints"]) -> tuple[Motion, float]:
    """Returns the section in which joints turn fastest, and the mean weighted speed in it [rad/s].

    Args:
        motion: A recording.
        weights: Weight of each joint.
    """
    first, end = motions.longest_clean(motion)
    clean = motion[first:end].resample(FPS)
    rotations = clean.rotations.astype(np.float64)
    speed = FPS * (angle(multiply(inverse(rotations[:-1]), rotations[1:])) @ (weights / weights.sum()))
    length = min(round(SECTION_S * FPS), len(speed))
    means = np.convolve(speed, np.full(length, 1 / length), "valid")
    start = int(means.argmax())
    return clean[start : start + length], float(means[start])


def choose_sections(clips: list[Motion]) -> list[Motion]:
    """Returns the liveliest sections of some clips, evenly from the calmest to the most vigorous.

    Args:
        clips: The clips.
    """
    weights = skin_weights(bodies.load("anny24").shaped())
    found = sorted((liveliest_section(clip, weights) for clip in clips), key=lambda each: each[1])
    whole = [section for section, _ in found if len(section) >= SECTION_S * FPS - 1]
    taken: Counter[str] = Counter()
    chosen = []
    for place in np.linspace(0, len(whole) - 1, SECTIONS):
        near = sorted(range(len(whole)), key=lambda index: abs(index - place))
        section = next(
            whole[index]
            for index in near
            if taken[subject_of(whole[index])] < MOST_OF_SUBJECT and not any(whole[index] is each for each in chosen)
        )
        taken[subject_of(section)] += 1
        chosen.append(section)
    return [replace(section, licence=CMU_TERMS) for section in chosen]


def main(folder: str) -> None:
    """Writes the file."""
    found = [motions.read(Path(folder) / name) for name in FIT_CLIPS.read_text().split()]
    clips = [clip for clip in found if clip.licence == CMU_TERMS]
    sections = {Path(section.source).stem: section for section in choose_sections(clips)}
    write_many(VARIED, {POSES: choose_poses(clips)} | sections)


if __name__ == "__main__":
    main(sys.argv[1])
