from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hemline.errors import BadMotion
from hemline.motions import JOINT_NAMES, PARENTS
from hemline.motions.bvh import Bvh, read_bvh
from hemline.motions.quaternions import angle, inverse, multiply, rotate
from hemline.motions.rigs.retarget import retarget
from tests.motions.bvh_samples import NAMES, OURS, person, quaternions, rezeroed, text_of


def in_degrees(first, second):
    """How far two motions are apart, worst joint and frame."""
    turned = multiply(inverse(first.rotations.astype(float)), second.rotations.astype(float))
    return np.degrees(angle(turned)).max()


def mapped(bvh):
    """Local rotations of the sample's joints in our order; identity for hands."""
    rotations = np.zeros((len(bvh.rotations), 24, 4))
    rotations[..., 0] = 1
    for joint, name in enumerate(JOINT_NAMES):
        if name in OURS:
            rotations[:, joint] = bvh.rotations[:, NAMES.index(OURS[name])]
    return rotations


def test_a_rig_that_has_our_rest_pose_keeps_its_rotations():
    clip = person()
    motion = retarget(clip)
    expected = mapped(clip)
    apart = np.degrees(angle(multiply(inverse(expected), motion.rotations.astype(float))))
    assert apart.max() < 1e-3


def test_translations_are_metres_midway_between_the_hips():
    clip = person()
    motion = retarget(clip)
    middle = clip.positions[0] + rotate(clip.rotations[:, 0], np.array([0.0, -8, 1]))
    assert np.allclose(motion.translations, 0.01 * middle, atol=1e-6)
    assert motion.leg_length == pytest.approx(0.84)
    assert any("unit cm, guessed" in note for note in motion.notes)


STRADDLE = {
    **dict.fromkeys(("LeftUpLeg", "LeftLeg"), Rotation.from_euler("z", -20, degrees=True)),
    **dict.fromkeys(("RightUpLeg", "RightLeg"), Rotation.from_euler("z", 20, degrees=True)),
}
ARM = ("Arm", "ForeArm", "Hand", "Middle", "Thumb")
HANGING = {
    **{f"Left{part}": Rotation.from_euler("zy", [90, 180], degrees=True) for part in ARM},
    **{f"Right{part}": Rotation.from_euler("zy", [-90, 180], degrees=True) for part in ARM},
    **{
        f"{side}{part}": Rotation.from_euler("x", -90, degrees=True)
        for side in ("Left", "Right")
        for part in ("Foot", "ToeBase")
    },
}
TWISTED = {
    **dict.fromkeys(("LeftArm", "LeftForeArm"), Rotation.from_euler("x", 30, degrees=True)),
    **dict.fromkeys(("RightArm", "RightForeArm"), Rotation.from_euler("xy", [50, 35], degrees=True)),
    **dict.fromkeys(("LeftUpLeg", "RightLeg"), Rotation.from_euler("yx", [80, 25], degrees=True)),
}


@pytest.mark.parametrize("turns", [STRADDLE, HANGING, TWISTED], ids=["straddle", "hanging", "twisted"])
def test_the_zero_pose_of_the_rig_does_not_matter(turns):
    """The same recording on rigs with other zero poses gives the same motion."""
    clip = person()
    other = rezeroed(clip, turns)
    assert not np.allclose(clip.skeleton.zero_positions, other.skeleton.zero_positions, atol=1)
    assert in_degrees(retarget(clip), retarget(other)) < 0.01
    assert np.allclose(retarget(clip).translations, retarget(other).translations, atol=1e-6)


def test_a_thumb_that_hangs_along_the_fingers_is_found_by_what_it_does():
    """Zero pose with thumbs along the fingers, and turned 60 degrees out of the palm throughout the clip."""
    clip = person()
    skeleton, rotations = clip.skeleton, clip.rotations.copy()
    offsets, ends = skeleton.offsets.copy(), dict(skeleton.ends)
    for side, sign in (("Left", 1), ("Right", -1)):
        thumb = NAMES.index(f"{side}Thumb")
        offsets[thumb] = [8 * sign, 0, 0]
        ends[thumb] = np.array([4.0 * sign, 0, 0])
        rest = sign * np.array([0.3, 0, 0]) + [0, -np.sin(np.pi / 3), np.cos(np.pi / 3)]
        rotations[:, thumb] = quaternions(Rotation.align_vectors([rest], [[sign, 0, 0]])[0])
    hanging = Bvh(replace(skeleton, offsets=offsets, ends=ends), rotations, clip.positions, clip.fps)
    assert in_degrees(retarget(hanging), retarget(clip)) < 0.01


