"""All recordings of the shared folder, where it is there."""

import csv
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hemline import motions
from hemline.models.make.excerpts import EXCERPTS, make_excerpt
from hemline.motions import JOINT_NAMES, PARENTS
from hemline.motions.bvh import read_bvh

FOLDER = Path(__file__).resolve().parents[2] / "../shared/data/motion"
MANIFEST = FOLDER / "manifest.csv"
ROWS = list(csv.DictReader(MANIFEST.read_text().splitlines())) if MANIFEST.exists() else []
SOME = (
    "02_03.bvh",
    "05_11.bvh",
    "16_21.bvh",
    "35_01.bvh",
    "id_unverified/backflip.bvh",
    "style_loops/120_08.bvh",
    "style_loops/142_10.bvh",
    "daz_rig/135_04.bvh",
)
STRICTER = {
    "01_07.bvh": (0, 3364),
    "05_10.bvh": (385, 817),
    "13_26.bvh": (0, 874),
    "60_08.bvh": (485, 2944),
    "daz_rig/135_07.bvh": (0, 1149),
}
"""Clean stretches that differ from the manifest's, which judges joint by joint: here an upper arm is judged against the
chest, and the pelvis by half the limit."""
pytestmark = [
    pytest.mark.data,
    pytest.mark.skipif(not ROWS, reason=f"no clips in {FOLDER}"),
]
LIMBS = ("hip", "knee", "shoulder", "elbow")
BONES = {
    "cmu_mb": (("UpLeg", "Leg"), ("Leg", "Foot"), ("Arm", "ForeArm"), ("ForeArm", "Hand")),
    "daz": (("Thigh", "Shin"), ("Shin", "Foot"), ("Shldr", "ForeArm"), ("ForeArm", "Hand")),
}
TPOSE = {"hip": (0, -1, 0), "knee": (0, -1, 0), "shoulder": (1, 0, 0), "elbow": (1, 0, 0)}


def row_of(file):
    return next(row for row in ROWS if row["file"] == file)


def dropped(row, motion):
    return int(row["frames"]) - len(motion)


def check(row):
    """What must hold for every clip: rate, length, size, clean stretch, subject."""
    motion = motions.read(FOLDER / row["file"])
    assert motion.fps == float(row["fps"])
    lead = dropped(row, motion)
    assert lead == 0 or (row["rig"] == "daz" and lead <= 4)
    assert 0.7 < motion.leg_length < 0.95
    first, end = (int(number) for number in row["longest_clean"].split("-"))
    clean = motions.longest_clean(motion)
    assert clean == STRICTER.get(row["file"], (max(first - lead, 0), end - lead))
    pelvis = Rotation.from_quat(motion.rotations[slice(*clean), 0][:, [1, 2, 3, 0]].astype(float))
    turned = (pelvis[1:] * pelvis[:-1].inv()).magnitude() * motion.fps if len(pelvis) > 1 else np.zeros(1)
    assert np.rad2deg(turned.max()) < 1505
    if row["cmu_id"][:2].isdigit() and "xx" not in row["cmu_id"]:
        subject = row["cmu_id"].split("_")[0]
        assert motions.subject_of(motion) == {"61": "60"}.get(subject, subject)
    return motion


@pytest.mark.parametrize("file", SOME)
def test_some_clips_of_every_rig(file):
    check(row_of(file))


def test_all_clips():
    assert len(ROWS) == 110
    for row in ROWS:
        check(row)


def source_directions(bvh, bone, tip):
    """Directions from a joint to another in every frame, by scipy, from the file's own hierarchy."""
    skeleton = bvh.skeleton
    total = {}
    place = {}
    for joint, parent in enumerate(skeleton.parents):
        local = Rotation.from_quat(bvh.rotations[:, joint][:, [1, 2, 3, 0]])
        total[joint] = local if parent < 0 else total[parent] * local
        place[joint] = bvh.positions[0] if parent < 0 else place[parent] + total[parent].apply(skeleton.offsets[joint])
    away = place[skeleton.names.index(tip)] - place[skeleton.names.index(bone)]
    return away / np.linalg.norm(away, axis=1, keepdims=True)


def target_directions(motion, joint, bone):
    """Directions of a T-pose bone in every frame, by scipy."""
    index = JOINT_NAMES.index(joint)
    total = Rotation.identity(len(motion))
    while index >= 0:
        total = Rotation.from_quat(motion.rotations[:, index][:, [1, 2, 3, 0]]) * total
        index = PARENTS[index]
    return total.apply(bone)


@pytest.mark.parametrize("file", ["02_03.bvh", "style_loops/142_10.bvh", "daz_rig/135_04.bvh"])
def test_limbs_point_where_those_of_the_recording_point(file):
    row, bvh = row_of(file), read_bvh(FOLDER / file)
    motion = motions.read(FOLDER / file)
    for side, sign in (("Left", 1), ("Right", -1)):
        for joint, (bone, tip) in zip(LIMBS, BONES[row["rig"]], strict=True):
            prefix = side if row["rig"] == "cmu_mb" else side[0].lower()
            theirs = source_directions(bvh, prefix + bone, prefix + tip)[dropped(row, motion) :]
            tpose = np.array(TPOSE[joint], float) * [sign, 1, 1]
            ours = target_directions(motion, f"{side.lower()}_{joint}", tpose)
            cosines = np.clip(np.sum(theirs * ours, axis=1), -1, 1)
            assert np.degrees(np.arccos(cosines)).max() < 0.1, (file, side, bone)


@pytest.mark.parametrize("file", SOME)
def test_elbows_bend_forward_knees_backward_and_faces_lead(file):
    """In the frame of the upper arm the forearm is in front; in that of the thigh the shank is behind; and a walker's
    toes point where the pelvis faces."""
    motion = motions.read(FOLDER / file)
    for side, out in (("left", 1.0), ("right", -1.0)):
        for upper, lower, bone, front in (("shoulder", "elbow", (out, 0, 0), 1), ("hip", "knee", (0, -1, 0), -1)):
            start, end = (target_directions(motion, f"{side}_{joint}", bone) for joint in (upper, lower))
            ahead = target_directions(motion, f"{side}_{upper}", (0, 0, 1))
            bend = np.degrees(np.arccos(np.clip(np.sum(start * end, axis=1), -1, 1)))
            bent = bend > 15
            assert np.sign(np.sum(end * ahead, axis=1)[bent]).mean() * front > 0.98
    facing = target_directions(motion, "pelvis", (0, 0, 1))
    toes = target_directions(motion, "left_ankle", (0, 0, 1)) + target_directions(motion, "right_ankle", (0, 0, 1))
    assert np.median(np.sum(facing * toes, axis=1)) > 0


@pytest.mark.parametrize("name", EXCERPTS)
def test_the_shipped_excerpts_are_made_of_clean_stretches(name):
    made = make_excerpt(name, FOLDER)
    shipped = motions.load(name)
    # not to the bit: NumPy's sines and cosines differ by an ulp between processors
    assert made.rotations == pytest.approx(shipped.rotations, abs=2e-7)
    assert made.translations == pytest.approx(shipped.translations, abs=2e-7)
    assert (made.fps, made.name) == (shipped.fps, shipped.name)
    excerpt, clip = EXCERPTS[name], motions.read(FOLDER / EXCERPTS[name].file)
    first, end = motions.longest_clean(clip)
    assert first <= excerpt.start_s * clip.fps
    assert excerpt.looped or (excerpt.start_s + excerpt.seconds) * clip.fps <= end - 1
