"""Clips of SOMA's skeleton as Kimodo writes them: positions and global rotations of 30 or 77 joints."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hemline import motions
from hemline.errors import BadMotion
from hemline.motions import JOINT_NAMES
from hemline.motions.soma import SKELETONS
from tests.motions.rig_samples import apart_mm, globals_of, sample

PARTS = {
    "Leg": "hip",
    "Shin": "knee",
    "Foot": "ankle",
    "ToeBase": "foot",
    "Shoulder": "collar",
    "Arm": "shoulder",
    "ForeArm": "elbow",
    "Hand": "wrist",
}
OURS = (
    {"Hips": "pelvis", "Spine1": "spine1", "Spine2": "spine2", "Chest": "spine3", "Neck1": "neck", "Head": "head"}
    | {f"Left{theirs}": f"left_{ours}" for theirs, ours in PARTS.items()}
    | {f"Right{theirs}": f"right_{ours}" for theirs, ours in PARTS.items()}
)


def arrays(joints: int) -> tuple[dict[str, np.ndarray], object]:
    """A walk on SOMA's skeleton; joints that are not ours go with the one above, a few centimetres from it."""
    truth = sample("walk")
    turned, places = globals_of(truth.motion), truth.places
    found: dict[str, tuple[Rotation, np.ndarray]] = {}
    for name, parent in SKELETONS[joints].items():
        if not parent:
            found[name] = turned[0], truth.motion.translations.astype(float)
        elif name in OURS:
            joint = JOINT_NAMES.index(OURS[name])
            above = next(each for each in (parent, *reversed(list(found))) if each in OURS and each in found)
            above = parent if parent in OURS else above
            start = places[JOINT_NAMES.index(OURS[above])]
            at = found[above][1] + found[above][0].apply(places[joint] - start)
            found[name] = turned[joint], at
        else:
            turn, at = found[parent]
            out = 1 if name.startswith("Left") else -1
            off = [0.04 * out, 0, 0.03 * ("Thumb" in name)] if "Hand" in name else [0.0, 0.02, 0.01]
            found[name] = turn, at + turn.apply(off)
    return {
        "posed_joints": np.stack([at for _, at in found.values()], axis=1).astype(np.float32),
        "global_rot_mats": np.stack([turn.as_matrix() for turn, _ in found.values()], axis=1).astype(np.float32),
        "foot_contacts": np.zeros((len(truth.motion), 4), bool),
    }, truth


@pytest.mark.parametrize("joints", [30, 77])
def test_the_walk_is_the_walk(tmp_path, joints):
    content, truth = arrays(joints)
    np.savez(tmp_path / "motion.npz", **content)
    found = motions.read(tmp_path / "motion.npz")
    mean, most = apart_mm(found, truth)
    assert mean < 10 and most < 40
    assert found.fps == 30 and any("no rate" in note for note in found.notes)


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda a: {name: array[:, :28] for name, array in a.items()}, "30 or 77 joints; got 28 joints"),
        (lambda a: a | {"global_rot_mats": a["global_rot_mats"][:-1]}, r"global_rot_mats of .* must be finite and"),
        (lambda a: a | {"posed_joints": a["posed_joints"] * np.nan}, "must be finite"),
        (lambda a: a | {"posed_joints": a["posed_joints"][0]}, "got posed_joints of shape"),
    ],
)
def test_other_arrays_are_refused(tmp_path, spoil, message):
    np.savez(tmp_path / "motion.npz", **spoil(arrays(30)[0]))
    with pytest.raises(BadMotion, match=message):
        motions.read(tmp_path / "motion.npz")
