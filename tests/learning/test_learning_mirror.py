"""Left and right exchanged."""

import numpy as np
import pytest

from hemline import bodies, garments
from hemline.learning.mirror import mirror_motion, mirror_of, mirror_transforms, mirror_vertices, partners
from hemline.motions import JOINT_NAMES, Motion, Pose

ROWS, COLUMNS = 15, 20


@pytest.fixture(scope="module")
def shaped():
    return bodies.load("anny24").shaped()


@pytest.fixture(scope="module")
def garment(shaped):
    return garments.make_cape(shaped, rows=ROWS, columns=COLUMNS)


def columns_exchanged(rows: int, columns: int) -> np.ndarray:
    return np.arange(rows * columns).reshape(rows, columns)[:, ::-1].reshape(-1)


def test_the_partner_in_a_grid_is_the_vertex_of_the_column_across(garment, shaped):
    np.testing.assert_array_equal(mirror_of(garment, shaped), columns_exchanged(ROWS, COLUMNS))


@pytest.mark.slow
@pytest.mark.parametrize(("name", "columns"), [("cape-light", 80), ("cape", 141)])
def test_shipped_capes_are_symmetric(shaped, name, columns):
    garment = garments.load(name)
    expected = columns_exchanged(len(garment.vertices) // columns, columns)
    np.testing.assert_array_equal(mirror_of(garment, shaped), expected)


@pytest.mark.parametrize("columns", [53, 60, 281])
def test_partners_in_a_skirt_are_across_though_its_rims_have_no_corners(shaped, columns):
    rows = np.arange(12)[:, None] * columns
    expected = (rows + -np.arange(columns) % columns).reshape(-1)
    skirt = garments.make_skirt(shaped, rows=12, columns=columns)
    np.testing.assert_array_equal(mirror_of(skirt, shaped), expected)


def test_an_asymmetric_garment_has_no_partners(garment):
    lopsided = garment.vertices + np.array([0.05, 0, 0], np.float32)
    assert partners(lopsided, garment.faces) is None
    slanted = garment.vertices * np.where(garment.vertices[:, :1] > 0, 1.3, 1).astype(np.float32)
    assert partners(slanted, garment.faces) is None


def mirrored_pose(pose: Pose) -> Pose:
    """The pose seen in a mirror at x = 0: quaternions keep w and x, y and z change sign; left and right exchange."""
    names = [n.replace("left", "?").replace("right", "left").replace("?", "right") for n in JOINT_NAMES]
    swapped = [JOINT_NAMES.index(name) for name in names]
    return Pose(
        pose.rotations[swapped] * np.array([1, 1, -1, -1], np.float32),
        pose.translation * np.array([-1, 1, 1], np.float32),
    )


def test_transforms_are_those_of_the_mirrored_pose(shaped):
    random = np.random.default_rng(0)
    rotations = np.zeros((24, 4), np.float32)
    rotations[:, 0] = 1
    rotations += 0.2 * random.normal(size=(24, 4)).astype(np.float32)
    rotations /= np.linalg.norm(rotations, axis=1, keepdims=True)
    pose = Pose(rotations, np.array([0.3, 1.0, -0.2], np.float32))
    found = mirror_transforms(shaped.posed(pose).transforms[None])[0]
    # the body's own joints are symmetric to a tenth of a millimetre
    np.testing.assert_allclose(found, shaped.posed(mirrored_pose(pose)).transforms, atol=5e-4)


def test_a_mirrored_motion_is_that_of_the_mirrored_poses(shaped):
    random = np.random.default_rng(3)
    rotations = np.tile(np.array([1, 0, 0, 0], np.float32), (5, 24, 1)) + 0.2 * random.normal(size=(5, 24, 4))
    rotations /= np.linalg.norm(rotations, axis=2, keepdims=True)
    places = random.normal(size=(5, 3)).astype(np.float32)
    motion = Motion(rotations.astype(np.float32), places, fps=30.0, leg_length=shaped.leg_length)
    mirrored = mirror_motion(motion)
    for k in range(5):
        np.testing.assert_array_equal(mirrored[k].rotations, mirrored_pose(motion[k]).rotations)
        np.testing.assert_array_equal(mirrored[k].translation, mirrored_pose(motion[k]).translation)
    assert mirrored.fps == motion.fps


def test_twice_is_where_it_began(garment, shaped):
    partner = mirror_of(garment, shaped)
    assert partner is not None
    frames = np.random.default_rng(1).normal(size=(2, len(garment.vertices), 3)).astype(np.float32)
    there = mirror_vertices(frames, partner)
    np.testing.assert_array_equal(mirror_vertices(there, partner), frames)
    transforms = np.random.default_rng(2).normal(size=(3, 24, 3, 4)).astype(np.float32)
    np.testing.assert_array_equal(mirror_transforms(mirror_transforms(transforms)), transforms)
