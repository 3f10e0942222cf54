"""Clothes of unknown origin, worn or refused."""

from dataclasses import replace

import numpy as np
import pytest

from hemline import garments
from hemline.bodies import skin_points
from hemline.cli.main import main
from hemline.errors import BadGarment
from hemline.garments.clearance import smooth_field
from hemline.garments.dressing import body_tree
from hemline.garments.shoulders import rests_on_shoulders
from hemline.meshes import ClosestTree
from hemline.tryon import fitness, try_on
from hemline.tryon.alignment import align, pose_from_angles
from hemline.tryon.fitness import unwearable_reason


def posed_with(garment, shaped, angles):
    """The garment as it would have been modelled on that body in another pose."""
    closest = body_tree(shaped).closest(garment.vertices)
    posed = shaped.posed(pose_from_angles(shaped, angles))
    body = shaped.body
    corner = body.faces[closest.faces]
    moved = np.zeros((len(corner), 3))
    for c in range(3):
        at = skin_points(
            posed.transforms, body.weight_indices[corner[:, c]], body.weights[corner[:, c]], garment.vertices
        )
        moved += closest.weights[:, [c]] * at
    # smooth, as the nearest points jump where arm and trunk are near to each other
    field = smooth_field(moved - garment.vertices, garment.faces, np.ones(len(moved)), 5.0)
    return garment.vertices + field


def apart(one, other):
    """Mean distance of vertices of one from the surface of the other [m]."""
    return float(ClosestTree(other.vertices.astype(float), other.faces).closest(one.vertices).distances.mean())


def test_a_shirt_in_centimetres_on_the_floor_is_worn_where_it_was(shaped, worn, as_obj):
    shirt = worn["tshirt"]
    floor = float(shaped.vertices[:, 1].min())
    tried = try_on(as_obj("shirt", 100 * (shirt.vertices - (0, floor, 0)), shirt.faces), shaped)
    assert tried.fitness.reason is None and tried.fitness.figures["inside"] == 0
    assert apart(tried.garment, shirt) < 0.015 and abs(tried.alignment.scale - 1) < 0.05
    notes = " ".join(tried.garment.notes)
    assert "cm and were converted" in notes and "pins: none, as the shoulders carry it" in notes
    assert len(tried.garment.pins) == 0 and np.array_equal(tried.garment.body_betas, shaped.betas)


def test_trousers_keep_pins_at_their_waist(shaped, worn, as_obj):
    trousers = worn["trousers"]
    tried = try_on(as_obj("trousers", trousers.vertices + (0, 0.03, 0.02), trousers.faces), shaped)
    assert tried.fitness.reason is None
    assert 40 < len(tried.garment.pins) < 70 and tried.garment.vertices[tried.garment.pins.vertices, 1].min() > 0


@pytest.mark.slow
def test_a_shirt_made_in_t_pose_is_put_on_in_t_pose(shaped, worn, as_obj):
    shirt = worn["tshirt"]
    modelled = posed_with(shirt, shaped, (0.75, 0, 0, 0))
    path = as_obj("t_pose", modelled, shirt.faces)
    tried = try_on(path, shaped)
    assert tried.fitness.reason is None and tried.alignment.angles[0] > 0.35
    assert any(note.startswith("pose: put on with arms turned up by") for note in tried.garment.notes)
    assert apart(tried.garment, shirt) < 0.025


def without_pins(path):
    """A TOML beside a mesh that pins nothing."""
    toml = path.with_suffix(".toml")
    toml.write_text(f'mesh = "{path.name}"\npins = "none"\norigin = "pelvis"\n')
    return toml


def test_a_garment_whose_origin_is_its_own_middle_is_found(shaped, worn, as_obj):
    shirt = worn["tshirt"]
    middle = 0.5 * (shirt.vertices.min(axis=0) + shirt.vertices.max(axis=0))
    alignment = align((shirt.vertices - middle + (3, 5, -2)).astype(float), shirt.faces, shaped)
    assert np.linalg.norm(alignment.vertices - shirt.vertices, axis=1).mean() < 0.05
    assert alignment.through == () and alignment.empty == 0 and alignment.rims == 4


