"""`hemline explain` on garments and characters: five lines that say what a mesh truly is, and a picture."""

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from hemline import garments
from hemline.bodies.character.is_character import is_character
from hemline.cli import main
from hemline.motions import JOINT_NAMES
from tests.bodies.character_samples import Sample, small_body, write_character


def write_obj(path, parts):
    """Writes named parts as the objects of an OBJ."""
    lines, count = [], 0
    for name, vertices, faces in parts:
        lines += [f"o {name}", *(f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in vertices.tolist())]
        lines += [f"f {a} {b} {c}" for a, b, c in (faces + 1 + count).tolist()]
        count += len(vertices)
    path.write_text("\n".join(lines) + "\n")


@pytest.fixture(scope="module")
def shirt():
    return garments.load("tshirt-light")


def explained(arguments, capsys):
    """Runs the verb; its lines by their first words."""
    assert main(["explain", *map(str, arguments)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 5
    return dict(line.split(": ", 1) for line in lines)


def colours(path):
    """Fractions of red, blue and all pixels of each of the three views."""
    picture = np.asarray(Image.open(path).convert("RGB")).astype(int)
    assert picture.shape == (460, 3 * 340, 3)
    views = picture.reshape(460, 3, 340, 3).transpose(1, 0, 2, 3)
    red, _, blue = views.transpose(3, 0, 1, 2)
    return (red - blue > 60).mean(axis=(1, 2)), (blue - red > 60).mean(axis=(1, 2))


def test_a_mesh_on_the_body_is_explained_and_what_was_left_out_is_blue(tmp_path, capsys, shirt):
    """A shirt in centimetres, with a zip beside it."""
    corners = shirt.vertices.mean(axis=0) + [[0, -0.2, 0.25], [0.1, -0.2, 0.25], [0.1, 0.2, 0.25], [0, 0.2, 0.25]]
    zip_faces = np.array([[0, 1, 2], [0, 2, 3]])
    parts = [("Shirt", 100 * shirt.vertices, shirt.faces), ("Zip", 100 * corners, zip_faces)]
    write_obj(tmp_path / "shirt.obj", parts)
    lines = explained([tmp_path / "shirt.obj", "-o", tmp_path / "shirt.png"], capsys)
    size = " x ".join(f"{side:.2f}" for side in np.ptp(shirt.vertices, axis=0))
    assert lines["garment"].startswith(f"'shirt', 3150 vertices, 6112 triangles, {size} m; in cm, by its size")
    assert "left out: a part 'Zip', by their names" in lines["parts"]
    assert lines["place"].startswith("y is up; on anny24, ") and "worn as it lies" in lines["place"]
    assert lines["openings"].startswith("4 (") and "neck" in lines["openings"] and "no limb" not in lines["openings"]
    assert lines["openings"].endswith("key joint: pelvis, as nothing is pinned")
    assert lines["cloth"].startswith("cotton, as no material was named; rest shape: ")
    red, blue = colours(tmp_path / "shirt.png")
    assert (red > 0.02).all() and (blue[[0, 2]] > 0.001).all()


def test_parts_are_named(tmp_path, capsys, shirt):
    """One of two garments beside each other, which together are refused."""
    both = [("Shirt", shirt.vertices, shirt.faces), ("Other", 0.8 * shirt.vertices + [1.5, 0, 0], shirt.faces)]
    write_obj(tmp_path / "two.obj", both)
    assert main(["explain", str(tmp_path / "two.obj"), "-o", str(tmp_path / "two.png")]) == 2
    assert "2 garments beside each other" in capsys.readouterr().err and not (tmp_path / "two.png").exists()
    lines = explained([f"{tmp_path}/two.obj:Shirt", "-o", tmp_path / "two.png"], capsys)
    assert "3150 vertices" in lines["garment"]


@pytest.mark.parametrize("up", ["y", "z"])
def test_the_up_axis_of_a_mesh_elsewhere_is_found(tmp_path, capsys, shirt, up):
    placed = shirt.vertices if up == "y" else shirt.vertices[:, [0, 2, 1]] * (1, -1, 1)
    write_obj(tmp_path / "shirt.obj", [("", placed + (3, 1, 0.5), shirt.faces)])
    lines = explained([tmp_path / "shirt.obj", "-o", tmp_path / "shirt.png"], capsys)
    assert "not on the body" in lines["place"] and f"; {up} is up, as it fits the body best so" in lines["place"]
    assert lines["openings"].count(" m") == 4 and "chosen once it is on the body" in lines["openings"]
    red, blue = colours(tmp_path / "shirt.png")
    assert red[2] < 0.3 * red[0], "the shirt stands beside the body, both in one view"
    assert not blue.any()


def test_an_inside_out_mesh_is_said_to_be_turned(tmp_path, capsys, shirt):
    write_obj(tmp_path / "shirt.obj", [("", shirt.vertices, shirt.faces[:, ::-1])])
    lines = explained([tmp_path / "shirt.obj", "-o", tmp_path / "shirt.png"], capsys)
    assert "all triangles were turned to face away from the body" in lines["place"]


def test_garments_by_name_and_own_files_are_explained(tmp_path, capsys, shirt):
    cape = explained(["cape-light", "-o", tmp_path / "cape.png"], capsys)
    count = len(garments.load("cape-light").pins)
    assert cape["openings"].startswith(f"none; pins: {count}, carried by the neck")
    shirt.save(tmp_path / "shirt.safetensors")
    own = explained([tmp_path / "shirt.safetensors", "-o", tmp_path / "shirt.png"], capsys)
    assert "3150 vertices" in own["garment"] and own["openings"].startswith("4 (")


def test_a_character_is_explained(tmp_path, capsys):
    """A body keeps the height, and the angle of its arms, of the body that it was made of."""
    path = write_character(tmp_path / "me.glb", Sample(z_up=True, scale=100.0, extra=1))
    lines = explained([path, "-o", tmp_path / "me.png"], capsys)
    body = small_body()
    assert f"{np.ptp(body.template[:, 1]):.2f} m tall" in lines["character"] and "cm" in lines["character"]
    assert "24 of them ours" in lines["skeleton"] and "turned to y up" in lines["skeleton"]
    shoulder, wrist = (body.joints[JOINT_NAMES.index(f"left_{name}")] for name in ("shoulder", "wrist"))
    angle = np.degrees(np.arcsin((shoulder - wrist)[1] / np.linalg.norm(shoulder - wrist)))
    assert f"arms {angle:.0f} degrees below the horizontal" in lines["rest pose"]
    assert "cloth lies on its own skin" in lines["surface"] and "no animations" in lines["meshes"]
    _, blue = colours(tmp_path / "me.png")
    assert blue[2] > 0.005 and blue[:2].max() < 0.001, "the joints are drawn in the third view"


@pytest.mark.parametrize("turn, kind", [(0.0, "character"), (0.4, "clip")])
def test_a_character_in_whose_animation_nothing_moves_is_no_clip(tmp_path, capsys, turn, kind):
    turns = np.tile([1.0, 0, 0, 0], (4, 24, 1))
    turns[2, JOINT_NAMES.index("left_elbow")] = [np.cos(turn / 2), np.sin(turn / 2), 0, 0]
    path = write_character(tmp_path / "me.glb", Sample(clips={"idle": (np.arange(4) / 30, turns)}))
    assert kind in explained([path, "-o", tmp_path / "me.png"], capsys)


def test_a_garment_with_the_bones_of_its_character_is_no_character(tmp_path):
    """Trunk, arms to the wrist and legs to the ankle of the same rig: what a suit has."""
    body = small_body()
    strongest = np.take_along_axis(body.weight_indices, body.weights.argmax(axis=1)[:, None], axis=1)[:, 0]
    ends = [
        JOINT_NAMES.index(name) for name in JOINT_NAMES if name.endswith(("head", "wrist", "hand", "ankle", "foot"))
    ]
    suit = body.faces[~np.isin(strongest, ends)[body.faces].any(axis=1)]
    assert is_character(write_character(tmp_path / "me.glb", Sample()))
    assert not is_character(write_character(tmp_path / "suit.glb", Sample(body=replace(body, faces=suit))))


def test_up_is_for_clips(tmp_path, capsys, shirt):
    write_obj(tmp_path / "shirt.obj", [("", shirt.vertices, shirt.faces)])
    assert main(["explain", str(tmp_path / "shirt.obj"), "--up", "z", "-o", str(tmp_path / "a.png")]) == 2
    assert "--up is for clips; got a garment" in capsys.readouterr().err and not (tmp_path / "a.png").exists()
