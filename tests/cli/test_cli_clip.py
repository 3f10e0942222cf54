"""The part of a clip that commands play, and the axis that is up in it."""

import numpy as np
import pytest

from hemline import motions
from hemline.cli import main
from hemline.cli.clip import cut
from hemline.errors import BadInput


def test_a_pose_is_a_clip_of_one_frame(tmp_path):
    pose = motions.load("walk")[30:31]
    assert len(cut(pose, 0.0, None)) == 1
    motions.write(tmp_path / "pose.safetensors", pose)
    written = tmp_path / "pose.npz"
    assert main(["animate", "cape", "-m", str(tmp_path / "pose.safetensors"), "-o", str(written)]) == 0
    with np.load(written) as arrays:
        assert [len(array) for name, array in arrays.items() if array.ndim == 3] == [1] * 2


def test_the_last_frame_is_the_last_start():
    walk = motions.load("walk")
    assert len(cut(walk, walk.seconds, None)) == 1
    with pytest.raises(BadInput, match="--start must lie within the clip; got 100 s of"):
        cut(walk, 100.0, None)


@pytest.mark.parametrize("verb", ["animate", "simulate", "drape", "evaluate", "view", "page", "explain"])
def test_every_verb_that_takes_clips_takes_the_axis_that_is_up(verb, capsys):
    with pytest.raises(SystemExit):
        main([verb, "--help"])
    assert "--up {None,x,y,z,-x,-y,-z}" in capsys.readouterr().out
