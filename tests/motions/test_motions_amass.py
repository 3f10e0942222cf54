import zipfile

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hemline import motions
from hemline.errors import BadMotion
from hemline.motions import JOINT_NAMES, PARENTS


@pytest.fixture
def sample():
    """Arrays of an SMPL-H clip: z up, walking along y."""
    chance = np.random.default_rng(1)
    return {
        "poses": chance.normal(0, 0.4, (5, 156)),
        "trans": np.stack([np.zeros(5), np.linspace(0, 1, 5), np.full(5, 0.9)], axis=1),
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
        (lambda s: without(s, "trans"), "is no AMASS clip; got no array .*trans"),
        (lambda s: without(s, "poses"), "is no AMASS clip; got no array .*root_orient"),
        (lambda s: without(s, "mocap_framerate"), "got no array 'mocap_framerate'"),
        (lambda s: s | {"poses": s["poses"][:, :60]}, r"must be \(frames, 156\).*got \(5, 60\)"),
        (lambda s: s | {"poses": s["poses"][:0], "trans": s["trans"][:0]}, r"got \(0, 156\)"),
        (lambda s: s | {"trans": s["trans"][:4]}, r"trans of .* must be \(5, 3\); got \(4, 3\)"),
        (lambda s: s | {"trans": s["trans"] * np.nan}, "must hold finite numbers"),
        (lambda s: s | {"poses": np.array([{"a": 1}], dtype=object)}, "pickled objects are not read"),
        (lambda s: s | {"mocap_framerate": np.array("fast")}, "is damaged or no AMASS clip"),
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
