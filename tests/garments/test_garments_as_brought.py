"""Garments as people bring them: the cloth in the file is found, all else is left out, and both are said.

The law of each test: the cloth that is read from a file with something beside it, or with faults, is the cloth that was
written.
"""

import numpy as np
import pytest

from hemline import garments
from hemline.errors import BadGarment
from hemline.garments.reading.file_parts import split_part
from hemline.garments.reading.source import GarmentSource
from hemline.meshes import boundary_loops, check_mesh, face_areas, open_rims, sheets, vertex_normals
from hemline.meshes.edges import directed_edges


@pytest.fixture(scope="module")
def shirt():
    """A T-shirt: vertices and triangles."""
    garment = garments.load("tshirt-light")
    return garment.vertices.astype(float), garment.faces.astype(np.int64)


def write(path, parts, *, scale=1.0, marks=()):
    """Writes named parts as the objects of an OBJ."""
    lines, count = list(marks), 0
    for name, vertices, faces in parts:
        lines += [f"o {name}"] if name else []
        lines += [f"v {x:.7f} {y:.7f} {z:.7f}" for x, y, z in (scale * np.asarray(vertices)).tolist()]
        lines += ["f " + " ".join(str(corner + 1 + count) for corner in face) for face in np.asarray(faces).tolist()]
        count += len(vertices)
    path.write_text("\n".join(lines) + "\n")
    return path


def cloth_of(path):
    return GarmentSource.open(path).cloth


def assert_is(cloth, mesh):
    """The cloth is that mesh, and nothing else."""
    vertices, faces = mesh
    assert len(cloth.vertices) == len(vertices) and len(cloth.faces) == len(faces)
    assert np.allclose(cloth.vertices, vertices, atol=1e-6)


def box(centre, sides):
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]) * sides + centre
    sheets = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return corners, np.array([[a, b, c] for q in sheets for a, b, c in ((q[0], q[1], q[2]), (q[0], q[2], q[3]))])


def ring(radius, height, thickness, around=60):
    """A closed tube of thin section around the y axis, as a cord is."""
    angle, section = (np.linspace(0, 2 * np.pi, count + 1)[:-1] for count in (around, 8))
    out = radius + thickness * np.cos(section)[None, :]
    points = np.stack(
        [
            out * np.cos(angle)[:, None],
            height + thickness * np.sin(section)[None, :] + 0 * angle[:, None],
            out * np.sin(angle)[:, None],
        ],
        axis=-1,
    )
    index = np.arange(around * 8).reshape(around, 8)
    a, b = index, np.roll(index, -1, axis=0)
    c, d = np.roll(b, -1, axis=1), np.roll(a, -1, axis=1)
    faces = np.concatenate([np.stack([a, d, b], -1).reshape(-1, 3), np.stack([b, d, c], -1).reshape(-1, 3)])
    return points.reshape(-1, 3), faces


def thickened(vertices, faces, thickness):
    """Cloth as programs export it with thickness: both sides, joined along its rims."""
    normals = vertex_normals(vertices, faces)
    count = len(vertices)
    known = {tuple(edge) for edge in directed_edges(faces).tolist()}
    rims = [(a, b) for a, b in known if (b, a) not in known]
    side = [each for a, b in rims for each in ((b, a, a + count), (b, a + count, b + count))]
    both = np.concatenate([vertices + 0.5 * thickness * normals, vertices - 0.5 * thickness * normals])
    return both, np.concatenate([faces, faces[:, ::-1] + count, side])


def test_buttons_are_left_out_by_name(shirt, tmp_path):
    front = shirt[0][:, 2].max() + 0.01
    parts = [(f"Button_{k}", *box((0, 0.1 * k, front), (0.01, 0.01, 0.004))) for k in range(4)]
    cloth = cloth_of(write(tmp_path / "a.obj", [("Shirt", *shirt), *parts], scale=100))
    assert_is(cloth, shirt)
    assert any("left out: 4 parts 'Button_0', 'Button_1', 'Button_2', 'Button_3'" in note for note in cloth.notes)


