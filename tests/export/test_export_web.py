"""GLB as the web reads it: valid by Khronos' validator, and moved by three.js in Chromium as it was written."""

from dataclasses import replace

import numpy as np
import pytest

from hemline.export import skin_clip, write
from tests.export.web import three, validated

BONES = 8


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("web")


@pytest.fixture
def written(folder, full_clip):
    """Each way to write GLB: the clip, and the file."""
    clips = {"morphed": full_clip, "skinned": skin_clip(full_clip, BONES), "alone": replace(full_clip, skeleton=None)}
    return [
        (clip, write(folder / f"{name}{'_q' if quantized else ''}.glb", clip, quantized=quantized)[0])
        for name, clip in clips.items()
        for quantized in (False, True)
    ]


def test_the_validator_finds_nothing(written):
    for (_, path), said in zip(written, validated(*(path for _, path in written)), strict=True):
        assert (said["numErrors"], said["numWarnings"], said["messages"]) == (0, 0, []), path.name


def test_three_moves_the_vertices_as_they_moved(written, folder):
    with three(folder) as page:
        for clip, path in written:
            times = [frame / clip.fps for frame in range(clip.frame_count)]
            read = page("playGlb", path.name, times)
            apart = 1000 * np.linalg.norm(read["red_cape"] - clip.vertices, axis=2)
            if clip.skin is None:
                assert apart.max() < 0.1, path.name
            else:
                assert apart.mean() == pytest.approx(clip.skin.mean_error_mm, abs=0.02)
                assert apart.max() == pytest.approx(clip.skin.max_error_mm, abs=0.05)
            if clip.skeleton is None:  # a skinned body has more weights than three.js reads
                assert 1000 * np.linalg.norm(read["body"] - clip.body_vertices, axis=2).max() < 0.1, path.name
