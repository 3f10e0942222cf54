import numpy as np
import pytest

from hemline.errors import BadMotion
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
        (without_last_line, "declares 4 frames; got 243 numbers, enough for 3"),
        (lambda text: text[:-20], "declares 4 frames"),
        (lambda text: text + "1 2 3\n", "declares 4 frames"),
        (lambda text: text.replace("Frames: 4", "Frames: 5"), "declares 5 frames"),
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
        (lambda text: text.replace("Frame Time: 0.0166667", "Frame Time: 1000000"), "a second; got 1e-06; correct"),
        (lambda text: text.replace("Frames: 4", f"Frames: {'9' * 4000}"), "got far too many frames, more than 432000"),
        (lambda text: text.replace("Frames: 4", f"Frames: {'9' * 5000}"), "in place of a number"),
        (lambda text: text.replace("CHANNELS 3 Z", f"CHANNELS {'9' * 4000} Z", 1), f"got CHANNELS {'9' * 60};"),
        (lambda text: text.replace("MOTION", "ROOT B { OFFSET 0 0 0 CHANNELS 0 } MOTION"), "two roots"),
    ],
)
def test_damaged_files_are_refused(tmp_path, clip, spoil, message):
    text = spoil(text_of(clip))
    with pytest.raises(BadMotion, match=message):
        read_bvh(written(tmp_path, text))


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
