"""A motion means what its own skeleton shows, whatever axes its joints and its world have.

The figures of the same rig with a T-pose as zero pose are 8 and 54 mm: its collars are moved with the arms on purpose.
"""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hemline.errors import HemlineWarning
from hemline.motions import JOINT_NAMES
from hemline.motions.quaternions import inverse, multiply, rotate
from hemline.motions.rigs.agreement import bone_errors, worst_bones
from hemline.motions.rigs.quarters import QUARTERS, mean_rotation, nearest_quarter
from hemline.motions.rigs.retarget import retarget, retarget_beside
from tests.motions.bvh_samples import quaternions
from tests.motions.rig_samples import WORLDS, along_bones, apart_mm, globals_of, sample, upright_figure

MEAN_MM, MAX_MM = 18.0, 60.0
ALONG_BONES = along_bones(upright_figure())


def some(kind: str, seed: int) -> list[Rotation]:
    chance = np.random.default_rng(seed)
    if kind == "random":
        return [Rotation.random(rng=chance) for _ in range(24)]
    return [Rotation.from_quat(QUARTERS[chance.integers(24)][[1, 2, 3, 0]]) for _ in range(24)]


def only(joints: tuple[str, ...], turn: Rotation) -> list[Rotation]:
    return [turn if name in joints else Rotation.identity() for name in JOINT_NAMES]


AXES = {
    "plain": [Rotation.identity()] * 24,
    "along bones": ALONG_BONES,
    "trunk along bones": [
        axes if name.startswith(("spine", "neck", "head")) else Rotation.identity()
        for name, axes in zip(JOINT_NAMES, ALONG_BONES, strict=True)
    ],
    "hips about": only(("pelvis",), Rotation.from_euler("y", 180, degrees=True)),
    "hips tilted": only(("pelvis",), Rotation.from_euler("x", -90, degrees=True)),
    "neck": only(("neck",), Rotation.from_euler("z", 90, degrees=True)),
    "feet": only(("left_ankle", "right_ankle", "left_foot", "right_foot"), Rotation.from_euler("x", 45, degrees=True)),
    "one turn": [Rotation.from_euler("xyz", [17, 33, -58], degrees=True)] * 24,
    "quarter turns": some("quarters", 1),
    "any": some("random", 2),
}


@pytest.mark.parametrize("axes", AXES)
@pytest.mark.parametrize("clip", ["walk", "dance", "kick"])
def test_axes_of_joints_do_not_matter(clip, axes):
    truth = sample(clip, AXES[axes])
    found = retarget(truth.bvh)
    mean, most = apart_mm(found, truth)
    assert mean < MEAN_MM and most < MAX_MM
    way = found.translations - found.translations[:1] - truth.motion.translations + truth.motion.translations[:1]
    assert np.linalg.norm(way, axis=1).max() < 0.08


@pytest.mark.parametrize("axes", ["along bones", "any"])
def test_limbs_are_found_by_the_lengths_of_bones(axes):
    truth = sample("dance", AXES[axes], names=[f"骨{joint}" for joint in range(24)])
    found = retarget(truth.bvh)
    assert apart_mm(found, truth) < (MEAN_MM, MAX_MM)
    assert "joints found by their place in the tree" in found.notes[0]


def test_the_thigh_may_be_called_leg():
    """Where there is a shin, as in SOMA's and Kimodo's files."""
    truth = sample("walk", ALONG_BONES)
    names = [name.replace("Leg", "Shin").replace("UpShin", "Leg") for name in truth.bvh.skeleton.names]
    found = retarget(sample("walk", ALONG_BONES, names=names).bvh)
    assert apart_mm(found, truth) < (MEAN_MM, MAX_MM)
    assert not any("place in the tree" in note for note in found.notes)


@pytest.mark.parametrize("world", WORLDS)
@pytest.mark.parametrize("axes", ["plain", "along bones"])
@pytest.mark.parametrize("frames", [slice(0, 1), slice(0, 120, 6)], ids=["pose", "clip"])
def test_up_is_where_the_head_is(world, axes, frames):
    truth = sample("walk", AXES[axes], world=WORLDS[world], frames=frames)
    found = retarget(truth.bvh)
    mean, most = apart_mm(found, truth)
    assert mean < MEAN_MM and most < MAX_MM
    if axes == "plain":
        assert any(f"stands along {world} in 100 %" in note for note in found.notes)
    declared = retarget(truth.bvh, up=world)
    assert np.allclose(declared.rotations, found.rotations, atol=1e-6)


def test_a_body_that_lies_on_the_floor_of_its_world_goes_on_lying():
    """Asleep on its back, hips 12 cm above the floor, in a file that begins and ends so."""
    truth = sample("walk", frames=slice(0, 1))
    back = Rotation.from_euler("x", -90, degrees=True)
    bvh = truth.bvh
    local = np.zeros_like(bvh.rotations)
    local[..., 0] = 1
    local[:, 0] = quaternions(back)
    lying = type(bvh)(bvh.skeleton, local, {0: np.array([[30.0, 12, 40]])}, 30.0)
    with pytest.warns(HemlineWarning, match="lies or leans in 100 % of the frames, with y up.*say --up=-z"):
        found = retarget(lying, name="sleep")
    assert (globals_of(found)[0] * back.inv()).magnitude().max() < 1e-3
    standing = retarget(lying, up="-z")
    assert globals_of(standing)[0].apply([0, 1, 0])[0] == pytest.approx([0, 1, 0], abs=1e-6)


