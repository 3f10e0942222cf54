"""Image files, read back with Pillow."""

# Pillow's images have n_frames only in some formats
# pyright: reportAttributeAccessIssue=false

import numpy as np
import pytest
from PIL import Image

from hemline.errors import BadInput, BadOutput
from hemline.pictures import add_caption, side_by_side, write_png, write_webp


def gradient(height=40, width=60, shift=0):
    y, x = np.mgrid[:height, :width]
    return np.stack([4 * x + shift, 6 * y, np.full_like(x, 90)], axis=-1).clip(0, 255).astype(np.uint8)


def test_png_keeps_every_byte(tmp_path):
    write_png(tmp_path / "a.png", gradient())
    with Image.open(tmp_path / "a.png") as image:
        np.testing.assert_array_equal(np.asarray(image), gradient())


@pytest.mark.parametrize("fps", [30.0, 24.0, 60.0, 7.3])
def test_webp_has_its_frames_at_their_times(tmp_path, fps):
    frames = [gradient(shift=12 * k) for k in range(10)]
    write_webp(tmp_path / "a.webp", frames, fps)
    with Image.open(tmp_path / "a.webp") as image:
        assert (image.n_frames, image.info["loop"]) == (10, 0)
        durations = []
        for k in range(10):
            image.seek(k)
            image.load()
            durations.append(image.info["duration"])
            assert np.abs(np.asarray(image.convert("RGB")).astype(int) - frames[k]).mean() < 6
    assert sum(durations) == round(10 * 1000 / fps)
    assert max(durations) - min(durations) <= 1


def test_pictures_in_a_row():
    row = side_by_side([gradient(width=60), gradient(width=20)])
    assert row.shape == (40, 80, 3)
    np.testing.assert_array_equal(row[:, 60:], gradient(width=20))


def test_captions_change_the_lower_left_only():
    white = np.full((200, 300, 3), 255, np.uint8)
    changed = np.argwhere((add_caption(white, "frame 12") != 255).any(axis=-1))
    assert len(changed) > 20
    assert changed[:, 0].min() > 150
    assert changed[:, 1].max() < 150
    assert (side_by_side([white, white], ["one", "two"])[:, 300:] != 255).any()


def test_refusals(tmp_path):
    with pytest.raises(BadInput, match=r"pictures do not fit in one row; got 2 pictures of heights \[30, 40\]"):
        side_by_side([gradient(30), gradient(40)])
    with pytest.raises(BadInput, match="2 pictures of heights .* and 1 captions"):
        side_by_side([gradient(), gradient()], ["one"])
    with pytest.raises(BadOutput, match="got 0 frames at 30.0 a second"):
        write_webp(tmp_path / "a.webp", [], 30.0)
    with pytest.raises(BadOutput, match="got 1 frames at 2000 a second"):
        write_webp(tmp_path / "a.webp", [gradient()], 2000)
    for path in (tmp_path / "none" / "a.png", tmp_path / "none" / "a.webp"):
        with pytest.raises(BadOutput, match="cannot write"):
            write_png(path, gradient()) if path.suffix == ".png" else write_webp(path, [gradient()], 30)
    assert not list(tmp_path.iterdir())
