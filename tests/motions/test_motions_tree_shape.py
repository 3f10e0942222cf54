"""Limbs and head found by their places in the tree, whatever bones are called."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hemline.motions.bvh import read_bvh
from hemline.motions.quaternions import angle, inverse, multiply
from hemline.motions.rigs.names import find_joints
from hemline.motions.rigs.retarget import retarget
from hemline.motions.rigs.tree_shape import joints_by_shape
from tests.motions.bvh_samples import NAMES, person, text_of


@pytest.mark.parametrize("turn", [(0, 0, 0), (90, 0, 0), (0, 90, 0), (0, 180, 0)])
def test_they_are_those_that_names_tell(turn):
    """Standing, with z up, facing x, facing -z."""
    skeleton = person(frames=1).skeleton
    offsets = Rotation.from_euler("xyz", turn, degrees=True).apply(skeleton.offsets)
    ends = {joint: Rotation.from_euler("xyz", turn, degrees=True).apply(end) for joint, end in skeleton.ends.items()}
    found = joints_by_shape(replace(skeleton, offsets=offsets, ends=ends))
    named = find_joints(skeleton, "it").joints
    assert {role: NAMES[joint] for role, joint in found.items()} == {role: NAMES[named[role]] for role in found}
    assert len(found) == 15


def test_a_clip_without_names_is_the_same_motion_and_says_so(tmp_path):
    clip = person()
    (tmp_path / "clip.bvh").write_text(text_of(clip, names={name: f"joint{k}" for k, name in enumerate(NAMES)}))
    motion = retarget(read_bvh(tmp_path / "clip.bvh"), name="clip.bvh")
    plain = retarget(clip)
    apart = np.degrees(angle(multiply(inverse(motion.rotations.astype(float)), plain.rotations.astype(float))))
    assert apart[:, :20].max() < 0.01  # hands are told from the thumbs, which have no name here
    assert "joints found by their place in the tree" in motion.notes[0]
    assert "left_knee 'joint2'" in motion.notes[0]


def test_what_is_no_person_has_none():
    skeleton = person(frames=1).skeleton
    random = np.random.default_rng(0)
    shuffled = replace(skeleton, offsets=random.normal(size=skeleton.offsets.shape))
    assert joints_by_shape(shuffled) is None
    assert joints_by_shape(replace(skeleton, offsets=0 * skeleton.offsets)) is None
    assert joints_by_shape(replace(skeleton, offsets=np.nan * skeleton.offsets)) is None
