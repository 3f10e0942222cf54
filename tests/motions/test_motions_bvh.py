import re
import warnings
from dataclasses import replace

import numpy as np
import pytest

from hemline.errors import BadMotion, HemlineWarning
from hemline.motions.bvh import read_bvh
from tests.motions.bvh_samples import NAMES, person, text_of


@pytest.fixture(scope="module")
def clip():
    return person(frames=4)


def written(tmp_path, text):
    path = tmp_path / "clip.bvh"
    path.write_text(text)
    return path


@pytest.mark.parametrize("order", ["ZYX", "ZXY", "XYZ", "YZX"])
def test_every_order_of_channels_is_honoured(tmp_path, clip, order):
    found = read_bvh(written(tmp_path, text_of(clip, orders={name: order for name in NAMES[::2]})))
    by_name = [found.skeleton.names.index(name) for name in NAMES]
    dots = np.abs(np.sum(found.rotations[:, by_name] * clip.rotations, axis=-1))
    assert np.allclose(dots, 1, atol=1e-12)
    assert np.allclose(found.skeleton.offsets[by_name], clip.skeleton.offsets)
    assert np.allclose(found.positions[0], clip.positions[0], atol=1e-6)
    assert found.fps == 60


def test_order_of_position_channels_and_braces_on_the_same_line(tmp_path, clip):
    text = (
        text_of(clip).replace("Xposition Yposition Zposition", "Yposition Zposition Xposition").replace("\n{", " {", 1)
    )
    found = read_bvh(written(tmp_path, text.replace("\n", "\r\n")))
    assert np.allclose(found.positions[0], np.roll(clip.positions[0], 1, axis=1), atol=1e-6)


def test_frame_times_with_few_digits_and_odd_rates(tmp_path, clip):
    text = text_of(clip)
    assert read_bvh(written(tmp_path, text.replace("0.0166667", "0.0083333"))).fps == 120
    assert read_bvh(written(tmp_path, text.replace("0.0166667", "0.0400801"))).fps == pytest.approx(24.95, abs=0.01)


def without_last_line(text):
    return text.rstrip("\n").rsplit("\n", 1)[0] + "\n"


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda text: "", "no whole BVH file; got no section HIERARCHY"),
        (lambda text: text.partition("MOTION")[0], "no whole BVH file; got no section MOTION"),
        (lambda text: text[: len(text) // 3], "no whole BVH file; got no section MOTION"),
        (lambda text: text[:-20], "declares 4 frames"),
        (lambda text: text + "1 2 3\n", "declares 4 frames"),
        (
            lambda text: text.replace("Frames: 4", "Frames: none"),
            "motion of .* cannot be read; got 'none' in place of a number",
        ),
        (lambda text: text.replace("Frames: 4", "Frames: 0"), "cannot be read; got 0 frames"),
        (lambda text: text.replace("Frame Time: 0.0166667", "Frame Time: 0"), "4 frames of 0.0 s"),
        (lambda text: text.replace("Frame Time:", "Time:"), "no 'Frames:' or no 'Frame Time:'"),
        (lambda text: text.rpartition(" ")[0] + " nan\n", "must hold finite numbers; got NaN or infinity in frame 3"),
        (
            lambda text: text.rpartition(" ")[0] + " 1,5\n",
            "motion of .* cannot be read; got '1,5' in place of a number",
        ),
        (
            lambda text: text.replace("CHANNELS 3 Zrotation", "CHANNELS 2", 1),
            "must have 80 numbers, one a channel; got 81",
        ),
        (lambda text: text.replace("CHANNELS 3 Zrotation", "CHANNELS 3 Wrotation", 1), "got CHANNELS 3 Wrotation"),
        (
            lambda text: text.replace("OFFSET 10", "OFFSET ten", 1),
            "hierarchy of .* cannot be read; got 'OFFSET ten",
        ),
        (lambda text: text.replace("OFFSET 10", "OFFSET nan", 1), "an OFFSET that is NaN"),
        (lambda text: text.replace("JOINT LeftFoot", "LIMB LeftFoot"), "got 'LIMB'"),
        (lambda text: text.replace("}\nMOTION", "MOTION"), "got an end inside a joint"),
        (lambda text: text.replace("JOINT LeftLeg", "JOINT RightLeg"), "different names; got 'RightLeg' twice"),
        (lambda text: text.replace("Frame Time: 0.0166667", "Frame Time: 1e-320"), "from 1 to 1000 frames a second"),
        (
            lambda text: text.replace("Frame Time: 0.0166667", "Frame Time: 1000000"),
            "seconds of a frame, at most 1; got 1e",
        ),
        (lambda text: text.replace("Frames: 4", f"Frames: {'9' * 4000}"), "got far too many frames, more than 432000"),
        (lambda text: text.replace("Frames: 4", f"Frames: {'9' * 5000}"), "in place of a number"),
        (lambda text: text.replace("CHANNELS 3 Z", f"CHANNELS {'9' * 4000} Z", 1), f"got CHANNELS {'9' * 60};"),
    ],
)
def test_damaged_files_are_refused(tmp_path, clip, spoil, message):
    text = spoil(text_of(clip))
    with pytest.raises(BadMotion, match=message):
        read_bvh(written(tmp_path, text))


