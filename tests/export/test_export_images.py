"""A clip as pictures, read back with Pillow."""

# Pillow's images have n_frames only in some formats
# pyright: reportAttributeAccessIssue=false

import numpy as np
import pytest
from PIL import Image

from hemline.errors import BadInput
from hemline.export import write


def test_the_still_shows_garment_and_body(tmp_path, full_clip):
    write(tmp_path / "a.png", full_clip, size=(96, 128), view="back")
    with Image.open(tmp_path / "a.png") as image:
        assert image.size == (96, 128)
        pixels = np.asarray(image).astype(int)
    red = (pixels[..., 0] > pixels[..., 2] + 40).mean()
    grey = ((np.ptp(pixels, axis=-1) < 25) & (pixels.sum(axis=-1) < 520)).mean()
    assert red > 0.05
    assert grey > 0.005


def test_the_moving_picture_has_all_frames_at_the_clips_pace(tmp_path, full_clip):
    write(tmp_path / "a.webp", full_clip, size=(96, 96))
    with Image.open(tmp_path / "a.webp") as image:
        assert (image.n_frames, image.size) == (7, (96, 96))
        durations, frames = [], []
        for frame in range(7):
            image.seek(frame)
            image.load()
            durations.append(image.info["duration"])
            frames.append(np.asarray(image.convert("RGB")).astype(int))
    assert sum(durations) == round(7000 / 24)
    assert np.abs(frames[3] - frames[0]).mean() > 0.5  # it moves


def test_pictures_have_a_size_of_their_own(tmp_path, cloth_clip):
    for name, size in (("a.png", (640, 640)), ("a.webp", (480, 480))):
        write(tmp_path / name, cloth_clip)
        with Image.open(tmp_path / name) as image:
            assert image.size == size


def test_an_unknown_view_is_refused(tmp_path, cloth_clip):
    with pytest.raises(BadInput, match="no such view; got 'below'"):
        write(tmp_path / "a.png", cloth_clip, view="below")
    assert not list(tmp_path.iterdir())