def test_a_childs_shirt_is_scaled_aloud(shaped, worn, as_obj):
    shirt = worn["tshirt"]
    path = as_obj("child", 0.72 * shirt.vertices + (0, 0.1, 0), shirt.faces)
    tried = try_on(path, shaped)
    assert tried.fitness.reason is None and 1.2 < tried.alignment.scale < 1.45
    assert any(note.startswith("size: +") for note in tried.garment.notes)


@pytest.mark.slow
def test_a_wide_tube_without_pins_falls(shaped, as_obj):
    around, rows = 60, 20
    angle, height = np.meshgrid(2 * np.pi * np.arange(around) / around, np.linspace(0.1, -0.3, rows))
    vertices = np.stack([0.3 * np.sin(angle), height, 0.3 * np.cos(angle)], axis=-1).reshape(-1, 3)
    index = np.arange(rows * around).reshape(rows, around)
    a, b = index[:-1], np.roll(index[:-1], -1, axis=1)
    c, d = np.roll(index[1:], -1, axis=1), index[1:]
    faces = np.concatenate([np.stack([each.ravel() for each in three], 1) for three in ((a, d, c), (a, c, b))])
    path = as_obj("tube", vertices, faces.astype(np.int32))
    reason = try_on(without_pins(path), shaped).fitness.reason
    assert reason is not None and reason.startswith("nothing holds it up: it fell by")


def test_what_lies_on_the_shoulders(shaped, worn):
    assert rests_on_shoulders(worn["tshirt"].vertices, shaped) and not rests_on_shoulders(
        worn["trousers"].vertices, shaped
    )


def test_what_is_far_too_small_is_refused_before_it_is_settled(shaped, worn):
    shirt = worn["tshirt"]
    found = fitness(replace(shirt, rest_edges=0.75 * shirt.rest_edges), shaped)
    assert found.reason is not None and found.rest is None and found.figures == {}
    assert found.reason.startswith("it is too small: the median edge is off its length by")


def test_one_edge_that_is_far_too_long_is_a_rent(shaped, worn):
    shirt = worn["tshirt"]
    figures = fitness(shirt, shaped).figures
    assert unwearable_reason(shirt, shaped, shirt.vertices, figures) is None
    torn = unwearable_reason(shirt, shaped, shirt.vertices, figures | {"edge_strain_max": 7.0})
    assert torn == "it is torn: an edge is 8.0 times as long as it should be"


@pytest.mark.parametrize(("percent", "worn_so"), [(0.3, True), (1.9, True), (2.1, False)])
def test_a_few_edges_through_the_cloth_do_not_prevent_a_garment_from_being_worn(shaped, worn, percent, worn_so):
    shirt = worn["tshirt"]
    figures = fitness(shirt, shaped).figures | {"self_crossing_percent": percent}
    reason = unwearable_reason(shirt, shaped, shirt.vertices, figures)
    assert (reason is None) == worn_so and (worn_so or f"it is tangled: {percent:.2f} %" in reason)


@pytest.mark.slow
@pytest.mark.data
def test_overalls_whose_sleeves_go_through_themselves_at_the_wrists_are_worn_with_a_warning(shaped, mesh_of):
    found = try_on(mesh_of("makehuman_cc0/hoodie_jeans_onepiece.obj"), shaped).fitness
    assert found.reason is None and found.tangled and 0.5 < found.figures["self_crossing_percent"] < 2
    assert any("go through its own cloth" in warning for warning in found.warnings)


@pytest.mark.slow
def test_wide_trousers_are_not_too_small(shaped, worn):
    # cut a fifth wider than they lie: every edge starts shortened by 17 %
    wide = replace(worn["trousers"], rest_edges=1.2 * worn["trousers"].rest_edges)
    reason = fitness(wide, shaped).reason
    assert reason is None or "too small" not in reason


