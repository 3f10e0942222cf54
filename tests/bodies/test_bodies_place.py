"""Motions put on a body: scaled, grounded, jumps kept."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hemline import bodies
from hemline.bodies.place import placement, sole_heights, sole_vertices
from hemline.motions import Pose, read
from tests.bodies.body_samples import clip_of, t_pose

CLIPS = Path(__file__).resolve().parents[2] / "../shared/data/motion"


@pytest.fixture(scope="module")
def shaped():
    return bodies.load().shaped([-1.0])


@pytest.fixture(scope="module")
def jump():
    """Standing, then a jump of 30 cm (for legs of 0.8 m), then standing; moving on along z all the while."""
    up = 0.3 * np.sin(np.pi * np.clip((np.arange(60) - 20) / 20, 0, 1))
    return clip_of(
        [Pose(t_pose().rotations, np.array([0, 5 + height, 0.02 * frame])) for frame, height in enumerate(up)]
    )


def test_root_is_scaled_by_leg_length(shaped, jump):
    placed, scale = shaped.placed(jump), shaped.leg_length / 0.8
    assert placed.leg_length == shaped.leg_length and scale != pytest.approx(1, abs=0.01)
    np.testing.assert_allclose(
        np.diff(placed.translations, axis=0), scale * np.diff(jump.translations, axis=0), atol=2e-6
    )
    assert placed.rotations is jump.rotations or np.array_equal(placed.rotations, jump.rotations)


def test_soles_stand_on_the_floor_and_jumps_stay(shaped, jump):
    placed = shaped.placed(jump)
    lowest = np.array([shaped.posed(placed[frame]).vertices[:, 1].min() for frame in (0, 30, 59)])
    np.testing.assert_allclose(lowest, [0, 0.3 * shaped.leg_length / 0.8, 0], atol=2e-3)


def test_one_bad_frame_does_not_lift_the_clip(shaped, jump):
    translations = jump.translations.copy()
    translations[5, 1] -= 1.0
    spoilt = shaped.placed(replace(jump, translations=translations))
    np.testing.assert_allclose(spoilt.translations[0], shaped.placed(jump).translations[0], atol=2e-3)


def test_placing_twice_changes_nothing(shaped, jump):
    once = shaped.placed(jump)
    np.testing.assert_allclose(shaped.placed(once).translations, once.translations, atol=1e-5)


def test_heights_are_those_of_the_skinned_soles(shaped, jump):
    heights, soles = sole_heights(shaped, jump), sole_vertices(shaped)
    for frame in (0, 25):
        assert heights[frame] == shaped.posed(jump[frame]).vertices[soles, 1].min()


def test_a_placed_frame_is_that_frame_of_the_placed_motion(shaped, jump):
    made, whole = placement(shaped, jump), shaped.placed(jump)
    assert made.lift != 0 and made.scale == shaped.leg_length / jump.leg_length
    assert made.of_motion(jump).hash == whole.hash
    for frame in range(len(jump)):
        one = made.of(jump[frame])
        assert one.translation.tobytes() == whole[frame].translation.tobytes()
        assert one.rotations.tobytes() == whole[frame].rotations.tobytes()


def test_a_stretch_is_placed_as_part_of_the_whole(shaped, jump):
    stretch = placement(shaped, jump).of_motion(jump[20:40])
    np.testing.assert_array_equal(stretch.translations, shaped.placed(jump)[20:40].translations)
    assert stretch.leg_length == shaped.leg_length


@pytest.mark.data
@pytest.mark.parametrize("clip", ["02_01", "49_02"])
def test_recorded_feet_touch_the_floor(shaped, clip):
    path = CLIPS / f"{clip}.bvh"
    if not path.exists():
        pytest.skip(f"{path} is absent")
    heights = sole_heights(shaped, shaped.placed(read(path).resample(10)))
    assert np.percentile(heights, 1) > -0.08 and np.percentile(heights, 25) < 0.05
