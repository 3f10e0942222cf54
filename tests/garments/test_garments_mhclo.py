"""MakeHuman's clothes: they follow the body's shape by their bindings, and what contradicts itself is refused."""

from dataclasses import replace

import numpy as np
import pytest

from hemline import bodies, garments
from hemline.bodies.base_mesh import base_mesh
from hemline.errors import BadBody, BadGarment, BadMesh
from hemline.garments.clearance import push_out_of_body
from hemline.garments.cut.sector import grid_faces
from hemline.garments.dressing import body_tree
from hemline.garments.reading.mhclo import read_mhclo
from hemline.garments.reading.raise_over_skin import raise_over_skin
from hemline.meshes import closest_points_on_mesh, edge_strains, vertex_normals
from tests.garments.bound_clothes import bindings, tube, write_clothes

BUTTON = np.array([[0, 0, 0], [0.02, 0, 0], [0.02, 0.02, 0], [0, 0.02, 0]])


@pytest.fixture(scope="module")
def mesh(shaped):
    return tube(shaped)


@pytest.fixture(scope="module")
def tall():
    return bodies.load("anny24").shaped([1.5, 0.3, -0.8])


def test_on_the_body_of_the_makers_it_is_what_they_made(shaped, mesh, tmp_path):
    garment = garments.read(write_clothes(tmp_path, mesh, shaped), shaped)
    np.testing.assert_allclose(garment.vertices, mesh[0], atol=1e-6)
    assert garment.name == "tube skirt" and len(garment.faces) == 2 * len(mesh[1]) and not garment.pieces
    assert np.abs(edge_strains(garment.vertices, garment.faces, garment.rest_edges)).max() < 1e-5
    assert set(garment.pins.vertices.tolist()) == set(range(36)) and garment.key_joint in ("pelvis", "spine1")
    text = garments.explain(garment)
    for said in (
        "the mesh itself on the mean shape",
        "body vertices that the file hides are kept",
        "material: cotton",
        "polygons of more than three corners",
        "pins: the highest of 2 open rims",
    ):
        assert said in text


def test_on_another_body_each_vertex_follows_its_own_binding(shaped, tall, mesh, tmp_path):
    path = write_clothes(tmp_path, mesh, shaped)
    base, made = base_mesh().on(tall), base_mesh().on(shaped)
    bound = read_mhclo(path, len(base))
    found = bound.on(base)
    for vertex in (0, 17, 200, 431):  # by hand, from the file's own text
        words = path.read_text().split("verts 0\n")[1].splitlines()[vertex].split()
        corners = [int(word) for word in words[:3]]
        numbers = [float(word) for word in words[3:]]
        for axis, (one, two) in enumerate(((5399, 11998), (791, 881), (962, 5320))):
            scale = abs(base[one, axis] - base[two, axis]) / abs(made[one, axis] - made[two, axis]) / 10
            expected = sum(w * float(base[c, axis]) for w, c in zip(numbers[:3], corners, strict=True))
            assert abs(found[vertex, axis] - expected - scale * numbers[3 + axis]) < 1e-9
    garment = garments.read(path, tall)
    free = np.ones(len(found), bool)
    free[garment.pins.vertices] = False
    far = body_tree(tall).signed_distances(found) > 0.02
    np.testing.assert_allclose(garment.vertices[free & far], found[free & far], atol=1e-6)
    assert np.abs(garment.vertices - mesh[0]).max() > 0.02
    np.testing.assert_array_equal(garment.rest_edges, garments.read(path, shaped).rest_edges)
    np.testing.assert_array_equal(garment.body_betas, tall.betas)


def test_betas_of_a_toml_are_what_it_is_cut_for(shaped, tall, mesh, tmp_path):
    write_clothes(tmp_path, mesh, shaped)
    toml = tmp_path / "fitted.toml"
    toml.write_text("mesh = 'clothes.mhclo'\nbetas = [1.5, 0.3, -0.8]\nmaterial = 'silk'\npins = [3, 4]\n")
    fitted = garments.read(toml, tall)
    off = np.abs(edge_strains(fitted.vertices, fitted.faces, fitted.rest_edges))
    assert np.median(off) < 1e-6 and "on the shape that 'betas' says" in garments.explain(fitted)
    loose = garments.read(tmp_path / "clothes.mhclo", tall)
    assert np.median(np.abs(edge_strains(loose.vertices, loose.faces, loose.rest_edges))) > 0.01
    assert fitted.material.name == "silk" and fitted.pins.vertices.tolist() == [3, 4]
    np.testing.assert_array_equal(garments.read(toml).body_betas[:3], np.array([1.5, 0.3, -0.8], np.float32))