def test_a_pelvis_that_stands_askew_to_its_bones_keeps_its_axes():
    """LAFAN1: x up, the hips 2 cm before and the spine 3 cm behind the pelvis, so that the bone leans by 33 degrees."""
    places = upright_figure()
    hips, spine = [JOINT_NAMES.index(f"{side}_hip") for side in ("left", "right")], JOINT_NAMES.index("spine1")
    places[hips] = [[0.105, 0.001, 0.019], [-0.105, 0.001, 0.019]]
    places[spine] = [0, 0.069, -0.026]
    axes = [Rotation.from_matrix(np.array([[0, 0, 1.0], [1, 0, 0], [0, 1, 0]]))] * 24
    truth = sample("walk", axes, places=places)
    found = retarget(truth.bvh)
    off = globals_of(found)[0] * globals_of(truth.motion)[0].inv()
    assert np.degrees(off.magnitude()).max() < 0.1


def test_clavicles_may_hang_on_the_neck():
    """In old Bipeds the neck carries the arms, and stays a neck."""
    truth = sample("dance", ALONG_BONES)
    bvh, neck, chest = truth.bvh, JOINT_NAMES.index("neck"), JOINT_NAMES.index("spine3")
    parents, offsets, local = list(bvh.skeleton.parents), bvh.skeleton.offsets.copy(), bvh.rotations.copy()
    for side in ("left", "right"):
        collar = JOINT_NAMES.index(f"{side}_collar")
        parents[collar] = neck
        path = rotate(local[:, neck], np.zeros(3)) + offsets[collar] - offsets[neck]
        offsets[collar] = rotate(inverse(local[:, neck]), path).mean(axis=0)
        local[:, collar] = multiply(inverse(local[:, neck]), local[:, collar])
    assert chest < neck
    skeleton = type(bvh.skeleton)(bvh.skeleton.names, tuple(parents), offsets, {}, bvh.skeleton.channels)
    found = retarget(type(bvh)(skeleton, local, bvh.positions, bvh.fps))
    assert apart_mm(found, truth) < (MEAN_MM, MAX_MM)


def test_a_foot_begins_beneath_the_ankle():
    """Toes that start straight below the ankle, and point forward from there, as in CMU's MotionBuilder exports."""
    truth = sample("walk")
    skeleton = truth.bvh.skeleton
    offsets, ends = skeleton.offsets.copy(), {}
    for side in ("left", "right"):
        toes = JOINT_NAMES.index(f"{side}_foot")
        offsets[toes] = [0, -2, 0]
        ends[toes] = np.array([0, 0, 12.0])
    bvh = type(truth.bvh)(
        type(skeleton)(skeleton.names, skeleton.parents, offsets, ends, skeleton.channels),
        truth.bvh.rotations,
        truth.bvh.positions,
        30.0,
    )
    found = globals_of(retarget(bvh))
    for joint in ("left_ankle", "right_ankle"):
        index = JOINT_NAMES.index(joint)
        assert np.degrees((found[index] * globals_of(truth.motion)[index].inv()).magnitude()).max() < 0.1


def test_bones_that_point_elsewhere_are_seen():
    """The net: every joint off by a quarter turn about x, which leaves what lies along x."""
    truth = sample("walk")
    done = retarget_beside(truth.bvh)
    turned = np.stack([quaternions(each) for each in globals_of(done.motion)], axis=1)
    right = bone_errors(done.rig, done.turn, turned)
    assert max(right.values()) < 12 and len(right) == 14
    wrong = bone_errors(done.rig, done.turn, multiply(turned, quaternions(Rotation.from_euler("x", 90, degrees=True))))
    assert wrong["the left thigh"] == pytest.approx(90, abs=1) and wrong["the hips"] == pytest.approx(0, abs=1)
    assert worst_bones(wrong, 35).startswith("the ") and "by 90 degrees" in worst_bones(wrong, 35)


def test_quarter_turns_and_means():
    assert len(QUARTERS) == 24 and len({tuple(np.round(quarter, 6)) for quarter in QUARTERS}) == 24
    for quarter in QUARTERS:
        near = multiply(quarter, quaternions(Rotation.from_rotvec([0.2, -0.3, 0.1])))
        assert abs(nearest_quarter(near) @ quarter) == pytest.approx(1)
    about = Rotation.from_rotvec(np.random.default_rng(0).normal(0, 0.2, (50, 3))) * Rotation.from_rotvec([1, 2, -1])
    mean = mean_rotation(quaternions(about))
    assert np.degrees((about.mean().inv() * Rotation.from_quat(mean[[1, 2, 3, 0]])).magnitude()) < 1e-6