def test_z_up_is_turned_to_y_up_and_said():
    clip = person()
    turn = Rotation.from_euler("x", 90, degrees=True)
    q = quaternions(turn)
    tilted = Bvh(
        replace(
            clip.skeleton,
            offsets=turn.apply(clip.skeleton.offsets),
            ends={joint: turn.apply(end) for joint, end in clip.skeleton.ends.items()},
        ),
        multiply(multiply(q, clip.rotations), inverse(q)),
        {0: turn.apply(clip.positions[0])},
        clip.fps,
    )
    motion = retarget(tilted)
    assert in_degrees(motion, retarget(clip)) < 0.01
    assert np.allclose(motion.translations, retarget(clip).translations, atol=1e-5)
    assert any("z up and x left: turned to y up" in note for note in motion.notes)


@pytest.mark.parametrize(
    ("declared", "unit", "scale"),
    [(None, "m", 0.01), (None, "mm", 10), (None, "inch", 1 / 2.54), (None, "cmu", 0.45 / 2.54), ("cm", "cm", 0.6)],
)
def test_units_are_guessed_or_taken_as_declared(declared, unit, scale):
    clip = person()
    scaled = Bvh(
        replace(clip.skeleton, offsets=scale * clip.skeleton.offsets),
        clip.rotations,
        {0: scale * clip.positions[0]},
        60.0,
    )
    motion = retarget(scaled, unit=declared)
    metres = scale if declared else 1
    assert motion.leg_length == pytest.approx(0.84 * (metres if declared else 1), rel=1e-6)
    how = "as declared" if declared else "guessed"
    assert any(note.startswith(f"unit {unit}, {how}") for note in motion.notes)


def test_units_that_contradict_the_size_are_refused():
    clip = person()
    with pytest.raises(
        BadMotion, match=r"unit 'm' contradicts the size of x.bvh; got legs of 84 m; the size fits 'cm'"
    ):
        retarget(clip, unit="m", name="x.bvh")
    with pytest.raises(BadMotion, match="unit of x.bvh must be one of m, cm"):
        retarget(clip, unit="furlong", name="x.bvh")
    giant = Bvh(replace(clip.skeleton, offsets=1e4 * clip.skeleton.offsets), clip.rotations, clip.positions, 60.0)
    with pytest.raises(BadMotion, match="the size of no person"):
        retarget(giant, name="x.bvh")
    flat = Bvh(replace(clip.skeleton, offsets=0 * clip.skeleton.offsets), clip.rotations, clip.positions, 60.0)
    with pytest.raises(BadMotion, match="legs of x.bvh must have a length"):
        retarget(flat, name="x.bvh")


def read_text(tmp_path, text):
    path = tmp_path / "clip.bvh"
    path.write_text(text)
    return read_bvh(path)


ROLES = [("LeftForeArm", "left elbow"), ("Head", "head"), ("RightFoot", "right ankle"), ("LeftUpLeg", "left hip")]


@pytest.mark.parametrize(("joint", "role"), ROLES)
def test_a_missing_joint_is_named(tmp_path, joint, role):
    """Of a rig that stands in no way that a person does, so that its shape tells nothing."""
    clip = person(frames=2)
    folded = replace(clip, skeleton=replace(clip.skeleton, offsets=clip.skeleton.offsets[::-1].copy()))
    bvh = read_text(tmp_path, text_of(folded, names={joint: "Something"}))
    with pytest.raises(BadMotion, match=f"x.bvh lacks the joint '{role}'"):
        retarget(bvh, name="x.bvh")


