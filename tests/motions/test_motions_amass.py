import zipfile

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hemline import motions
from hemline.errors import BadMotion, HemlineWarning
from hemline.motions import JOINT_NAMES, PARENTS


@pytest.fixture
def sample():
    """Arrays of an SMPL-H clip: z up, standing, walking along y."""
    chance = np.random.default_rng(1)
    poses = chance.normal(0, 0.3, (5, 156))
    poses[:, :3] = (Rotation.from_euler("x", 90, degrees=True) * Rotation.from_rotvec(poses[:, :3])).as_rotvec()
    return {
        "poses": poses,
        "trans": np.stack([np.zeros(5), np.linspace(0, 0.1, 5), np.full(5, 0.9)], axis=1),
        "betas": np.zeros(16),
        "gender": np.array("female"),
        "mocap_framerate": np.array(100.0),
        "dmpls": np.zeros((5, 8)),
    }


def written(tmp_path, arrays):
    path = tmp_path / "01_01_poses.npz"
    np.savez(path, **arrays)
    return path


def global_rotations(rotvecs, root):
    """Forward kinematics by scipy; `root` is put before the pelvis."""
    totals = []
    for joint in range(22):
        local = Rotation.from_rotvec(rotvecs[:, joint])
        totals.append(root * local if joint == 0 else totals[PARENTS[joint]] * local)
    return totals


def test_smplh_is_turned_upright_and_moved_to_the_pelvis(tmp_path, sample):
    motion = motions.read(written(tmp_path, sample))
    assert (len(motion), motion.fps, motion.name) == (5, 100, "01_01_poses")
    upright = Rotation.from_euler("x", -90, degrees=True)
    rotvecs = sample["poses"].reshape(5, 52, 3)
    expected = global_rotations(rotvecs, upright)
    ours = [Rotation.from_quat(motion.rotations[:, joint][:, [1, 2, 3, 0]]) for joint in range(24)]
    for joint in range(22):
        total = ours[joint]
        above = PARENTS[joint]
        while above >= 0:
            total, above = ours[above] * total, PARENTS[above]
        assert (expected[joint].inv() * total).magnitude().max() < 1e-5, JOINT_NAMES[joint]
    assert np.allclose(motion.rotations[:, 22:], [1, 0, 0, 0])
    assert np.allclose(motion.translations, upright.apply(sample["trans"] + [0, -0.22, 0.03]), atol=1e-6)
    assert np.allclose(motion.translations[:, 1], 0.93, atol=1e-6), "z up became y up"


def test_smplx_keys_give_the_same(tmp_path, sample):
    plain = motions.read(written(tmp_path, sample))
    split = {
        "root_orient": sample["poses"][:, :3],
        "pose_body": sample["poses"][:, 3:66],
        "pose_hand": sample["poses"][:, 66:],
        "trans": sample["trans"],
        "mocap_frame_rate": np.array(100.0),
    }
    assert motions.read(written(tmp_path, split)).hash == plain.hash


def without(sample, *keys):
    return {key: array for key, array in sample.items() if key not in keys}


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda s: without(s, "poses"), "has no poses of SMPL; got the arrays trans, betas, gender, mocap_framerate"),
        (lambda s: s | {"poses": s["poses"][:, :60]}, r"poses of .* must have 66, 72, 156.* a frame.*got 5x60"),
        (lambda s: s | {"poses": s["poses"][:, :63]}, "got 5x63.*of the pelvis and of all other joints"),
        (lambda s: s | {"poses": s["poses"][:0], "trans": s["trans"][:0]}, "got 0x156"),
        (lambda s: s | {"trans": s["trans"][:4]}, r"trans of .* must be \(5, 3\); got \(4, 3\)"),
        (lambda s: s | {"trans": s["trans"] * np.nan}, "trans of .* must hold finite numbers; got NaN.* in frame 0"),
        (lambda s: s | {"poses": np.array([{"a": 1}], dtype=object)}, "pickled objects are not read"),
        (lambda s: s | {"mocap_framerate": np.array("fast")}, "mocap_framerate of .* must be a number"),
        (lambda s: s | {"mocap_framerate": np.array(1e-6)}, "a second; got 1e-06; correct its rate"),
        (lambda s: s | {"mocap_framerate": np.array(np.nan)}, "a second; got nan"),
        (
            lambda s: s | {"mocap_framerate": np.array(0.0)},
            "01_01_poses.npz must have from 1 to 1000 frames a second; got 0",
        ),
    ],
)
def test_files_that_are_no_clip_are_refused(tmp_path, sample, spoil, message):
    with pytest.raises(BadMotion, match=message):
        motions.read(written(tmp_path, spoil(sample)))