def test_zips_cords_and_a_floor_are_left_out(shirt, tmp_path):
    strip = np.array([[x, 0.4 - 0.02 * k, 0.25] for k in range(20) for x in (-0.01, 0.01)])
    strip_faces = [
        face for k in range(19) for face in ((2 * k, 2 * k + 2, 2 * k + 1), (2 * k + 1, 2 * k + 2, 2 * k + 3))
    ]
    floor = np.array([[-2, -1, -2], [2, -1, -2], [2, -1, 2], [-2, -1, 2]], float)
    parts = [
        ("Zipper_Tape", strip, strip_faces),
        ("Drawcord", *ring(0.14, 0.45, 0.004)),
        ("Plane", floor, [[0, 2, 1], [0, 3, 2]]),
    ]
    cloth = cloth_of(write(tmp_path / "a.obj", [("Shirt", *shirt), *parts]))
    assert_is(cloth, shirt)
    for said in ("'Zipper_Tape', by their names", "'Drawcord', closed, as cords are", "'Plane', flat, as a floor is"):
        assert any(said in note for note in cloth.notes)


@pytest.mark.parametrize("scale", [1, 100, 1000, 1 / 0.0254])
@pytest.mark.parametrize("name", ["Avatar", ""])
def test_a_body_in_the_file_is_left_out_and_tells_the_unit(shirt, shaped, tmp_path, scale, name):
    body = (shaped.vertices.astype(float), shaped.body.faces)
    cloth = cloth_of(write(tmp_path / "a.obj", [(name, *body), ("Shirt" if name else "", *shirt)], scale=scale))
    assert_is(cloth, shirt)
    assert any(note.startswith("left out: a body of 1.70 m") for note in cloth.notes)


def test_a_body_cut_off_at_the_neck_is_left_out_too(shirt, shaped, tmp_path):
    vertices, faces = shaped.vertices.astype(float), shaped.body.faces
    lower = faces[vertices[faces].mean(axis=1)[:, 1] < 0.55]
    assert_is(cloth_of(write(tmp_path / "a.obj", [("", vertices, lower), ("", *shirt)])), shirt)


def test_a_file_of_a_body_alone_has_no_cloth(shaped, tmp_path):
    path = write(tmp_path / "a.obj", [("Body", shaped.vertices, shaped.body.faces)])
    with pytest.raises(BadGarment, match=r"a.obj has no cloth; got a part, closed and solid, 1.70 m long"):
        cloth_of(path)


@pytest.mark.parametrize("name", ["tshirt-light", "trousers-light", "cape-light"])
@pytest.mark.parametrize("thickness", [0.001, 0.003])
def test_of_cloth_with_thickness_one_side_remains(tmp_path, name, thickness):
    garment = garments.load(name)
    vertices, faces = garment.vertices.astype(float), garment.faces.astype(np.int64)
    cloth = cloth_of(write(tmp_path / "a.obj", [("", *thickened(vertices, faces, thickness))]))
    area = float(face_areas(vertices, faces).sum())
    assert float(face_areas(cloth.vertices, cloth.faces).sum()) == pytest.approx(area, rel=0.02)
    assert len(open_rims(cloth.faces)) == len(open_rims(faces)) and check_mesh(cloth.vertices, cloth.faces) == ()
    said = next(note for note in cloth.notes if note.startswith("thickness:"))
    assert f"about {1000 * thickness:.1f} mm thick" in said


def test_a_lining_is_left_out_but_a_garment_over_another_is_not(shirt, tmp_path):
    vertices, faces = shirt
    normals = vertex_normals(vertices, faces)
    lined = [("Shell", vertices, faces), ("Lining", vertices - 0.004 * normals, faces[:, ::-1])]
    cloth = cloth_of(write(tmp_path / "lined.obj", lined))
    assert_is(cloth, shirt)
    assert any(note.startswith("layers: 'Lining' lies within 8 mm") for note in cloth.notes)
    over = [("Shirt", vertices, faces), ("Coat", vertices + 0.03 * normals, faces)]
    assert len(cloth_of(write(tmp_path / "over.obj", over)).vertices) == 2 * len(vertices)


def test_a_patch_on_the_cloth_is_left_out(shirt, tmp_path):
    vertices, faces = shirt
    middle = vertices[faces].mean(axis=1)
    near = np.linalg.norm(middle - middle[(middle[:, 2]).argmax()], axis=1) < 0.05
    ids, own = np.unique(faces[near], return_inverse=True)
    patch = vertices[ids] + 0.003 * vertex_normals(vertices, faces)[ids]
    cloth = cloth_of(write(tmp_path / "a.obj", [("Shirt", *shirt), ("Pocket", patch, own.reshape(-1, 3))]))
    assert_is(cloth, shirt)
    assert any("'Pocket', lying on other cloth" in note for note in cloth.notes)


def test_the_finest_level_of_detail_is_read(shirt, tmp_path):
    coarse = garments.load("tshirt-light").vertices * 1.001
    parts = [("Shirt_LOD1", coarse, shirt[1]), ("Shirt_LOD0", *shirt)]
    assert_is(cloth_of(write(tmp_path / "a.obj", parts)), shirt)


