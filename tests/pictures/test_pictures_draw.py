"""One call to look at something, and the figure beside the truth."""

import numpy as np
import pytest
from PIL import Image

from hemline.errors import BadInput
from hemline.pictures import compare, comparison, draw, picture_of
from hemline.pictures.compare import scale_colours

SIDE = np.linspace(-0.5, 0.5, 12, dtype=np.float32)
SHEET = np.stack([*np.meshgrid(SIDE, SIDE), np.zeros((12, 12), np.float32)], axis=-1).reshape(-1, 3)
CORNER = (np.arange(11)[:, None] * 12 + np.arange(11)).ravel()
FACES = np.concatenate(
    [np.stack([CORNER, CORNER + 1, CORNER + 13], 1), np.stack([CORNER, CORNER + 13, CORNER + 12], 1)]
).astype(np.int32)


def test_draw_writes_one_picture_a_view(tmp_path):
    draw(tmp_path / "sheet.png", [(SHEET, FACES, "cloth")], view=["front", "side", "back"], size=(96, 80))
    with Image.open(tmp_path / "sheet.png") as image:
        assert image.size == (288, 80)


def test_the_named_colours_are_seen():
    cloth = picture_of([(SHEET, FACES, "cloth")], "front", size=(64, 64), ground=None)[32, 32].astype(int)
    truth = picture_of([(SHEET, FACES, "truth")], "front", size=(64, 64), ground=None)[32, 32].astype(int)
    own = picture_of([(SHEET, FACES, (0.1, 0.8, 0.1))], "front", size=(64, 64), ground=None)[32, 32].astype(int)
    assert cloth[0] > cloth[2] + 40
    assert truth[2] > truth[0] + 40
    assert own[1] > max(own[0], own[2]) + 40


def test_the_error_is_where_the_colours_say():
    ours = SHEET.copy()
    ours[SHEET[:, 0] > 0.2, 2] += 0.05
    size = (160, 160)
    picture = comparison(ours, SHEET, FACES, size=size)
    assert picture.shape == (320, 480, 3)
    error = picture[:160, 320:].astype(int)
    wrong = (error[..., 0] > error[..., 1] + 40) & (error[..., 0] > error[..., 2] + 15)
    columns = np.nonzero(wrong[60:120, :140])[1]
    assert len(columns) > 20
    assert columns.mean() > 80


def test_without_truth_only_ours_is_drawn(tmp_path):
    body = SHEET + np.array([0, 0, -0.2], np.float32), FACES
    compare(tmp_path / "worst.png", SHEET, None, FACES, body=body, size=(80, 100))
    with Image.open(tmp_path / "worst.png") as image:
        assert image.size == (80, 200)


def test_the_scale_runs_from_pale_to_dark():
    light = scale_colours(np.linspace(-0.5, 1.5, 40)).sum(axis=1)
    assert (np.diff(light) <= 1e-6).all()
    assert light[0] == pytest.approx(2.67, abs=1e-5)
    assert light[-1] == pytest.approx(0.48, abs=1e-5)


def test_a_truth_of_another_garment_is_refused():
    with pytest.raises(BadInput, match="a frame and its truth must have the same vertices"):
        comparison(SHEET, SHEET[:-1], FACES)