IDENTITIES = {
    "6D rotations": [1.0, 0, 0, 0, 1, 0],
    "rotation matrices": np.eye(3).ravel(),
    "quaternions": [1.0, 0, 0, 0],
}


@pytest.mark.parametrize("form", IDENTITIES)
@pytest.mark.parametrize("joints", [22, 24, 52])
def test_other_forms_of_rotations_are_refused_by_name(tmp_path, sample, form, joints):
    poses = np.tile(IDENTITIES[form], (5, joints))
    with pytest.raises(BadMotion, match=f"must be rotation vectors; got 5x{poses.shape[1]}, {joints} joints as {form}"):
        motions.read(written(tmp_path, sample | {"poses": poses}))


def test_degrees_and_centimetres_are_refused(tmp_path, sample):
    with pytest.raises(BadMotion, match="more than a whole turn in 100 % of the frames; are they in degrees"):
        motions.read(written(tmp_path, sample | {"poses": np.degrees(sample["poses"])}))
    with pytest.raises(BadMotion, match="must be metres; got a pelvis that moves at 250 m/s; divide trans by 100"):
        motions.read(written(tmp_path, sample | {"trans": sample["trans"] * 100}))
    high = sample["trans"] * [1, 0, 1] + [0, 0, 90]
    with pytest.warns(HemlineWarning, match="high above the ground; got 90"):
        motions.read(written(tmp_path, sample | {"trans": high}))


@pytest.mark.parametrize(
    "renamed",
    [
        lambda s: {
            "global_orient": s["poses"][:, :3],
            "body_pose": s["poses"][:, 3:66],
            "transl": s["trans"],
            "fps": 100,
        },
        lambda s: {"smpl_poses": s["poses"][:, :72], "smpl_trans": 94 * s["trans"], "smpl_scaling": [94.0], "fps": 100},
        lambda s: {"poses": s["poses"][:, :72].reshape(5, 24, 3), "trans": s["trans"], "framerate": 100},
        lambda s: {"pose": s["poses"][:, :66].reshape(1, 5, 22, 3), "trans": s["trans"][None], "fps": 100},
        lambda s: {
            "global_orient": Rotation.from_rotvec(s["poses"][:, :3]).as_matrix()[:, None],
            "body_pose": Rotation.from_rotvec(s["poses"][:, 3:72].reshape(-1, 3)).as_matrix().reshape(5, 23, 3, 3),
            "transl": s["trans"],
            "mocap_fps": 100,
        },
    ],
    ids=["smplx", "aist", "per joint", "batch", "matrices"],
)
def test_names_of_common_trackers_are_read(tmp_path, sample, renamed):
    plain = motions.read(written(tmp_path, sample), up="z")
    found = motions.read(
        written(tmp_path, {name: np.asarray(array) for name, array in renamed(sample).items()}), up="z"
    )
    assert np.allclose(np.abs(np.sum(found.rotations * plain.rotations, -1))[:, :22], 1, atol=1e-6)
    assert np.allclose(found.translations, plain.translations, atol=1e-6) and found.fps == 100


def test_what_is_missing_is_assumed_and_said(tmp_path, sample):
    found = motions.read(written(tmp_path, without(sample, "trans", "mocap_framerate")))
    assert found.fps == 30 and np.ptp(found.translations, axis=0).max() == 0
    assert any("no trans" in note for note in found.notes) and any("no rate: 30" in note for note in found.notes)


WORLDS = {"y": (0, 0, 0), "z": (90, 0, 0), "-y": (180, 0, 0), "-z": (-90, 0, 0), "x": (0, 0, -90), "-x": (0, 0, 90)}


def walking(world: Rotation, frames: int = 40) -> dict[str, np.ndarray]:
    """A person who walks, written into another world with AMASS's names."""
    walk = motions.load("walk")[:frames]
    poses = np.zeros((len(walk), 66))
    for joint in range(22):
        poses[:, 3 * joint : 3 * joint + 3] = Rotation.from_quat(walk.rotations[:, joint][:, [1, 2, 3, 0]]).as_rotvec()
    poses[:, :3] = (world * Rotation.from_rotvec(poses[:, :3])).as_rotvec()
    return {
        "poses": poses,
        "trans": world.apply(walk.translations) - [0, -0.22, 0.03],
        "mocap_framerate": np.array(walk.fps),
    }


