"""Model files that are damaged, hostile or of the wrong kind: one BadModel, before anything runs."""

import json
import pickle

import numpy as np
import pytest

from hemline.animators import load, model_file, shipped_models
from hemline.errors import BadModel, BadOutput
from hemline.files import read_tensors, write_tensors
from tests.contract.made_models import body, ropes_model


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    path = tmp_path_factory.mktemp("models") / "model.safetensors"
    ropes_model().save(path)
    return path


def changed(model, path, arrays=(), metadata=()):
    """The model's file with some entries replaced; None removes one."""
    old_arrays, old_metadata = read_tensors(model, "model")
    new_arrays = {n: a for n, a in (old_arrays | dict(arrays)).items() if a is not None}
    new_metadata = {n: v for n, v in (old_metadata | dict(metadata)).items() if v is not None}
    write_tensors(path, new_arrays, new_metadata)
    return path


# in words, and not asked of a model: laying one out costs ten seconds at the start of every run of any test
PARTS = {
    "garment": "vertices faces rest_edges pin_vertices pin_body_faces pin_barycentric pin_heights",
    "ropes": "offsets lengths masses rest_spans rest_directions chain_joints pairs pair_spans clearances balance "
    "rest_tensions corners barycentric carriage_rest carriage_weights carriage_nearest carriage_nearest_rest rest "
    "betas proxy_kinds proxy_joints proxy_shapes proxy_pivots",
    "skinning_basis": "digits scales modes",
    "shape_basis": "digits scales modes",
    "skinning": "weight0 weight1 weight2 bias0 bias1 bias2",
    "shape": "weight0 weight1 weight2 bias0 bias1 bias2",
    "correction": "modes matrix outputs low high swing_gain",
}
OPTIONAL = {"correction.swing_gain"}
EVERY_ARRAY = ["rest", *(f"{part}.{name}" for part, names in PARTS.items() for name in names.split())]


def test_the_list_of_arrays_is_whole(model):
    assert sorted(read_tensors(model, "model")[0]) == sorted(EVERY_ARRAY)
    made = ropes_model()
    for part, names in PARTS.items():
        assert set(getattr(made, part).arrays()) == set(names.split())


@pytest.mark.parametrize("name", EVERY_ARRAY)
def test_a_missing_array_is_refused_unless_it_may_be_missing(model, tmp_path, name):
    bad = changed(model, tmp_path / "bad.safetensors", {name: None})
    if name in OPTIONAL:
        assert load(bad).name == "ropes"
        return
    with pytest.raises(BadModel, match=rf"{name.split('.')[-1]}"):
        load(bad)


# betas of the mean shape are zeros, and any number of zeros says the same
@pytest.mark.parametrize("name", [name for name in EVERY_ARRAY if name != "ropes.betas"])
def test_an_array_of_another_shape_is_refused(model, tmp_path, name):
    array = read_tensors(model, "model")[0][name]
    for wrong in (array[..., None], array[:0], np.concatenate([array, array])):
        bad = changed(model, tmp_path / "bad.safetensors", {name: wrong})
        with pytest.raises(BadModel):
            load(bad)


# any byte is a digit; faces of the body are checked where the garment is pinned to one, the model holds none
@pytest.mark.parametrize("name", [n for n in EVERY_ARRAY if not n.endswith(("digits", "pin_body_faces"))])
def test_nan_is_refused_and_so_are_indices_that_point_nowhere(model, tmp_path, name):
    array = read_tensors(model, "model")[0][name].copy()
    if array.dtype.kind == "f":
        array.flat[0] = np.nan
    else:
        array.flat[0] = np.iinfo(array.dtype).max
    bad = changed(model, tmp_path / "bad.safetensors", {name: array})
    with pytest.raises(BadModel):
        load(bad)


@pytest.mark.parametrize("name", ["rest", "skinning_basis.digits", "shape.weight1", "skinning_basis.scales"])
def test_an_array_of_another_type_is_refused(model, tmp_path, name):
    array = read_tensors(model, "model")[0][name]
    for wrong in ("float64", "int64", "uint8"):
        bad = changed(model, tmp_path / "bad.safetensors", {name: array.astype(wrong)})
        with pytest.raises(BadModel, match=f"array '{name.split('.')[-1]}' of the model must be .*got {wrong}"):
            load(bad)


@pytest.mark.parametrize("name", ["animator", "body", "config", "figures", "garment", "licences", "ropes"])
def test_missing_or_mistyped_metadata_is_refused(model, tmp_path, name):
    with pytest.raises(BadModel, match=f"lacks metadata '{name}'"):
        load(changed(model, tmp_path / "bad.safetensors", metadata={name: None}))
    with pytest.raises(BadModel, match=f"metadata '{name}' of the model must be"):
        load(changed(model, tmp_path / "bad.safetensors", metadata={name: 7}))