@pytest.mark.slow
@pytest.mark.data
@pytest.mark.parametrize("name", ["garmentcode_mit/dress_mean_all.obj", "style3d_bsd3/sweatshirt_12k.obj"])
def test_meshes_of_other_makers_are_worn(shaped, mesh_of, name):
    tried = try_on(mesh_of(name), shaped)
    assert tried.fitness.reason is None and tried.alignment.through == ()
    assert tried.fitness.figures["edge_strain_p99"] < 0.15 and tried.fitness.figures["self_crossing_percent"] < 0.1


def test_the_command_writes_a_garment_that_can_be_simulated(shaped, worn, as_obj, tmp_path, capsys):
    trousers = worn["trousers"]
    path, output = as_obj("trousers", 10 * trousers.vertices, trousers.faces), tmp_path / "mine.safetensors"
    assert main(["tryon", str(path), "-o", str(output), "--picture", str(tmp_path / "mine.png")]) == 0
    out = capsys.readouterr()
    assert "worn: edge_strain_p50" in out.out and "so they are dm" in out.err
    assert (tmp_path / "mine.png").stat().st_size > 10_000
    assert garments.read(output, shaped).hash == garments.Garment.load(output).hash


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["-o", "shirt.obj"], "must end in .safetensors"),
        (["-o", "a.safetensors", "--picture", "a.jpg"], "must end in .png"),
        (["-o", "nowhere/a.safetensors"], "nowhere"),
    ],
)
def test_the_command_refuses_outputs_before_any_work(words, said, capsys):
    assert main(["tryon", "no_such.obj", *words]) == 2
    assert said in capsys.readouterr().err


def test_the_command_writes_nothing_for_what_cannot_be_worn(worn, as_obj, tmp_path, capsys):
    shirt = worn["tshirt"]
    path = as_obj("tiny", 0.5 * shirt.vertices + (0, 0.2, 0), shirt.faces)
    output = tmp_path / "tiny.safetensors"
    assert main(["tryon", str(path), "-o", str(output), "--no-scaled"]) == 1
    said = capsys.readouterr().err
    assert "cannot be worn: " in said and ("too small" in said or "opening" in said) and not output.exists()


def test_a_garment_that_lies_on_the_body_is_only_judged(shaped, worn, tmp_path):
    path = tmp_path / "own.safetensors"
    worn["trousers"].save(path)
    tried = try_on(path, shaped)
    assert tried.fitness.reason is None and tried.alignment is None and tried.growth is None
    assert np.array_equal(tried.garment.vertices, worn["trousers"].vertices)


def test_a_garment_is_judged_on_this_shape_and_written_on_that_which_it_was_made_on(shaped, worn, tmp_path, capsys):
    # dressed, saved and dressed again it would not be the same garment
    path, output = tmp_path / "trousers.safetensors", tmp_path / "tall.safetensors"
    worn["trousers"].save(path)
    assert main(["tryon", str(path), "-o", str(output), "--betas", "0.5"]) == 0
    said = capsys.readouterr()
    assert "worn: " in said.out and "give the same --betas to what simulates it" in said.err
    assert np.array_equal(garments.read(output).vertices, worn["trousers"].vertices)
    taller = shaped.body.shaped((0.5,))
    tried = try_on(path, taller)
    assert np.array_equal(tried.fitness.rest.betas, taller.betas), "but judged on this one"


def test_clothes_with_bindings_lie_where_they_say(shaped, mesh_of):
    path = mesh_of("makehuman_cc0/mhclo/skirthelper.mhclo")
    tried = try_on(path, shaped)
    assert tried.fitness.reason is None and tried.alignment is None
    assert np.array_equal(tried.garment.vertices, garments.read(path, shaped).vertices)


def test_a_unit_for_what_is_in_metres_is_refused(shaped):
    with pytest.raises(BadGarment, match="cape-light is in metres; got unit 'cm'"):
        try_on("cape-light", shaped, unit="cm")