@pytest.mark.parametrize("axis", WORLDS)
@pytest.mark.parametrize("frames", [1, 40])
def test_up_is_seen_from_the_body_in_every_world(tmp_path, axis, frames):
    """A walk in another world, and one pose of it, have pelvis, head and way of the world with y up."""
    world = Rotation.from_euler("xyz", WORLDS[axis], degrees=True)
    found = motions.read(written(tmp_path, walking(world, frames)))
    walk = motions.load("walk")[:frames]
    assert np.abs(found.rotations[:, 0] - walk.rotations[:, 0]).max() < 1e-5
    assert np.allclose(found.translations, walk.translations, atol=1e-5)
    declared = motions.read(written(tmp_path, walking(world, frames)), up=axis)
    assert np.array_equal(declared.rotations, found.rotations)


def test_a_body_that_lies_on_the_floor_goes_on_lying(tmp_path):
    """On its back along y, with z up, as AMASS has it: the pelvis 12 cm above the floor."""
    lying = {
        "poses": np.zeros((30, 66)),
        "trans": np.tile([0.4, 0.2, 0.12], (30, 1)),
        "mocap_framerate": np.array(30.0),
    }
    lying["poses"][:, 48:51] = [0, 0, -1.2]
    with pytest.warns(HemlineWarning, match="lies or leans in 100 % of the frames, with z up.*say --up=y"):
        found = motions.read(written(tmp_path, lying))
    upright = Rotation.from_euler("x", -90, degrees=True)
    assert np.allclose(found.rotations[:, 0], upright.as_quat()[[3, 0, 1, 2]], atol=1e-6)
    standing = motions.read(written(tmp_path, lying), up="y")
    assert np.allclose(standing.rotations[:, 0], [1, 0, 0, 0], atol=1e-6)
    with pytest.raises(BadMotion, match="the axis that is up in .* must be one of y, z, x, -y, -z, -x; got w"):
        motions.read(written(tmp_path, lying), up="w")


def test_damaged_and_missing_files_are_refused(tmp_path, sample):
    path = written(tmp_path, sample)
    path.write_bytes(path.read_bytes()[:900])
    with pytest.raises(BadMotion, match="is damaged or no AMASS clip"):
        motions.read(path)
    path.write_bytes(b"\x80\x04pickle")
    with pytest.raises(BadMotion, match="pickled objects are not read"):
        motions.read(path)
    with pytest.raises(BadMotion, match="cannot read .*absent.npz; got No such file"):
        motions.read(tmp_path / "absent.npz")


def long(frames: int, dtype: type = np.float16) -> dict[str, np.ndarray]:
    """A clip of one pose."""
    poses, trans = np.zeros((frames, 66), dtype), np.zeros((frames, 3), dtype)
    return {"poses": poses, "trans": trans, "mocap_framerate": np.array(120.0)}


def test_equal_frames_are_read_where_they_are_few_or_take_room(tmp_path):
    np.savez_compressed(tmp_path / "few.npz", **long(9_000))
    np.savez(tmp_path / "room.npz", **long(20_000))
    assert len(motions.read(tmp_path / "few.npz")) == 9_000 and len(motions.read(tmp_path / "room.npz")) == 20_000


@pytest.mark.parametrize(
    ("frames", "dtype", "save", "message"),
    [
        (20_000, np.float16, np.savez_compressed, "has more frames than a recording of its size has; got 20000 in"),
        (200_000, np.float16, np.savez_compressed, r"got a file of \d+ bytes that unpacks to 27600"),
        (432_001, np.int8, np.savez, "may have 432000 frames, an hour at 120 a second; got 432001; cut it"),
    ],
)
def test_far_too_many_frames_are_refused(frames, dtype, save, message, tmp_path):
    save(tmp_path / "a.npz", **long(frames, dtype))
    with pytest.raises(BadMotion, match=message):
        motions.read(tmp_path / "a.npz")


@pytest.mark.parametrize("shape", [(0, 10**30), (1,) * 65, (-1, 3)])
def test_shapes_that_no_array_has_are_refused(shape, tmp_path):
    header = f"{{'descr': '<f2', 'fortran_order': False, 'shape': {shape}}}".encode()
    header += b" " * (-(len(header) + 11) % 64) + b"\n"
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        archive.writestr("poses.npy", b"\x93NUMPY\1\0" + len(header).to_bytes(2, "little") + header)
    with pytest.raises(BadMotion, match="is damaged or no AMASS clip"):
        motions.read(tmp_path / "a.npz")


@pytest.mark.parametrize("method", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_ways_of_packing_that_numpy_does_not_write_are_refused(method, tmp_path):
    np.savez(tmp_path / "plain.npz", **long(9))
    with zipfile.ZipFile(tmp_path / "plain.npz") as plain, zipfile.ZipFile(tmp_path / "a.npz", "w", method) as packed:
        for name in plain.namelist():
            packed.writestr(name, plain.read(name))
    with pytest.raises(BadMotion, match="packed in another way than NumPy does"):
        motions.read(tmp_path / "a.npz")