@pytest.mark.parametrize(
    ("metadata", "complaint"),
    [
        ({"animator": "../evil"}, "no such animator; got '../evil'"),
        ({"config": {"epoch": 3}}, r"unknown option 'epoch'; got 3; did you mean 'epochs'\?"),
        ({"config": {"epochs": "many"}}, "'epochs' must be a whole number; got 'many'"),
        ({"body": {"name": "anny24"}}, "lacks metadata 'hash'"),
        ({"figures": {"mm": "low"}}, "figures of the model are numbers"),
        ({"garment": {}}, "the model's garment is damaged"),
        ({"ropes": {"constants": {}}}, "reads version 5 of rope chains; got version 1; fit again with"),
        ({"ropes": {"version": 6}}, "reads version 5 of rope chains; got version 6; upgrade hemline"),
        ({"ropes": {"version": 5, "rope_constants": 3}}, "lacks metadata 'key_joint'"),
        ({"format": 99}, "newer format; got version 99; this hemline reads up to"),
        ({"kind": "take"}, "must be a model file; got a take file"),
    ],
)
def test_contradictions_in_metadata_are_refused(model, tmp_path, metadata, complaint):
    with pytest.raises(BadModel, match=complaint):
        load(changed(model, tmp_path / "bad.safetensors", metadata=metadata))


def test_a_range_from_high_to_low_is_refused(model, tmp_path):
    arrays = read_tensors(model, "model")[0]
    with pytest.raises(BadModel, match="ranges of the bone correction are ordered"):
        load(changed(model, tmp_path / "bad.safetensors", {"correction.low": arrays["correction.high"] + 1}))


def test_a_face_past_the_last_vertex_is_refused(model, tmp_path):
    faces = read_tensors(model, "model")[0]["garment.faces"].copy()
    faces[3, 1] = 300
    with pytest.raises(BadModel, match="300"):
        load(changed(model, tmp_path / "bad.safetensors", {"garment.faces": faces}))


def test_bones_on_vertices_that_are_not_there_are_refused(model, tmp_path):
    arrays = read_tensors(model, "model")[0]
    corners = arrays["ropes.corners"].copy()
    corners[-1, 2] = 300
    with pytest.raises(BadModel, match="a bone lies on a vertex past the garment's last; got 300"):
        load(changed(model, tmp_path / "bad.safetensors", {"ropes.corners": corners}))
    nearest = arrays["ropes.carriage_nearest"].copy()
    nearest[0] = len(body().vertices)
    bad = load(changed(model, tmp_path / "bad.safetensors", {"ropes.carriage_nearest": nearest}))
    with pytest.raises(BadModel, match="a bone hangs on a vertex past the body's last; got 13348"):
        bad.start(body().posed(body().rest_pose))


def test_ropes_and_garment_on_different_shapes_are_refused(model, tmp_path):
    betas = np.ones_like(read_tensors(model, "model")[0]["ropes.betas"])
    with pytest.raises(BadModel, match="on different shapes"):
        load(changed(model, tmp_path / "bad.safetensors", {"ropes.betas": betas}))


def test_truncated_files_are_refused(model, tmp_path):
    content = model.read_bytes()
    bad = tmp_path / "bad.safetensors"
    for length in (0, 4, 8, 100, 1000, len(content) // 2, len(content) - 1):
        bad.write_bytes(content[:length])
        with pytest.raises(BadModel):
            load(bad)


def test_pickles_and_archives_are_never_read(tmp_path):
    bad = tmp_path / "bad.safetensors"
    bad.write_bytes(pickle.dumps({"rest": [1, 2, 3]}))
    with pytest.raises(BadModel, match="a pickle, which is never read"):
        load(bad)
    np.savez(tmp_path / "bad.npz", rest=np.zeros(3))
    with pytest.raises(BadModel, match="zip archive"):
        load(tmp_path / "bad.npz")


def test_absurd_sizes_are_refused_without_taking_memory(model, tmp_path):
    content = model.read_bytes()
    size = int.from_bytes(content[:8], "little")
    header = json.loads(content[8 : 8 + size])
    bad = tmp_path / "bad.safetensors"
    header["rest"]["shape"] = [2**40, 3]
    text = json.dumps(header).encode()
    bad.write_bytes(len(text).to_bytes(8, "little") + text + content[8 + size :])
    with pytest.raises(BadModel, match="damaged"):
        load(bad)
    bad.write_bytes((2**62).to_bytes(8, "little") + content[8:])
    with pytest.raises(BadModel):
        load(bad)


def test_a_missing_file_and_an_unknown_name_are_told_apart(tmp_path, monkeypatch, model):
    with pytest.raises(BadModel, match="cannot read .*none.safetensors; got No such file"):
        load(tmp_path / "none.safetensors")
    (tmp_path / "swirl.safetensors").write_bytes(model.read_bytes())
    monkeypatch.setattr(model_file, "SHIPPED_FOLDER", tmp_path)
    monkeypatch.setattr(model_file, "shipped_models", lambda: shipped_models(tmp_path))
    assert shipped_models(tmp_path) == ["swirl"]
    assert load("swirl").garment.name == "cape"
    with pytest.raises(BadModel, match=r"no shipped model has this name; got 'swril'; did you mean 'swirl'\?"):
        load("swril")
    with pytest.raises(BadModel, match="shipped: swirl"):
        load("xxxxxxxx")


def test_files_of_other_kinds_are_no_shipped_models():
    assert "anny24" not in shipped_models()


def test_an_unwritable_place_is_refused_and_nothing_is_left(tmp_path):
    with pytest.raises(BadOutput, match="cannot write"):
        ropes_model().save(tmp_path / "nowhere" / "model.safetensors")
    assert list(tmp_path.iterdir()) == []