def same(found, clip):
    dots = np.abs(np.sum(found.rotations[:, [found.skeleton.names.index(name) for name in NAMES]] * clip.rotations, -1))
    return np.allclose(dots, 1, atol=1e-12) and np.allclose(found.positions[0], clip.positions[0], atol=1e-6)


PROP = "ROOT Prop { OFFSET 0 0 0 CHANNELS 3 Zrotation Xrotation Yrotation End Site { OFFSET 0 1 0 } }"


@pytest.mark.parametrize(
    ("spoil", "note"),
    [
        (lambda text: "\ufeff" + text, None),
        (lambda text: text.lower().replace("left", "Left"), None),
        (lambda text: text.replace("rotation", "ROTATION").replace("position", "POSITION"), None),
        (lambda text: text.replace("Frames: 4", "\n\nFrames 4\n"), None),
        (lambda text: text.replace("Frame Time:", "Frame Time :"), None),
        (lambda text: text.replace("Frame Time: ", "FrameTime:\t"), None),
        (lambda text: text.replace("Frames: 4", "Frames: 3"), "declares 3 frames and has 4: 4 are read"),
        (lambda text: text.replace("Frames: 4", "Frames: 5"), "declares 5 frames and has 4: 4 are read"),
        (
            lambda text: text.partition("MOTION")[0] + "MOTION" + text.partition("MOTION")[2].replace(".", ","),
            "decimal commas",
        ),
        (lambda text: text.replace("MOTION", f"{PROP}\nMOTION"), "several roots: 'Hips' (26 joints) is read, 'Prop'"),
    ],
)
def test_what_other_readers_take_is_read(tmp_path, clip, spoil, note):
    text = spoil(text_of(clip))
    path = tmp_path / "clip.bvh"
    path.write_text(text, encoding="utf-8")
    names = {name.lower(): name for name in NAMES}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", HemlineWarning)
        found = read_bvh(path)
    found = replace(
        found, skeleton=replace(found.skeleton, names=tuple(names[name.lower()] for name in found.skeleton.names))
    )
    assert same(found, clip) and found.fps == 60
    assert [note in each for each in found.notes] == ([True] if note else [])


def test_a_file_in_utf_16_is_read(tmp_path, clip):
    (tmp_path / "clip.bvh").write_text(text_of(clip), encoding="utf-16")
    assert same(read_bvh(tmp_path / "clip.bvh"), clip)


def test_columns_of_a_second_root_are_left_out(tmp_path, clip):
    """The prop stands before the person, and has numbers of its own."""
    head, motion = text_of(clip).split("MOTION\n")
    lines = motion.splitlines()
    lines[2:] = [f"7 8 9 {line}" for line in lines[2:]]
    text = head.replace("HIERARCHY", f"HIERARCHY\n{PROP}") + "MOTION\n" + "\n".join(lines)
    found = read_bvh(written(tmp_path, text))
    assert same(found, clip)
    assert found.skeleton.names[0] == "Hips" and found.skeleton.parents[0] == -1