def test_copies_beside_each_other_are_one_garment_and_others_must_be_named(shirt, tmp_path):
    trousers = garments.load("trousers-light")
    copies = [("A", *shirt), ("B", shirt[0] + (1.2, 0, 0), shirt[1])]
    assert_is(cloth_of(write(tmp_path / "copies.obj", copies)), shirt)
    rack = [("Shirt", *shirt), ("Trousers", trousers.vertices + (1.2, 0, 0), trousers.faces)]
    path = write(tmp_path / "rack.obj", rack)
    with pytest.raises(BadGarment, match="holds 2 garments beside each other; got 'Shirt', 'Trousers'; name one"):
        cloth_of(path)
    assert_is(cloth_of(f"{path}:Shirt"), shirt)
    assert GarmentSource.open(f"{path}:Trousers").name == "Trousers"


@pytest.mark.parametrize("part", ["Shirt", "shirt", "Shi", "0"])
def test_a_part_is_chosen_by_name_or_number(shirt, tmp_path, part):
    other = garments.load("trousers-light")
    path = write(tmp_path / "a.obj", [("Shirt", *shirt), ("Trousers", other.vertices, other.faces)])
    assert_is(cloth_of(f"{path}:{part}"), shirt)
    (tmp_path / "a.toml").write_text(f"mesh = 'a.obj:{part}'\nname = 'mine'")
    assert_is(cloth_of(tmp_path / "a.toml"), shirt)


def test_a_part_that_is_not_there_or_not_alone_is_refused(shirt, tmp_path):
    path = write(tmp_path / "a.obj", [("Shirt_a", *shirt), ("Shirt_b", shirt[0] + 0.5, shirt[1])])
    with pytest.raises(BadGarment, match="has no part 'Skirt'; got 'Shirt_a', 'Shirt_b'"):
        cloth_of(f"{path}:Skirt")
    with pytest.raises(BadGarment, match="names several parts; got 'Shirt_a', 'Shirt_b'"):
        cloth_of(f"{path}:Shirt")


def test_names_are_split_at_the_colon_behind_the_ending():
    assert split_part("C:\\a\\b.obj:Top: left")[1] == "Top: left" and split_part("C:\\a\\b.obj")[1] is None
    assert split_part("dress:7")[1] is None


def sewn_pocket(shirt):
    """A shirt with a pocket, whose rim it shares, and the number of edges along it."""
    vertices, faces = shirt
    middle = vertices[faces].mean(axis=1)
    near = np.linalg.norm(middle - middle[middle[:, 2].argmax()], axis=1) < 0.07
    inner = np.setdiff1d(faces[near], np.concatenate([*boundary_loops(faces[near])]))
    near = np.isin(faces, inner).any(axis=1)
    rim = np.setdiff1d(faces[near], inner)
    number = np.arange(len(vertices))
    number[inner] = len(vertices) + np.arange(len(inner))
    lifted = vertices[inner] + 0.005 * vertex_normals(vertices, faces)[inner]
    return np.concatenate([vertices, lifted]), np.concatenate([faces, number[faces[near]]]), len(rim)


def test_a_pocket_that_is_sewn_on_becomes_a_sheet_of_its_own(shirt, tmp_path):
    vertices, faces, edges = sewn_pocket(shirt)
    cloth = cloth_of(write(tmp_path / "a.obj", [("", vertices, faces)]))
    times = np.unique(np.sort(directed_edges(cloth.faces), axis=1), axis=0, return_counts=True)[1]
    assert times.max() == 2 and len(cloth.faces) == len(faces)
    # every second vertex of the seam is shared, so that it is sewn all along
    assert 0.4 * edges <= edges - (len(cloth.vertices) - len(vertices)) <= 0.6 * edges
    assert len(open_rims(cloth.faces)) == len(open_rims(shirt[1])) == len(boundary_loops(cloth.faces)) - 1
    assert any("are sewn together at" in note for note in cloth.notes)
    moved = cloth.vertices[len(vertices) :]
    gap = np.linalg.norm(moved[:, None] - vertices[None], axis=2).min(axis=1)
    assert np.allclose(gap, 0.002, atol=1e-5)
    # the pocket faces the other way, or the simulator would take it for a neighbour that the shirt cannot meet
    ends = cloth.vertices[cloth.faces]
    normals = np.cross(ends[:, 1] - ends[:, 0], ends[:, 2] - ends[:, 0])
    front = normals[(sheets(cloth.faces) > 0)][:, 2]
    assert (front < 0).all()