def test_a_line_may_name_one_vertex_or_leave_the_offset_out(shaped, mesh, tmp_path):
    rows = bindings(mesh[0], shaped)
    rows[5], rows[6] = "18010", " ".join(rows[6].split()[:6])
    bound = read_mhclo(write_clothes(tmp_path, mesh, shaped, rows=rows), 19158)
    base = base_mesh().on(shaped)
    np.testing.assert_array_equal(bound.on(base)[5], base[18010])
    nearest = body_tree(shaped).closest(mesh[0][6:7]).positions[0]
    np.testing.assert_allclose(bound.on(base)[6], nearest, atol=1e-9)


def test_without_a_name_of_the_base_mesh_it_is_assumed_aloud(shaped, mesh, tmp_path):
    path = write_clothes(tmp_path, mesh, shaped, head=lambda lines: [line for line in lines if "hm08" not in line])
    assert "base mesh: hm08, as none was named" in garments.explain(garments.read(path, shaped))


def test_components_are_pieces_from_the_skin_outwards_without_buttons(shaped, tmp_path):
    outer, quads = tube(shaped, top=0.1, bottom=-0.2, ease=0.06)
    inner, _ = tube(shaped, top=0.08, bottom=-0.3, ease=0.04)
    button = BUTTON + (0, -0.1, outer[:, 2].max() + 0.05)
    vertices = np.concatenate([outer, button, inner])
    faces = np.concatenate([quads, [[432, 433, 434, 435]], quads + 436])
    garment = garments.read(write_clothes(tmp_path, (vertices, faces), shaped), shaped)
    assert [piece.vertex_count for piece in garment.pieces] == [432, 432]
    np.testing.assert_allclose(garment.vertices[:432], inner, atol=1e-6)
    assert garment.vertices[432:, 1].min() == pytest.approx(-0.2, abs=1e-6)
    first = np.bincount(garment.face_pieces[np.isin(garment.faces, garment.pins.vertices).any(axis=1)])
    assert len(garment.pins) == 72 and (first > 0).all()
    text = garments.explain(garment)
    assert "left out: a button or the like (4 vertices from 432 on, 20 mm)" in text
    assert "component 1 of 2 from the skin outwards: 432 vertices, the first is 436 of the OBJ, 0.38 m high" in text
    (tmp_path / "own.toml").write_text("mesh = 'clothes.mhclo'\npins = [3, 440]\n")  # ids of the OBJ
    pins = garments.read(tmp_path / "own.toml", shaped).pins
    assert sorted(pins.vertices.tolist()) == [440 - 436, 432 + 3]
    (tmp_path / "own.toml").write_text("mesh = 'clothes.mhclo'\npins = [3, 9000]\n")
    with pytest.raises(BadGarment, match="pins name vertex 9000"):
        garments.read(tmp_path / "own.toml", shaped)


def test_clothes_of_buttons_alone_are_refused(shaped, tmp_path):
    button = BUTTON + (0, 0, shaped.vertices[:, 2].max() + 0.02)
    path = write_clothes(tmp_path, (button, np.array([[0, 1, 2, 3]])), shaped)
    with pytest.raises(BadGarment, match="tube skirt must have cloth; got 1 components, all smaller"):
        garments.read(path, shaped)


def test_skin_is_beneath_coarse_triangles(shaped):
    vertices, quads = tube(shaped, rows=4, columns=10, ease=-0.005, flare=1.0, top=0.05, bottom=-0.05)
    faces = quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3).astype(np.int32)
    tree = body_tree(shaped)
    vertices = push_out_of_body(vertices, tree, 0.003)

    def through(cloth):
        band = (np.abs(shaped.vertices[:, 1]) < 0.03) & (np.abs(shaped.vertices[:, 0]) < 0.3)
        skin, normals = shaped.vertices[band].astype(float), shaped.normals[band]
        closest = closest_points_on_mesh(skin, cloth, faces)
        return (((skin - closest.positions) * normals).sum(axis=1) > 1e-5)[closest.distances < 0.01].sum()

    assert through(vertices) > 5
    raised, notes = raise_over_skin(vertices, faces, shaped)
    assert through(raised) == 0
    assert np.linalg.norm(raised - vertices, axis=1).max() < 0.03 and "came through triangles" in notes[0]
    again, silent = raise_over_skin(raised, faces, shaped)
    assert np.abs(again - raised).max() < 1e-5 or not silent


