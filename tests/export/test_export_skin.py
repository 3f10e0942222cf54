"""Garments as skinned meshes: bones that fit, errors that are told, weights that engines take."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from hemline.errors import BadInput
from hemline.export import skin_clip, write
from hemline.export.glb.glb_quantized import QuantizedGrid, normal_differences, quantized_weights


def played(skeleton):
    """Linear blend skinning by the skeleton's own words."""
    points = np.concatenate([skeleton.vertices, np.ones((len(skeleton.vertices), 1))], axis=1)
    moved = np.einsum("fvkrc,vc->fvkr", skeleton.transforms[:, skeleton.weight_indices], points)
    return np.einsum("vk,fvkr->fvr", skeleton.weights, moved)


def test_a_skin_moves_the_garment_within_the_error_that_it_tells(full_clip):
    skin = skin_clip(full_clip, 8).skin
    apart = 1000 * np.linalg.norm(played(skin.skeleton) - full_clip.vertices, axis=2)
    assert skin.mean_error_mm == pytest.approx(apart.mean(), rel=0.01)
    assert skin.max_error_mm == pytest.approx(apart.max(), rel=0.01)
    assert skin.bone_count == 8 and skin.mean_error_mm < 5
    assert skin.skeleton.weights.shape[1] == 4
    assert_allclose(skin.skeleton.weights.sum(axis=1), 1, atol=1e-6)


def test_more_bones_fit_better_and_the_body_is_left_as_it_was(full_clip):
    few, many = (skin_clip(full_clip, bones) for bones in (2, 12))
    assert many.skin.mean_error_mm < 0.6 * few.skin.mean_error_mm
    assert many.skeleton is full_clip.skeleton and many.vertices is full_clip.vertices


def test_a_stiff_garment_is_exact_with_one_bone_and_a_still_one_too(full_clip):
    stiff = np.einsum("fij,vj->fvi", full_clip.skeleton.transforms[:, 1, :, :3], full_clip.vertices[0])
    for vertices in (stiff.astype(np.float32), full_clip.vertices[:1]):
        clip = replace(full_clip, vertices=vertices, body_vertices=None, body_faces=None, skeleton=None)
        assert skin_clip(clip, 1).skin.max_error_mm < 0.01


@pytest.mark.parametrize(("bones", "said"), [(0, "1 to 256 bones"), (257, "1 to 256 bones"), (40, "for each bone")])
def test_bones_that_cannot_be_are_refused(full_clip, bones, said):
    with pytest.raises(BadInput, match=said):
        skin_clip(full_clip, bones)


def test_formats_that_cannot_hold_it_are_refused(tmp_path, full_clip):
    with pytest.raises(BadInput, match=r"the format holds no skinned garment; got a.pc2; choose one of .glb .usdc"):
        write(tmp_path / "a.pc2", skin_clip(full_clip, 4))
    with pytest.raises(BadInput, match=r"the format cannot be quantised; got a.usdc; choose .glb"):
        write(tmp_path / "a.usdc", full_clip, quantized=True)
    skin = skin_clip(full_clip, 4).skin
    short = replace(skin.skeleton, transforms=skin.skeleton.transforms[:2])
    with pytest.raises(BadInput, match=r"must fit its garment of \(frames, verts\) \(7, 99\); got \(2, 99\)"):
        replace(full_clip, skin=replace(skin, skeleton=short))
    assert not list(tmp_path.iterdir())


def test_a_skinned_clip_is_small_and_quantised_smaller(tmp_path, full_clip):
    alone = replace(full_clip, body_vertices=None, body_faces=None, skeleton=None)
    long = replace(alone, vertices=np.tile(full_clip.vertices, (20, 1, 1)))
    sizes = [
        write(tmp_path / f"{name}.glb", clip, quantized=quantized)[0].stat().st_size
        for name, clip, quantized in (("a", long, False), ("b", long, True), ("c", skin_clip(long, 4), True))
    ]
    assert sizes[1] < 0.7 * sizes[0] and sizes[2] < 0.2 * sizes[1]


def test_grids_hold_points_within_half_a_step():
    points = np.random.default_rng(0).uniform(-1, 1, (200, 3)) * [2, 1, 0.5] + [5, 0, 0]
    grid = QuantizedGrid.around(points)
    assert_allclose(grid.middle + grid.scale * grid.numbers(points) / 32767, points, atol=0.51 * grid.scale / 32767)
    assert np.abs(grid.numbers(points)).max() <= 32767


def test_weights_in_two_bytes_keep_their_sum():
    numbers = quantized_weights(np.random.default_rng(1).dirichlet(np.ones(4), 500))
    assert (numbers.sum(axis=1, dtype=np.int64) == 65535).all()


def test_normals_are_turned_by_numbers_of_a_byte():
    normals, others = np.random.default_rng(2).normal(size=(2, 500, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    others /= np.linalg.norm(others, axis=1, keepdims=True)
    change = normal_differences(normals, others)
    made = normals + change
    fits = np.abs(change).max(axis=1) <= 1 + 1e-9
    assert fits.mean() > 0.99
    assert_allclose((made / np.linalg.norm(made, axis=1, keepdims=True))[fits], others[fits], atol=1e-6)