def test_a_file_that_ends_long_before_its_frames_do_is_read_with_a_warning(tmp_path, clip):
    with pytest.warns(HemlineWarning, match="declares 9 frames, and ends before; got 4"):
        assert len(read_bvh(written(tmp_path, text_of(clip).replace("Frames: 4", "Frames: 9"))).rotations) == 4


def test_rotations_in_radians_are_warned_of(tmp_path, clip):
    lines = text_of(clip).splitlines()
    start = len(lines) - 4
    for row in range(start, len(lines)):
        words = lines[row].split()
        lines[row] = " ".join(words[:3] + [f"{np.radians(float(word)):.6f}" for word in words[3:]])
    with pytest.warns(
        HemlineWarning, match="hardly turn a joint; got none beyond .*in radians, multiply them by 57.29"
    ):
        read_bvh(written(tmp_path, "\n".join(lines)))


@pytest.mark.parametrize(("time", "cure"), [("33.3333", "write 0.0333333 if"), ("30", "0.0333333 if it is frames a")])
def test_frame_times_in_milliseconds_and_rates_are_refused_with_what_to_write(tmp_path, clip, time, cure):
    with pytest.raises(BadMotion, match=f"'Frame Time' of .* must be the seconds of a frame.*got {time}.*{cure}"):
        read_bvh(written(tmp_path, text_of(clip).replace("0.0166667", time)))


def test_bones_that_have_positions_in_place_of_offsets_are_read(tmp_path, clip):
    """Rokoko and SynthEyes export six channels a joint."""
    text = text_of(clip)
    head, motion = text.split("MOTION\n")
    head = re.sub(r"(?<=JOINT )(\w+)(\s*\{\s*)OFFSET (.*)\n", r"\1\2OFFSET 0 0 0 # \3\n", head)
    places = [line.rpartition("# ")[2] for line in head.splitlines() if "#" in line]
    head = re.sub(" #.*", "", head).replace("CHANNELS 3 ", "CHANNELS 6 Xposition Yposition Zposition ")
    lines = motion.splitlines()
    for row, line in enumerate(lines[2:], 2):
        words = line.split()
        joints = [words[6 + 3 * joint : 9 + 3 * joint] for joint in range(len(places))]
        pairs = zip(places, joints, strict=True)
        lines[row] = " ".join(words[:6] + [f"{place} {' '.join(turn)}" for place, turn in pairs])
    found = read_bvh(written(tmp_path, head + "MOTION\n" + "\n".join(lines)))
    assert same(found, clip)
    assert np.allclose(found.skeleton.offsets, read_bvh(written(tmp_path, text)).skeleton.offsets)
    assert "all OFFSETs are zero" in found.notes[0]


@pytest.mark.parametrize(("time", "fps"), [("1", 1), ("0.0010", 1000), ("0.0083333", 120), ("0.03333", 30)])
def test_rates_from_one_to_a_thousand_are_read(tmp_path, clip, time, fps):
    assert read_bvh(written(tmp_path, text_of(clip).replace("0.0166667", time))).fps == fps


def test_numbers_may_stand_on_one_line_and_lines_end_in_any_way(tmp_path, clip):
    text = text_of(clip)
    head, _, numbers = text.partition("0.0166667\n")
    found = read_bvh(written(tmp_path, text))
    for other in (f"{head}0.0166667\n{' '.join(numbers.split())}", text.replace("\n", "\r\n"), text.rstrip()):
        (tmp_path / "other.bvh").write_bytes(other.encode())
        again = read_bvh(tmp_path / "other.bvh")
        assert np.array_equal(again.rotations, found.rotations) and again.fps == found.fps


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(BadMotion, match=r"cannot read .*absent.bvh; got No such file"):
        read_bvh(tmp_path / "absent.bvh")