def test_cloth_is_raised_over_what_is_beneath_it_and_not_beside_it(shaped):
    x, y = np.meshgrid(np.linspace(-0.1, 0.1, 6), np.linspace(-0.1, 0.1, 6))
    sheet, faces = np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3), grid_faces(6, 6)
    side = np.sign(vertex_normals(sheet, faces)[0, 2])
    skin, looks = np.full(shaped.vertices.shape, 9.0, np.float32), np.zeros(shaped.normals.shape, np.float32)
    looks[:, 2] = side
    skin[0], skin[1] = (0.01, 0.012, 0.004 * side), (0.104, 0.0, 0.004 * side)  # beneath, and beyond the rim
    raised, notes = raise_over_skin(sheet, faces, replace(shaped, vertices=skin, normals=looks))
    closest = closest_points_on_mesh(skin[:1].astype(float), raised, faces)
    assert closest.distances[0] > 0.8e-3 and closest.positions[0, 2] * side > 0.0045
    np.testing.assert_array_equal(raised[sheet[:, 0] > 0.09], sheet[sheet[:, 0] > 0.09])
    assert notes[0].startswith("1 vertices of the body came through triangles")
    still, none = raise_over_skin(sheet, faces, replace(shaped, vertices=skin, normals=-looks))  # looks the other way
    np.testing.assert_array_equal(still, sheet)
    assert none == ()


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        (lambda rows: ["19158", *rows[1:]], "line 10: hm08 has the vertices 0 to 19157; got vertex 19158"),
        (lambda rows: ["1 2 -3 1 0 0", *rows[1:]], "line 10: hm08 has the vertices 0 to 19157; got vertex -3"),
        (lambda rows: [rows[0], "1 2 3 0.5 0.5", *rows[2:]], "line 11: a binding must be .* got 5 columns"),
        (lambda rows: [rows[0] + " 7", *rows[1:]], "line 10: a binding must be .* got 10 columns"),
        (
            lambda rows: ["1 2 3 nan 0 0 0 0 0", *rows[1:]],
            "line 10: weights and offsets must be finite, below 1e.06; got NaN",
        ),
        (lambda rows: ["nan", *rows[1:]], "line 10 cannot be read; got 'nan'"),
        (lambda rows: ["9" * 400, *rows[1:]], f"line 10 cannot be read; got '{'9' * 60}'"),
        (lambda rows: ["1 2 3 0.2 0.3 0.5 0 0 " + "9" * 400, *rows[1:]], "line 10: weights and offsets must be finite"),
        (lambda rows: ["1 2 3 1e308 1e308 -1e308 0 0 0", *rows[1:]], "line 10: weights and offsets must be finite"),
        (lambda rows: ["1.5", *rows[1:]], "line 10 cannot be read; got '1.5'"),
        (lambda rows: [*rows[:-1], "1 2 3 0.5 0.5 0.5"], "line 441: weights must sum to 1; got 0.5 more or less"),
        (lambda rows: rows[:-2], "must bind each vertex of clothes.obj; got 430 bindings, 432 vertices"),
        (lambda rows: [], "must bind each vertex of clothes.obj; got 0 bindings, 432 vertices"),
    ],
)
def test_bindings_that_cannot_be_are_refused(shaped, mesh, tmp_path, changed, message):
    path = write_clothes(tmp_path, mesh, shaped, rows=changed(bindings(mesh[0], shaped)))
    with pytest.raises(BadGarment, match=message):
        garments.read(path, shaped)


@pytest.mark.parametrize(
    ("line", "instead", "message"),
    [
        ("basemesh", "basemesh alpha7", "must be bound to the base mesh hm08; got 'alpha7'"),
        ("obj_file", "", "must name its mesh; got no file after 'obj_file'"),
        ("x_scale", "shear_x 1 2 0.5 0.6", "must not shear its offsets; got shear_x"),
        (
            "obj_file",
            "obj_file ../clothes.obj",
            "names a mesh that is not beside it; got '../clothes.obj'; put the OBJ",
        ),
        ("obj_file", "obj_file /etc/passwd", "names a mesh that is not beside it; got '/etc/passwd'"),
        ("obj_file", "obj_file notes.txt", "must name an OBJ; got 'notes.txt'"),
        ("x_scale", "x_scale " + "9" * 400 + " 1 2", "'x_scale' must be two vertices"),
        ("x_scale", "", "'x_scale' must be two vertices of hm08 and their distance; got ''"),
        ("y_scale", "y_scale 1 2 0", "'y_scale' must be two vertices .* got '1 2 0'"),
        ("z_scale", "z_scale 1 99999 2.0", "'z_scale' must be two vertices .* got '1 99999 2.0'"),
    ],
)
def test_heads_that_cannot_be_are_refused(shaped, mesh, tmp_path, line, instead, message):
    def head(lines):
        return [instead if each.startswith(line) else each for each in lines]

    path = write_clothes(tmp_path, mesh, shaped, head=head)
    with pytest.raises(BadGarment, match=message):
        garments.read(path, shaped)


