"""A garment holds together, and comes back from disk as it was."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hemline import garments
from hemline.errors import BadGarment, BadOutput
from hemline.files import write_tensors
from hemline.garments import Garment, Pins


def test_arrays_have_their_own_types(small):
    types = {name: array.dtype.name for name, array in small.arrays().items()}
    assert types == {
        "vertices": "float32",
        "faces": "int32",
        "rest_edges": "float64",
        "pin_vertices": "int32",
        "pin_body_faces": "int32",
        "pin_barycentric": "float32",
        "pin_heights": "float32",
    }
    assert all(array.flags.c_contiguous for array in small.arrays().values())


def test_comes_back_from_disk_as_it_was(small, tmp_path):
    small.save(tmp_path / "a.safetensors")
    garments.write(tmp_path / "b.safetensors", small)
    assert (tmp_path / "a.safetensors").read_bytes() == (tmp_path / "b.safetensors").read_bytes()
    again = Garment.load(tmp_path / "a.safetensors")
    assert again.metadata() == small.metadata() and again.hash == small.hash
    for name, array in small.arrays().items():
        np.testing.assert_array_equal(again.arrays()[name], array)


def test_hash_knows_all_but_name_and_notes(small, patch):
    assert replace(small, name="other", notes=("guessed",)).hash == small.hash
    moved = patch["vertices"].copy()
    moved[0, 0] += 1e-6
    changes = [
        {"vertices": moved},
        {"chains": ()},
        {"key_joint": "pelvis"},
        {"flat_rest": False},
        {"body_betas": np.ones(3)},
        {"material": garments.MATERIALS["wool"]},
        {"rest_edges": patch["rest_edges"] * 1.01},
        {"pins": replace(patch["pins"], heights=np.array([0.005], np.float32))},
    ]
    hashes = {replace(small, **change).hash for change in changes}
    assert len(hashes) == len(changes) and small.hash not in hashes


def pins_of(**changes):
    base = {
        "vertices": np.array([2]),
        "body_faces": np.array([7]),
        "barycentric": np.ones((1, 3)) / 3,
        "heights": np.zeros(1),
    }
    return {"pins": Pins(**(base | changes))}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"vertices": np.zeros((4, 2))}, r"vertices must have the shape \(any, 3\); got \(4, 2\)"),
        ({"vertices": np.full((4, 3), np.nan)}, "vertices must be finite"),
        ({"vertices": np.full((4, 3), "x")}, "vertices must be numbers of the kind float32"),
        ({"faces": np.zeros((2, 3))}, "faces must be numbers of the kind int32"),
        ({"faces": np.zeros((0, 3), int), "rest_edges": np.zeros((0, 2, 2))}, "must have faces"),
        ({"faces": np.array([[0, 1, 4], [0, 2, 3]])}, "faces name a vertex that does not exist; got 4; the mesh has 4"),
        ({"rest_edges": np.ones((1, 2, 2))}, r"rest_edges must have the shape \(2, 2, 2\)"),
        ({"rest_edges": np.ones((2, 2, 2))}, "rest triangles must have an area; got none in face 0"),
        (pins_of(vertices=np.array([4])), "pins name a vertex that does not exist; got 4"),
        (pins_of(vertices=np.array([1, 1])), r"pin body_faces must have the shape \(2\)"),
        (pins_of(heights=np.array([np.inf])), "pin heights must be finite"),
        (pins_of(body_faces=np.array([-1])), "pins name a body face; got -1"),
        ({"chains": ((0, 9),)}, "chain 0 names a vertex that does not exist; got vertex 9; the mesh has 4 vertices"),
        ({"chains": ((0,),)}, "chain 0 must have at least two vertices"),
        ({"chains": ((0, 1), (1, 2))}, "chains must not share vertices; got vertex 1 twice"),
        ({"key_joint": "tail"}, "unknown key joint; got 'tail'"),
    ],
)
def test_refuses_parts_that_contradict_each_other(patch, change, message):
    with pytest.raises(BadGarment, match=message):
        Garment(**(patch | change))


def test_refuses_a_vertex_pinned_twice(patch):
    twice = Pins(np.array([1, 1]), np.array([0, 0]), np.ones((2, 3)) / 3, np.zeros(2))
    with pytest.raises(BadGarment, match="each vertex must be pinned once"):
        Garment(**(patch | {"pins": twice}))


@pytest.mark.parametrize("lost", ["vertices", "rest_edges", "pin_heights"])
def test_refuses_a_file_without_an_array(small, tmp_path, lost):
    arrays = {name: array for name, array in small.arrays().items() if name != lost}
    write_tensors(tmp_path / "a.safetensors", arrays, {"kind": "garment"} | small.metadata())
    with pytest.raises(BadGarment, match=f"no {lost}"):
        Garment.load(tmp_path / "a.safetensors")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"material": None}, "material must be a name or a table"),
        ({"chains": 5}, "readable metadata"),
        ({"body_betas": [10**400]}, "readable metadata"),
        ({"pieces": [3]}, "readable metadata"),
        ({"material": {"base": "cotton", "density": 10**400}}, "density must be a finite number"),
        ({"body_betas": ["a"]}, "readable metadata"),
        ({"key_joint": "knee"}, "unknown key joint"),
    ],
)
def test_refuses_metadata_of_the_wrong_kind(small, change, message):
    with pytest.raises(BadGarment, match=message):
        Garment.of(small.arrays(), small.metadata() | change)


def test_refuses_metadata_without_a_key(small):
    metadata = small.metadata()
    del metadata["flat_rest"]
    with pytest.raises(BadGarment, match="no flat_rest"):
        Garment.of(small.arrays(), metadata)


def test_refuses_truncated_missing_and_foreign_files(small, tmp_path):
    small.save(tmp_path / "a.safetensors")
    (tmp_path / "b.safetensors").write_bytes((tmp_path / "a.safetensors").read_bytes()[:-9])
    with pytest.raises(BadGarment, match="is damaged"):
        Garment.load(tmp_path / "b.safetensors")
    with pytest.raises(BadGarment, match="cannot read"):
        Garment.load(tmp_path / "c.safetensors")
    write_tensors(tmp_path / "d.safetensors", {}, {"kind": "motion"})
    with pytest.raises(BadGarment, match="must be a garment file.*a motion file"):
        Garment.load(tmp_path / "d.safetensors")
    with pytest.raises(BadOutput, match="cannot write"):
        small.save(tmp_path / "nowhere" / "a.safetensors")


def test_by_name_or_by_path(small, tmp_path):
    small.save(tmp_path / "a.safetensors")
    assert garments.read(tmp_path / "a.safetensors").hash == small.hash
    assert garments.names()[:4] == ("cape", "cape-light", "skirt", "skirt-light")
    with pytest.raises(BadGarment, match="unknown garment; got 'cap'; did you mean 'cape'"):
        garments.load("cap")
    for file in ("shirt.obj", Path("folder/shirt.glb")):
        with pytest.raises(BadGarment, match=r"takes the name of a garment .* 'hemline.garments.read'"):
            garments.load(file)


def test_explain_says_what_was_guessed(small):
    text = garments.explain(replace(small, notes=("unit: cm",)))
    assert "patch: 4 vertices, 2 triangles, 0.10 x 0.10 x 0.00 m" in text and text.endswith("- unit: cm")
    assert "material silk, 1 pins, 4.0 to 4.0 mm above the skin, carried by the neck" in text