@pytest.mark.parametrize("unit", ["m", "cm", "mm", "in"])
def test_a_pattern_in_a_unit_of_its_own_is_found(tmp_path, unit):
    per_metre = {"m": 1, "cm": 100, "mm": 1000, "in": 1 / 0.0254}[unit]
    around, rows, radius = 24, 8, 0.2
    angle = 2 * np.pi * np.arange(around + 1) / around
    lines = [
        f"v {100 * radius * np.cos(a):.6f} {-5 * row} {100 * radius * np.sin(a):.6f}"
        for row in range(rows)
        for a in angle[:-1]
    ]
    lines += [f"vt {radius * a * per_metre:.6f} {-0.05 * row * per_metre:.6f}" for row in range(rows) for a in angle]

    def corner(row, k):
        return f"{row * around + k % around + 1}/{row * (around + 1) + k + 1}"

    for row in range(rows - 1):
        for k in range(around):
            one, other = (corner(row, k), corner(row + 1, k)), (corner(row, k + 1), corner(row + 1, k + 1))
            lines += [f"f {one[0]} {other[0]} {one[1]}", f"f {other[0]} {other[1]} {one[1]}"]
    (tmp_path / "a.obj").write_text("\n".join(lines))
    cloth = cloth_of(tmp_path / "a.obj")
    assert cloth.from_pattern
    edge = 2 * np.pi * radius / around
    assert np.abs(np.linalg.norm(cloth.rest_edges, axis=1)).min() == pytest.approx(min(edge, 0.05), rel=1e-4)


def test_pins_by_ids_of_the_file_follow_their_vertices_through_repairs(shirt, tmp_path):
    vertices, faces = shirt
    loose = np.concatenate([[[0, 9, 0]], vertices])
    write(tmp_path / "a.obj", [("", loose, faces + 1)])
    (tmp_path / "a.toml").write_text("mesh = 'a.obj'\npins = [5, 8]\nchains = [[20, 21]]")
    source = GarmentSource.open(tmp_path / "a.toml")
    assert source.cloth_description.pins == (4, 7) and source.cloth_description.chains == ((19, 20),)
    (tmp_path / "a.toml").write_text("mesh = 'a.obj'\npins = [0]")
    with pytest.raises(BadGarment, match="pins name vertex 0; got one that was left out"):
        cloth_of(tmp_path / "a.toml")


def test_pins_by_group_and_by_colour(shirt, tmp_path):
    vertices, faces = shirt
    high = vertices[faces][:, :, 1].min(axis=1) > np.percentile(vertices[:, 1], 90)
    lines = [f"v {x:.6f} {y:.6f} {z:.6f} {int(y > 0.3)} 0 0" for x, y, z in vertices.tolist()]
    for name, which in (("g Collar", high), ("g Rest", ~high)):
        lines += [name, *("f " + " ".join(str(each + 1) for each in face) for face in faces[which].tolist())]
    (tmp_path / "a.obj").write_text("\n".join(lines))
    for rule, expected in (
        ("group:Collar", np.unique(faces[high])),
        ("colour:red", np.flatnonzero(vertices[:, 1].round(6) > 0.3)),
        ("colour:#ff0000", np.flatnonzero(vertices[:, 1].round(6) > 0.3)),
    ):
        (tmp_path / "a.toml").write_text(f"mesh = 'a.obj'\npins = '{rule}'")
        assert GarmentSource.open(tmp_path / "a.toml").cloth_description.pins == tuple(expected.tolist())
    (tmp_path / "a.toml").write_text("mesh = 'a.obj'\npins = 'group:Cuff'")
    with pytest.raises(BadGarment, match="must name vertices; got groups: Collar, Rest"):
        cloth_of(tmp_path / "a.toml")


@pytest.mark.parametrize("mark", [b"\xef\xbb\xbf", "utf-16-le", "utf-16-be"])
def test_byte_order_marks_are_no_part_of_the_first_line(shirt, tmp_path, mark):
    path = write(tmp_path / "a.obj", [("", *shirt)])
    if isinstance(mark, bytes):
        path.write_bytes(mark + path.read_bytes())
    else:
        path.write_bytes(("\ufeff" + path.read_text()).encode(mark))
    assert_is(cloth_of(path), shirt)


def test_decimal_commas_are_read_and_said(shirt, tmp_path):
    path = write(tmp_path / "a.obj", [("", *shirt)])
    path.write_text(path.read_text().replace(".", ","))
    cloth = cloth_of(path)
    assert_is(cloth, shirt)
    assert "decimal commas were read as points" in cloth.notes