@pytest.mark.parametrize(("joint", "role"), ROLES)
def test_a_joint_of_another_name_is_found_by_its_place_and_said(tmp_path, joint, role):
    clip = person(frames=2)
    motion = retarget(read_text(tmp_path, text_of(clip, names={joint: "Something"})), name="x.bvh")
    assert f"their place in the tree, since x.bvh lacks the joint '{role}'" in motion.notes[0]
    assert "'Something'" in motion.notes[0]
    for name in ("left_knee", "right_elbow", "head"):
        apart = multiply(inverse(global_of(retarget(clip), name)), global_of(motion, name))
        assert np.degrees(angle(apart)).max() < 0.01


def test_arms_on_the_root_are_refused():
    clip = person()
    parents = list(clip.skeleton.parents)
    for name in ("LeftShoulder", "RightShoulder"):
        parents[NAMES.index(name)] = 0
    bvh = replace(clip, skeleton=replace(clip.skeleton, parents=tuple(parents)))
    with pytest.raises(BadMotion, match="lacks a joint of the spine; got arms on 'Hips'"):
        retarget(bvh, name="x.bvh")


def test_other_naming_customs_give_the_same_motion(tmp_path):
    clip = person()
    plain = retarget(read_text(tmp_path, text_of(clip)))
    parts = {
        "UpLeg": "Thigh",
        "Leg": "Shin",
        "Foot": "Foot",
        "ToeBase": "Toe",
        "Arm": "Shldr",
        "ForeArm": "ForeArm",
        "Hand": "Hand",
        "Shoulder": "Collar",
        "Thumb": "Thumb1",
    }
    daz = {f"{side}{part}": f"{side[0].lower()}{name}" for side in ("Left", "Right") for part, name in parts.items()}
    assert in_degrees(plain, retarget(read_text(tmp_path, text_of(clip, names=daz)))) < 1e-3
    prefixed = {name: f"mixamorig:{name}" for name in NAMES}
    assert in_degrees(plain, retarget(read_text(tmp_path, text_of(clip, names=prefixed)))) < 1e-3
    suffixed = {"LeftUpLeg": "thigh_l", "RightUpLeg": "thigh.R", "LeftLeg": "calf_l", "RightForeArm": "lowerarm_r"}
    assert in_degrees(plain, retarget(read_text(tmp_path, text_of(clip, names=suffixed)))) < 1e-3


@pytest.mark.parametrize("joints", [("Spine",), ("LowerBack", "Spine")])
def test_a_shorter_spine_keeps_chest_and_limbs(joints):
    """Joints of the spine that do not turn can be left out; what is above stays where it was."""
    clip = person()
    gone = [NAMES.index(name) for name in joints]
    rotations = clip.rotations.copy()
    rotations[:, gone] = [1, 0, 0, 0]
    whole = retarget(replace(clip, rotations=rotations))
    kept = [joint for joint in range(len(NAMES)) if joint not in gone]
    offsets, parents = clip.skeleton.offsets.copy(), list(clip.skeleton.parents)
    for joint in gone:
        for child, parent in enumerate(parents):
            if parent == joint:
                parents[child] = parents[joint]
                offsets[child] += offsets[joint]
    skeleton = replace(
        clip.skeleton,
        names=tuple(NAMES[joint] for joint in kept),
        parents=tuple(kept.index(parents[joint]) if parents[joint] >= 0 else -1 for joint in kept),
        offsets=offsets[kept],
        ends={kept.index(joint): end for joint, end in clip.skeleton.ends.items()},
        channels=tuple(() for _ in kept),
    )
    short = retarget(Bvh(skeleton, rotations[:, kept], clip.positions, clip.fps))
    for name in ("spine3", "head", "left_wrist", "right_ankle"):
        apart = multiply(inverse(global_of(whole, name)), global_of(short, name))
        assert np.degrees(angle(apart)).max() < 0.01


def global_of(motion, name):
    joint = JOINT_NAMES.index(name)
    total = motion.rotations[:, joint].astype(float)
    while PARENTS[joint] >= 0:
        joint = PARENTS[joint]
        total = multiply(motion.rotations[:, joint].astype(float), total)
    return total


