"""`skinned`: what skinning alone must do, its files, and what it refuses."""

from pathlib import Path

import numpy as np
import pytest

import hemline
from hemline import animators, garments, motions
from hemline.animators.skinned import KIND, Skinned, SkinnedConfig
from hemline.cli.main import main
from hemline.errors import BadInput, BadModel
from hemline.files import read_tensors, write_tensors
from hemline.files.tensors import tensor_bytes
from hemline.meshes import edge_strains
from hemline.models.make.terms import add_terms, read_contents
from hemline.playback import evaluate
from tests.animators import made_coarse as made

DT = 1 / 30


@pytest.fixture(scope="module")
def leggings():
    return Skinned().animator_for(garments.load("trousers-light"), made.body())


@pytest.fixture(scope="module")
def posed():
    run = made.body().placed(motions.load("run"))
    return [made.body().posed(run[index]) for index in range(0, 30, 5)]


def vertices_of(animator, posed):
    return animator.step(animator.start(posed), posed, DT)[1]


def test_in_the_rest_pose_it_is_the_settled_garment(leggings):
    """The proxy settled itself, and the garment's vertices at those of the proxy are where these came to rest."""
    _, ids = leggings.coarse
    at_rest = vertices_of(leggings, made.body().posed(made.body().rest_pose))
    np.testing.assert_allclose(at_rest[ids], leggings.rest, atol=1e-4)
    assert np.linalg.norm(leggings.rest - leggings.garment.vertices[ids], axis=1).max() > 1e-3  # it did settle


def test_each_vertex_is_the_weighted_mean_of_where_joints_take_it(leggings, posed):
    """A second route: the homogeneous transforms of the joints, dense weights, in float64."""
    on_body = leggings._on(made.body())
    dense, rest = on_body.skin.dense().astype(np.float64), on_body.rest.astype(np.float64)
    for each in posed:
        moved = np.einsum("jab,vb->vja", each.transforms.astype(np.float64), np.c_[rest, np.ones(len(rest))])
        np.testing.assert_allclose(vertices_of(leggings, each), np.einsum("vj,vja->va", dense, moved), atol=2e-5)


def test_a_frame_depends_on_its_pose_alone(leggings, posed):
    forth, state = [], leggings.start(posed[0])
    for each in posed:
        state, vertices = leggings.step(state, each, DT)
        forth.append(vertices)
    back = [leggings.step(state, each, 0.2)[1] for each in reversed(posed)][::-1]
    np.testing.assert_array_equal(forth, back)


def test_close_cloth_keeps_its_lengths_and_bends_with_the_knee(leggings, posed):
    """Trousers stay near the skin in a run; carried rigidly with the pelvis they would be far from the legs."""
    garment = leggings.garment
    for each in posed:
        vertices = vertices_of(leggings, each)
        assert np.percentile(edge_strains(vertices, garment.faces, garment.rest_edges), 95) < 0.3
        below = vertices[:, 1] < each.joints[4:6, 1].min() + 0.1  # near the knees and below
        shins = each.joints[[4, 5, 7, 8]]
        nearest = np.linalg.norm(vertices[below, None] - shins[None], axis=2).min(axis=1)
        assert nearest.max() < 0.35


def test_the_player_puts_nothing_of_it_inside_the_body(leggings):
    figures = evaluate(leggings, made.body(), motions.load("kick")[:20]).figures
    assert figures["inside_percent"]["after"] == 0
    assert figures["frame_ms"]["stages"]["animator"] < 2.0


def test_it_settles_anew_on_another_shape():
    shaped = made.body().body.shaped([1.5, -1.0])
    animator = Skinned(SkinnedConfig(fewest=150, most=200)).animator_for(made.live_cape().garment, made.body())
    at_rest = vertices_of(animator, shaped.posed(shaped.rest_pose))
    on_mean = vertices_of(animator, made.body().posed(made.body().rest_pose))
    assert at_rest[:, 1].max() - on_mean[:, 1].max() == pytest.approx(
        shaped.joints[12, 1] - made.body().joints[12, 1], abs=0.03
    )


def test_the_shipped_file_is_made_by_its_command(tmp_path):
    skinned = hemline.load("skinned")
    assert isinstance(skinned, animators.Wearable) and skinned == Skinned()
    skinned.save(tmp_path / "skinned.safetensors")
    arrays, metadata = read_contents(tmp_path / "skinned.safetensors")
    made_now = tensor_bytes(arrays, add_terms("skinned", metadata))
    assert made_now == animators.model_path("skinned").read_bytes(), "python -m hemline.models.make.terms --unfitted"


def test_a_fit_is_refused():
    with pytest.raises(BadInput, match=r"'skinned' learns nothing; got a fit; play it: hemline animate skinned"):
        KIND.fit(None)


@pytest.mark.parametrize(
    ("metadata", "complaint"),
    [
        ({"skinned": None}, "lacks metadata 'skinned'"),
        ({"skinned": {"version": 2}}, "reads version 1 of skinned garments; got version 2"),
        ({"config": {"edge": -1.0, "fewest": 500, "most": 1500}}, "option 'edge' must be positive"),
    ],
)
def test_damaged_files_are_refused(tmp_path, leggings, metadata, complaint):
    path = tmp_path / "leggings.safetensors"
    leggings.save(path)
    arrays, before = read_tensors(path, "model")
    write_tensors(path, arrays, {key: value for key, value in (before | metadata).items() if value is not None})
    with pytest.raises(BadModel, match=complaint):
        hemline.load(path)


def test_the_page_on_formats_names_what_its_file_holds(tmp_path, leggings):
    leggings.save(tmp_path / "leggings.safetensors")
    text = (Path(__file__).parents[3] / "docs" / "format.md").read_text().split("### `skinned`")[1].split("\n### ")[0]
    arrays, metadata = read_tensors(tmp_path / "leggings.safetensors", "model")
    assert [name for name in arrays if not name.startswith("garment.")] == ["rest"] and "| `rest` | f32 [C 3] |" in text
    assert metadata["skinned"] == {"version": 1} and "JSON `skinned`, which contains `version` (1" in text


def test_a_saved_garment_plays_to_the_same_bits(tmp_path, leggings, posed):
    leggings.save(tmp_path / "leggings.safetensors")
    again = hemline.load(tmp_path / "leggings.safetensors")
    np.testing.assert_array_equal(vertices_of(again, posed[2]), vertices_of(leggings, posed[2]))
    assert again.config == leggings.config


def test_the_command_plays_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    made.live_cape().garment.save("cape.safetensors")
    short = ["--garment", "cape.safetensors", "-m", "run", "--seconds", "0.1"]
    assert main(["animate", "skinned", *short, "-o", "cape.npz"]) == 0
    assert np.load("cape.npz")["vertices"].shape == (4, len(made.live_cape().garment.vertices), 3)