def test_files_that_are_none_are_refused(shaped, mesh, tmp_path):
    path = write_clothes(tmp_path, mesh, shaped)
    with pytest.raises(BadMesh, match=r"cannot read .*clothes.obj; got No such file"):
        (tmp_path / "clothes.obj").unlink()
        garments.read(path, shaped)
    for content, got in (
        (b"", "nothing in it"),
        (b"\x81\xfe\x00\xff" * 99, "bytes that are no text"),
        (b"name shirt\nobj_file shirt.obj\n", "2 lines without a line 'verts'"),
    ):
        path.write_bytes(content)
        with pytest.raises(BadGarment, match=f"is no clothes file; got {got}"):
            garments.read(path, shaped)
    with pytest.raises(BadGarment, match="cannot read .*; got No such file"):
        garments.read(tmp_path / "none.mhclo", shaped)


def test_a_secret_is_not_quoted(shaped, mesh, tmp_path):
    (tmp_path / "secret.obj").write_text("v 1 2 SECRET-TOKEN-12345\n")
    (tmp_path / "sent").mkdir()
    for name in ("../secret.obj", str(tmp_path / "secret.obj"), "link.obj"):
        path = write_clothes(
            tmp_path / "sent",
            mesh,
            shaped,
            head=lambda lines, name=name: [f"obj_file {name}" if each.startswith("obj") else each for each in lines],
        )
        if name == "link.obj":
            (tmp_path / "sent" / name).symlink_to(tmp_path / "secret.obj")
        with pytest.raises(BadGarment, match="names a mesh that is not beside it") as found:
            garments.read(path, shaped)
        assert "SECRET" not in str(found.value)


def test_clothes_of_thousands_of_components_are_refused(shaped, mesh, tmp_path):
    """Each piece is compared with each other one, so hundreds would take hours."""
    vertices = np.tile(mesh[0][:3], (2001, 1)) + np.repeat(np.arange(2001), 3)[:, None] * 1e-3
    faces = np.arange(len(vertices)).reshape(-1, 3)
    path = write_clothes(tmp_path, (vertices, faces), shaped, rows=bindings(vertices, shaped))
    with pytest.raises(BadGarment, match="may have 2000 components; got 2001; merge vertices at equal places"):
        garments.read(path, shaped)
    few = (vertices[: 3 * 31] + np.repeat(np.arange(31), 3)[:, None] * 1e-2, faces[:31])
    path = write_clothes(tmp_path, few, shaped, rows=bindings(few[0], shaped))
    with pytest.raises(BadGarment, match="may have 30 pieces of cloth; got 31"):
        garments.read(path, shaped)


def test_clothes_without_an_area_are_refused(shaped, mesh, tmp_path):
    rows = bindings(mesh[0], shaped)
    path = write_clothes(tmp_path, mesh, shaped, rows=[*rows[:36], rows[0], *rows[37:]])
    with pytest.raises(BadMesh, match="tube skirt must have triangles with an area; got 2 of 792"):
        garments.read(path, shaped)


@pytest.mark.parametrize("said", ["unit = 'dm'", "origin = 'floor'", "up = 'z'", "pattern = true"])
def test_a_toml_that_says_where_it_is_is_refused(shaped, mesh, tmp_path, said):
    write_clothes(tmp_path, mesh, shaped)
    (tmp_path / "own.toml").write_text(f"mesh = 'clothes.mhclo'\n{said}\n")
    with pytest.raises(BadGarment, match=f"have a place and no pattern; .* remove '{said.split()[0]}'"):
        garments.read(tmp_path / "own.toml", shaped)
    with pytest.raises(BadGarment, match="remove 'unit'"):
        garments.read(tmp_path / "clothes.mhclo", shaped, unit="dm")


def test_another_body_is_refused(shaped, mesh, tmp_path):
    other = replace(shaped.body, name="other", template=1.1 * shaped.body.template).shaped()
    with pytest.raises(BadBody, match="hm08 is the mesh of the body 'anny24'; got 'other' with another mesh"):
        garments.read(write_clothes(tmp_path, mesh, shaped), other)