def test_a_root_above_the_hips_carries_them(tmp_path):
    """A reference joint that is turned and moved, with hips that have position channels of their own."""
    clip = person(frames=3)
    text = text_of(clip)
    turn = Rotation.from_euler("ZYX", [0, 90, 0], degrees=True)
    head, motion = text.split("MOTION\n")
    channels = "6 Xposition Yposition Zposition Zrotation Yrotation Xrotation"
    head = head.replace("ROOT Hips", f"ROOT Reference {{ OFFSET 0 0 0 CHANNELS {channels} JOINT Hips")
    lines = motion.splitlines()
    lines[2:] = [f"10 20 30 0 90 0 {line}" for line in lines[2:]]
    found = retarget(read_text(tmp_path, head + "}\nMOTION\n" + "\n".join(lines)))
    plain = retarget(clip)
    assert np.allclose(found.translations, turn.apply(plain.translations) + [0.1, 0.2, 0.3], atol=1e-5)
    upright = multiply(quaternions(turn), plain.rotations[:, 0].astype(float))
    assert np.degrees(angle(multiply(inverse(upright), found.rotations[:, 0].astype(float)))).max() < 1e-3
    assert (
        in_degrees(plain, replace(found, rotations=np.concatenate([plain.rotations[:, :1], found.rotations[:, 1:]], 1)))
        < 1e-3
    )


def test_position_channels_of_limbs_do_not_stretch_them():
    clip = person()
    stretched = replace(
        clip, positions=clip.positions | {NAMES.index("LeftLeg"): np.full((len(clip.rotations), 3), 7.0)}
    )
    assert retarget(stretched).hash == retarget(clip).hash


def test_extra_joints_are_ignored_and_named():
    assert any("LeftMiddle, LeftThumb, RightMiddle, RightThumb" in note for note in retarget(person()).notes)


def test_a_leading_tpose_is_dropped_and_said():
    clip = person()
    rotations = clip.rotations.copy()
    rotations[0] = [1, 0, 0, 0]
    calm = np.repeat(rotations, [1] + [40] * (len(rotations) - 1), axis=0)
    positions = np.repeat(clip.positions[0], [1] + [40] * (len(rotations) - 1), axis=0)
    motion = retarget(replace(clip, rotations=calm, positions={0: positions}))
    assert len(motion) == len(calm) - 1
    assert any("frames 0 to 0 lead out of a T-pose" in note for note in motion.notes)
    assert len(retarget(replace(clip, rotations=calm[1:], positions={0: positions[1:]}))) == len(calm) - 1


def test_collars_that_stand_still_go_with_the_arms():
    """Lowered by 12 degrees under a hanging arm, none in the T-pose, raised under a lifted one; arms stay."""
    clip = person(frames=3)
    rotations = np.zeros_like(clip.rotations)
    rotations[..., 0] = 1
    for frame, lift in enumerate((-90, 0, 90)):
        rotations[frame, NAMES.index("LeftArm")] = quaternions(Rotation.from_euler("z", lift, degrees=True))
        rotations[frame, NAMES.index("RightArm")] = quaternions(Rotation.from_euler("z", -lift, degrees=True))
    rotations[:, NAMES.index("Hips")] = quaternions(Rotation.from_euler("xyz", [0.5, 1, -0.4]))
    motion = retarget(replace(clip, rotations=rotations))
    for side, sign in (("left", 1), ("right", -1)):
        collar = motion.rotations[:, JOINT_NAMES.index(f"{side}_collar")]
        lifted = np.degrees(Rotation.from_quat(collar[:, [1, 2, 3, 0]]).as_rotvec())
        assert np.allclose(lifted, [[0, 0, -12 * sign], [0, 0, 0], [0, 0, 12 * sign]], atol=1e-3)
    arm = rotate(
        inverse(global_of(motion, "pelvis")), rotate(global_of(motion, "left_shoulder"), np.array([1.0, 0, 0]))
    )
    assert np.allclose(arm, [[0, -1, 0], [1, 0, 0], [0, 1, 0]], atol=1e-6)
