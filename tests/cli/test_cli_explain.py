"""`hemline explain` on clips: five lines, and a picture of the source beside the body."""

import numpy as np
from PIL import Image

from hemline.cli import main
from tests.motions.bvh_samples import text_of
from tests.motions.rig_samples import WORLDS, along_bones, sample, upright_figure


def test_a_clip_is_explained_in_five_lines_and_drawn(tmp_path, capsys):
    """A clip of a file whose zero pose is no T-pose, in a world with z up."""
    truth = sample("walk", along_bones(upright_figure()), world=WORLDS["z"])
    (tmp_path / "walk.bvh").write_text(text_of(truth.bvh))
    assert main(["explain", str(tmp_path / "walk.bvh"), "-o", str(tmp_path / "walk.png")]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split(":")[0] for line in lines] == ["clip", "joints", "rest pose", "up", "bones"]
    assert "22 of 24, by their names" in lines[1] and "erect in 100 % of the frames; z is up" in lines[3]
    assert "within 0.0 degrees of the source in the mean" in lines[4]
    picture = np.asarray(Image.open(tmp_path / "walk.png").convert("RGB")).astype(int)
    assert picture.shape == (420, 1800, 3)
    blue = (picture[..., 2] - picture[..., 0] > 60).reshape(420, 6, 300).sum(axis=(0, 2))
    assert (blue[::2] > 500).all() and (blue[1::2] < 50).all(), "skeletons stand at the left of each body"


def test_a_clip_without_a_skeleton_has_a_figure(tmp_path, capsys):
    assert main(["explain", "run", "-o", str(tmp_path / "run.png")]) == 0
    assert "a plain figure stands in" in capsys.readouterr().out


def test_what_cannot_be_explained_writes_nothing(tmp_path, capsys):
    assert main(["explain", "run", "-o", str(tmp_path / "run.jpg")]) == 2
    assert main(["explain", str(tmp_path / "absent.bvh"), "-o", str(tmp_path / "a.png")]) == 2
    assert "must end in .png; got '.jpg'" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
