"""What a clip may hold, and which path may be written."""

import re
from dataclasses import replace

import numpy as np
import pytest

from hemline.errors import BadInput, BadOutput
from hemline.export import FORMATS, Clip, check_format, write


def test_arrays_that_contradict_each_other_are_refused(full_clip):
    clip = full_clip
    with pytest.raises(BadInput, match="fps must be positive; got 0"):
        replace(clip, fps=0)
    with pytest.raises(BadInput, match="a body needs vertices and faces; got only one"):
        replace(clip, body_faces=None)
    with pytest.raises(BadInput, match=r"'red cape' needs vertices \(frames, verts, 3\); got \(99, 3\)"):
        replace(clip, vertices=clip.vertices[0])
    with pytest.raises(BadInput, match=r"needs vertices \(frames, verts, 3\); got \(0, 99, 3\)"):
        replace(clip, vertices=clip.vertices[:0])
    with pytest.raises(BadInput, match=r"'red cape' needs faces \(faces, 3\); got \(0, 3\)"):
        replace(clip, faces=clip.faces[:0])
    with pytest.raises(BadInput, match="a face points past the last vertex; got indices 0 to 99 for 99 vertices"):
        replace(clip, faces=np.array([[0, 1, 99]], np.int32))
    with pytest.raises(BadInput, match="'body': a face points past the last vertex; got indices -1"):
        replace(clip, body_faces=np.array([[0, 1, -1]], np.int32))
    with pytest.raises(BadInput, match="same number of frames; got 6 and 7"):
        replace(clip, vertices=clip.vertices[:6])
    with pytest.raises(BadInput, match=r"a skeleton must fit its body of \(frames, verts\) \(7, \d+\)"):
        replace(clip, skeleton=replace(clip.skeleton, transforms=clip.skeleton.transforms[:3]))
    spoiled = clip.vertices.copy()
    spoiled[4, 2, 1] = np.nan
    with pytest.raises(BadInput, match="'red cape': vertices must be finite; got NaN or infinity in frame 4"):
        replace(clip, vertices=spoiled)


def test_an_unknown_ending_names_all_known_ones(tmp_path, cloth_clip):
    for name in ("cape.fbx", "cape"):
        with pytest.raises(BadOutput, match=r"cannot write .*cape.*choose one of " + re.escape(" ".join(FORMATS))):
            write(tmp_path / name, cloth_clip)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("ending", FORMATS)
def test_a_folder_that_is_not_there_is_refused_before_any_work(tmp_path, cloth_clip, ending):
    (tmp_path / "file").write_text("no folder")
    for folder in ("none", "file"):
        with pytest.raises(BadOutput, match="name a folder that exists"):
            write(tmp_path / folder / f"cape{ending}", cloth_clip)
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_a_folder_of_the_files_name_is_refused(tmp_path, cloth_clip):
    (tmp_path / "cape.glb").mkdir()
    with pytest.raises(BadOutput, match="got a folder of that name"):
        check_format(tmp_path / "cape.glb")
    (tmp_path / "cape_0003.obj").mkdir()
    with pytest.raises(BadOutput, match="cape_0003.obj; got a folder of that name"):
        write(tmp_path / "cape.obj", cloth_clip)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["cape.glb", "cape_0003.obj"]


@pytest.mark.parametrize("ending", [ending for ending in FORMATS if ending != ".webp"])
def test_equal_clips_give_equal_bytes_and_endings_may_be_capitals(tmp_path, full_clip, ending):
    first = write(tmp_path / f"a{ending}", full_clip, size=(48, 48))
    second = write(tmp_path / f"b{ending.upper()}", full_clip, size=(48, 48))
    assert [path.read_bytes() for path in first] == [path.read_bytes() for path in second]
    assert sorted(tmp_path.iterdir()) == sorted({*first, *second})


def test_other_layouts_of_memory_are_written_alike(tmp_path, cloth_clip):
    turned = Clip(
        np.asfortranarray(cloth_clip.vertices.astype(np.float64)), cloth_clip.faces.astype(np.int64), 24.0, name="cape"
    )
    for ending in (".npz", ".glb", ".pc2", ".mdd", ".obj"):
        ours = [path.read_bytes() for path in write(tmp_path / f"a{ending}", cloth_clip)]
        assert ours == [path.read_bytes() for path in write(tmp_path / f"b{ending}", turned)]
