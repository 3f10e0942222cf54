"""Reading garments: what is guessed is said, what contradicts itself is refused."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from hemline import bodies, garments
from hemline.errors import BadGarment, BadMesh
from hemline.garments.cut.sector import grid_faces
from hemline.garments.dressing import body_tree
from hemline.garments.reading.units import unit_of
from hemline.meshes import vertex_normals

DATA = Path(__file__).resolve().parents[2] / "../shared/data/garments"


def skirt(shaped, *, rows=12, columns=36, ease=0.05):
    """A tube around the hips, 40 cm long, vertices and faces (outward), row 0 on top."""
    torso = shaped.vertices[np.abs(shaped.vertices[:, 1] - 0.02) < 0.1]
    reach = np.abs(torso[np.abs(torso[:, 0]) < 0.3]).max(axis=0) + ease
    angle = np.linspace(0, 2 * np.pi, columns, endpoint=False)
    flare = np.linspace(1, 1.5, rows)[:, None]
    x, z = flare * reach[0] * np.sin(angle), flare * reach[2] * np.cos(angle)
    y = np.repeat(np.linspace(0.1, -0.3, rows), columns).reshape(rows, columns)
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b = index[:-1], np.roll(index, -1, axis=1)[:-1]
    c, d = np.roll(index, -1, axis=1)[1:], index[1:]
    faces = np.concatenate([np.stack([a, d, b], -1).reshape(-1, 3), np.stack([b, d, c], -1).reshape(-1, 3)])
    return np.stack([x, y, z], axis=-1).reshape(-1, 3), faces


def obj(path, vertices, faces, pattern=None):
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in vertices]
    lines += [f"vt {x:.9g} {y:.9g}" for x, y in (() if pattern is None else pattern)]
    word = "{0}" if pattern is None else "{0}/{0}"
    lines += ["f " + " ".join(word.format(corner + 1) for corner in face) for face in faces]
    path.write_text("\n".join(lines))
    return path


@pytest.fixture(scope="module")
def mesh(shaped):
    return skirt(shaped)


def test_a_mesh_alone_is_read_with_its_guesses_said(shaped, mesh, tmp_path):
    garment = garments.read(obj(tmp_path / "skirt.obj", *mesh), shaped)
    np.testing.assert_array_equal(garment.faces, mesh[1])
    np.testing.assert_allclose(garment.vertices, mesh[0], atol=2e-6)
    assert garment.name == "skirt" and garment.material.name == "cotton" and not garment.flat_rest
    assert set(garment.pins.vertices.tolist()) == set(range(36))
    assert garment.key_joint in ("pelvis", "spine1")
    text = garments.explain(garment)
    for word in ("rest shape: the mesh itself", "pins: the highest of 2 open rims", "key joint:", "material: cotton"):
        assert word in text


@pytest.mark.parametrize(("unit", "scale"), [("cm", 100), ("mm", 1000), ("dm", 10), ("m", 1)])
def test_the_unit_is_guessed_from_the_size(shaped, mesh, tmp_path, unit, scale):
    garment = garments.read(obj(tmp_path / "skirt.obj", mesh[0] * scale, mesh[1]), shaped)
    np.testing.assert_allclose(garment.vertices, mesh[0], atol=2e-6)
    said = [note for note in garment.notes if note.startswith("unit:")]
    assert said == [] if unit == "m" else f"they are {unit}" in said[0]


@pytest.mark.parametrize("cloth", ["cape", "skirt", "tshirt", "longsleeve", "trousers", "dress"])
@pytest.mark.parametrize("floor", [False, True])
def test_the_axis_up_is_guessed_from_the_body(shaped, tmp_path, cloth, floor):
    known = garments.load(f"{cloth}-light")
    vertices = known.vertices - (0, floor * shaped.vertices[:, 1].min(), 0)
    obj(tmp_path / "y.obj", vertices, known.faces)
    obj(tmp_path / "z.obj", vertices[:, [0, 2, 1]] * (1, -1, 1), known.faces)
    for axis in "yz":
        (tmp_path / f"{axis}.toml").write_text(f"mesh = '{axis}.obj'\npins = 'none'")
    expected, garment = (garments.read(tmp_path / f"{axis}.toml", shaped) for axis in "yz")
    np.testing.assert_allclose(garment.vertices, expected.vertices, atol=2e-6)
    said = ("up: z, as it fits the body so; it was turned to y up",)
    assert set(garment.notes) - set(expected.notes) == set(said)
    assert any(note.startswith("origin: on the floor") for note in garment.notes) == floor


def test_what_fits_either_way_keeps_y_up(shaped, tmp_path):
    y, z = np.meshgrid(np.linspace(-0.1, 0.2, 7), np.linspace(-0.05, 0.1, 7))
    beside = float(shaped.vertices[np.abs(shaped.vertices[:, 1]) < 0.2][:, 0].max()) + 0.1
    sheet = np.stack([np.full_like(y, beside), y, z], axis=-1).reshape(-1, 3)
    obj(tmp_path / "sheet.obj", sheet, grid_faces(7, 7))
    (tmp_path / "sheet.toml").write_text("mesh = 'sheet.obj'\npins = 'none'")
    np.testing.assert_allclose(garments.read(tmp_path / "sheet.toml", shaped).vertices, sheet, atol=2e-6)


def test_an_axis_that_is_declared_is_kept(shaped, mesh, tmp_path):
    obj(tmp_path / "skirt.obj", mesh[0][:, [0, 2, 1]] * (1, -1, 1), mesh[1])
    (tmp_path / "skirt.toml").write_text("mesh = 'skirt.obj'\nup = 'y'")
    with pytest.raises(BadGarment, match="must fit the body at rest"):
        garments.read(tmp_path / "skirt.toml", shaped)


def test_a_declared_unit_that_contradicts_the_size_is_refused(shaped, mesh, tmp_path):
    path = obj(tmp_path / "skirt.obj", mesh[0] * 100, mesh[1])
    with pytest.raises(
        BadGarment, match=r"declared unit 'm' contradicts the size; got .* m long; in cm it would be 0\."
    ):
        garments.read(path, shaped, unit="m")
    (tmp_path / "skirt.toml").write_text("mesh = 'skirt.obj'\nunit = 'mm'")
    with pytest.raises(BadGarment, match="declared unit 'mm' contradicts"):
        garments.read(tmp_path / "skirt.toml", shaped)
    assert garments.read(path, shaped, unit="cm").vertices.max() < 1


def test_units():
    size = np.array([[0, 0, 0], [0, 1.0, 0]])
    assert unit_of(size * 40, "in", "it") == ("in", ())
    with pytest.raises(BadGarment, match="unknown unit; got 'yard'"):
        unit_of(size, "yard", "it")
    with pytest.raises(BadGarment, match="a size that no unit explains"):
        unit_of(size * 1e6, None, "it")


def test_all_that_a_toml_says_is_done(shaped, mesh, tmp_path):
    vertices = (mesh[0] - (0, shaped.vertices[:, 1].min(), 0))[:, [0, 2, 1]] * (100, -100, 100)  # z up, floor, cm
    obj(tmp_path / "skirt.obj", vertices, mesh[1])
    (tmp_path / "skirt.toml").write_text(
        "mesh = 'skirt.obj'\nname = 'twirl'\nunit = 'cm'\nup = 'z'\norigin = 'floor'\nbody = 'anny24'\n"
        "material = 'silk'\npins = 'boundary:0'\nchains = [[0, 36, 72], [5, 41]]\nkey_joint = 'pelvis'\n"
        "flat_rest = true\n"
    )
    garment = garments.read(tmp_path / "skirt.toml", shaped)
    np.testing.assert_allclose(garment.vertices, mesh[0], atol=2e-6)
    assert (garment.name, garment.material.name, garment.key_joint) == ("twirl", "silk", "pelvis")
    assert garment.chains == ((0, 36, 72), (5, 41)) and garment.flat_rest and len(garment.pins) == 36
    assert not any(note.startswith(("unit", "pins", "material", "origin", "key")) for note in garment.notes)


@pytest.mark.parametrize(
    ("pins", "ids"),
    [("[3, 1, 2]", [1, 2, 3]), ("'above:0.08'", list(range(36))), ("'top_rim'", list(range(36))), ("'none'", [])],
)
def test_rules_for_pins(shaped, mesh, tmp_path, pins, ids):
    obj(tmp_path / "skirt.obj", *mesh)
    (tmp_path / "skirt.toml").write_text(f"mesh = 'skirt.obj'\npins = {pins}")
    assert sorted(garments.read(tmp_path / "skirt.toml", shaped).pins.vertices.tolist()) == ids


@pytest.mark.parametrize(
    ("pins", "message"),
    [
        ("[4120]", "pins name vertex 4120; got a mesh of 432 vertices; count from 0"),
        ("'boundary:2'", "names a rim that does not exist; got 2 rims"),
        ("'boundary:x'", "unknown rule for pins; got 'boundary:x'"),
        ("'belt'", "unknown rule for pins; got 'belt'"),
        ("'above:3'", "must name vertices; got the highest is at"),
    ],
)
def test_refuses_pins_that_are_not_there(shaped, mesh, tmp_path, pins, message):
    obj(tmp_path / "skirt.obj", *mesh)
    (tmp_path / "skirt.toml").write_text(f"mesh = 'skirt.obj'\npins = {pins}")
    with pytest.raises(BadGarment, match=message):
        garments.read(tmp_path / "skirt.toml", shaped)


def test_groups_of_pins_hang_on_joints_and_on_springs(shaped, mesh, tmp_path):
    obj(tmp_path / "skirt.obj", *mesh)
    groups = "[[pins]]\nvertices = 'top_rim'\nto = 'pelvis'\n[[pins]]\nvertices = [400, 401]\nstiffness = 25"
    (tmp_path / "skirt.toml").write_text(f"mesh = 'skirt.obj'\n{groups}")
    pins = garments.read(tmp_path / "skirt.toml", shaped).pins
    rim = pins.joints >= 0
    assert sorted(pins.vertices[rim].tolist()) == list(range(36))
    assert pins.vertices[~rim].tolist() == [400, 401]
    assert np.isinf(pins.stiffness[rim]).all() and (pins.stiffness[~rim] == 25).all()


def test_a_vertex_in_two_groups_of_pins_is_refused(shaped, mesh, tmp_path):
    obj(tmp_path / "skirt.obj", *mesh)
    groups = "[[pins]]\nvertices = [3, 5]\n[[pins]]\nvertices = [7, 5]\nto = 'spine1'"
    (tmp_path / "skirt.toml").write_text(f"mesh = 'skirt.obj'\n{groups}")
    with pytest.raises(BadGarment, match="skirt: each vertex must be pinned once; got vertex 5 in two groups"):
        garments.read(tmp_path / "skirt.toml", shaped)


def test_refuses_a_closed_ball_and_far_pins(shaped, mesh, tmp_path):
    ball = trimesh.creation.icosphere(2, 0.2)
    path = obj(tmp_path / "ball.obj", np.array(ball.vertices) + (0, 0, 0.35), ball.faces)
    with pytest.raises(BadGarment, match="ball.obj has no cloth; got a part, closed and solid"):
        garments.read(path, shaped)
    path = obj(tmp_path / "wide.obj", mesh[0] * (3, 1, 3), mesh[1])
    with pytest.raises(BadGarment, match="pins must be near the body; got half of them more than"):
        garments.read(path, shaped)


def test_a_pattern_to_scale_is_the_rest_shape(shaped, mesh, tmp_path):
    # a square sheet beside the hip whose pattern is 2 % larger
    x, y = np.meshgrid(np.linspace(-0.2, 0.2, 9), np.linspace(0.1, -0.3, 9))
    sheet = np.stack([x, y, np.full_like(x, shaped.vertices[:, 2].min() - 0.05)], axis=-1).reshape(-1, 3)
    faces = grid_faces(9, 9)
    pattern = 1.02 * sheet[:, :2]
    garment = garments.read(obj(tmp_path / "sheet.obj", sheet, faces, pattern), shaped)
    assert garment.flat_rest and "rest shape: the pattern (vt)" in garments.explain(garment)
    assert np.linalg.det(garment.rest_edges).sum() / 2 == pytest.approx(0.4**2 * 1.02**2, rel=1e-6)
    garment = garments.read(obj(tmp_path / "sheet.obj", sheet, faces, pattern * 3), shaped)
    assert not garment.flat_rest and "no pattern to scale" in garments.explain(garment)
    (tmp_path / "sheet.toml").write_text("mesh = 'sheet.obj'\npattern = true")
    with pytest.raises(BadGarment, match=r"must be the pattern, .* got edges that differ by 67 %"):
        garments.read(tmp_path / "sheet.toml", shaped)
    obj(tmp_path / "sheet.obj", sheet, faces)
    with pytest.raises(BadGarment, match="'pattern' asks for texture coordinates; got a mesh without any"):
        garments.read(tmp_path / "sheet.toml", shaped)


def test_inside_out_and_mixed_winding_is_turned_outward(shaped, mesh, tmp_path):
    faces = mesh[1][:, ::-1].copy()
    faces[:50] = faces[:50, ::-1]
    garment = garments.read(obj(tmp_path / "skirt.obj", mesh[0], faces), shaped)
    normals = vertex_normals(garment.vertices.astype(float), garment.faces)
    assert (normals[:, [0, 2]] * garment.vertices[:, [0, 2]]).sum(axis=1).min() > 0
    assert "50 triangles are wound against" in garments.explain(
        garment
    ) and "face away from the body" in garments.explain(garment)
    assert (np.linalg.det(garment.rest_edges) > 0).all()


def test_a_little_inside_is_pushed_out_aloud(shaped, tmp_path):
    vertices, faces = skirt(shaped, ease=-0.004)
    tree = body_tree(shaped)
    inside = (tree.signed_distances(vertices) < 0).sum()
    assert inside > 0
    garment = garments.read(obj(tmp_path / "skirt.obj", vertices, faces), shaped)
    assert tree.signed_distances(garment.vertices).min() > 0
    assert f"{inside} vertices were inside the body at rest" in garments.explain(garment)


def test_what_is_deep_inside_or_far_off_is_refused(shaped, mesh, tmp_path):
    with pytest.raises(BadGarment, match=r"must fit the body at rest; got \d+ of 432 vertices inside it, the deepest"):
        garments.read(obj(tmp_path / "tight.obj", mesh[0] * (0.6, 1, 0.6), mesh[1]), shaped)
    with pytest.raises(BadGarment, match=r"must be on the body; got .* m from it at the nearest"):
        garments.read(obj(tmp_path / "far.obj", mesh[0] + (4, 0, 0), mesh[1]), shaped)


def test_standing_on_the_floor_is_guessed_aloud(shaped, mesh, tmp_path):
    lifted = mesh[0] - (0, shaped.vertices[:, 1].min(), 0)
    garment = garments.read(obj(tmp_path / "skirt.obj", lifted, mesh[1]), shaped)
    np.testing.assert_allclose(garment.vertices, mesh[0], atol=2e-6)
    assert "origin: on the floor" in garments.explain(garment)


def test_bad_meshes_are_refused(shaped, mesh, tmp_path):
    vertices, faces = mesh
    broken = vertices.copy()
    broken[3] = np.nan
    with pytest.raises(BadMesh, match="skirt must have finite vertices"):
        garments.read(obj(tmp_path / "skirt.obj", broken, faces), shaped)
    with pytest.raises(BadMesh, match="names vertex 433"):
        garments.read(obj(tmp_path / "skirt.obj", vertices, np.concatenate([faces, [[0, 1, 432]]])), shaped)
    with pytest.raises(BadMesh, match="must have faces"):
        garments.read(obj(tmp_path / "skirt.obj", vertices, []), shaped)
    with pytest.raises(BadMesh, match="no known mesh ending"):
        garments.read(tmp_path / "skirt.fbx", shaped)


def test_a_garment_made_on_another_shape_is_dressed(shaped, tmp_path):
    tall = bodies.load("anny24").shaped([-1.0])
    obj(tmp_path / "skirt.obj", *skirt(tall))
    (tmp_path / "skirt.toml").write_text("mesh = 'skirt.obj'\nbody = 'anny24'\nbetas = [-1.0]")
    own = garments.read(tmp_path / "skirt.toml")
    worn = garments.read(tmp_path / "skirt.toml", shaped)
    assert own.body_betas[0] == -1 and worn.body_betas[0] == 0
    np.testing.assert_array_equal(own.rest_edges, worn.rest_edges)
    on_skin = worn.pins.positions(shaped.vertices, shaped.normals, shaped.body.faces, shaped.joints)
    np.testing.assert_allclose(worn.vertices[worn.pins.vertices], on_skin, atol=1e-6)


def test_refuses_another_body_than_declared(shaped, mesh, tmp_path):
    obj(tmp_path / "skirt.obj", *mesh)
    (tmp_path / "skirt.toml").write_text("mesh = 'skirt.obj'\nbody = 'smpl'")
    with pytest.raises(BadGarment, match="was made on the body 'smpl'; got 'anny24' to wear it"):
        garments.read(tmp_path / "skirt.toml", shaped)


@pytest.mark.parametrize("ending", ["ply", "glb", "stl"])
def test_other_formats_lead_to_the_same_garment(shaped, mesh, tmp_path, ending):
    trimesh.Trimesh(*mesh, process=False).export(tmp_path / f"skirt.{ending}")
    garment = garments.read(tmp_path / f"skirt.{ending}", shaped)
    assert garment.vertices.shape == mesh[0].shape and len(garment.pins) == 36
    np.testing.assert_allclose(np.sort(garment.vertices[:, 1]), np.sort(mesh[0][:, 1]), atol=2e-6)


@pytest.mark.data
@pytest.mark.skipif(not DATA.is_dir(), reason=f"no garments at {DATA}")
@pytest.mark.parametrize(
    ("file", "notes"),
    [
        ("garmentcode_mit/skirt_circle_mean_all.obj", ["the pattern (vt)", "on the floor"]),
        ("makehuman_cc0/long_skirt.obj", ["29 vertices were inside the body at rest"]),
        ("makehuman_cc0/mhclo/skirthelper.obj", ["684 polygons", "they are dm"]),
        ("style3d_bsd3/tshirt_12k.obj", ["on the floor", "pins: none, as the shoulders carry it"]),
    ],
)
def test_garments_of_other_makers_are_read_aloud(shaped, file, notes):
    garment = garments.read(DATA / file, shaped)
    assert body_tree(shaped).signed_distances(garment.vertices).min() > 0
    assert all(note in garments.explain(garment) for note in notes)


@pytest.mark.data
@pytest.mark.skipif(not DATA.is_dir(), reason=f"no garments at {DATA}")
def test_a_garment_of_another_body_is_refused_with_what_was_found(shaped):
    with pytest.raises(BadGarment, match="f_jeans must fit the body at rest; got 403 of 886 vertices inside"):
        garments.read(DATA / "makehuman_cc0/f_jeans.obj", shaped)
