"""Generated garments: whole, even, as long and wide as asked, outside the body, worn."""

from dataclasses import replace

import numpy as np
import pytest

from hemline import bodies, garments
from hemline.errors import BadGarment, BadInput
from hemline.garments.dressing import body_tree
from hemline.garments.generate import KINDS, Design, generate_garment, plain_design, random_design, write_with_toml
from hemline.garments.generate.lines import lines_of
from hemline.meshes import boundary_loops, check_mesh, components, crossing_edges, edges, face_areas
from hemline.tryon import fitness

EDGE = 0.045
RIMS = {"top": 4, "dress": 4, "skirt": 2, "trousers": 3, "jumpsuit": 5}


@pytest.fixture(scope="module")
def shaped():
    return bodies.load("anny24").shaped()


@pytest.fixture(scope="module")
def each(shaped):
    """A plain one of each kind."""
    return {kind: generate_garment(plain_design(kind), shaped, edge=EDGE) for kind in KINDS}


def area(garment):
    return float(face_areas(garment.vertices, garment.faces).sum())


@pytest.mark.parametrize("kind", KINDS)
def test_it_is_one_whole_piece_with_the_openings_of_its_kind(kind, each):
    garment = each[kind]
    check_mesh(garment.vertices, garment.faces, name=kind)
    assert components(garment.faces, len(garment.vertices)).max() == 0
    assert len(boundary_loops(garment.faces)) == RIMS[kind]
    assert len(garment.vertices) - len(edges(garment.faces)) + len(garment.faces) == 2 - RIMS[kind]
    assert len(crossing_edges(garment.vertices, garment.faces)) == 0


@pytest.mark.parametrize("kind", KINDS)
def test_its_triangles_are_even_and_their_cut_is_as_large_as_the_cloth(kind, each):
    garment = each[kind]
    start, end = edges(garment.faces).T
    length = np.linalg.norm(garment.vertices[start] - garment.vertices[end], axis=1) / EDGE
    assert np.median(length) == pytest.approx(1, abs=0.06)
    assert np.percentile(length, 1) > 0.65 and np.percentile(length, 99) < 1.55
    cut = np.abs(np.linalg.det(garment.rest_edges)).sum() / 2
    assert cut == pytest.approx(area(garment), rel=0.01)


@pytest.mark.parametrize("kind", KINDS)
def test_it_is_outside_the_body_and_the_same_on_both_sides(kind, each, shaped):
    garment = each[kind]
    assert body_tree(shaped).signed_distances(garment.vertices.astype(float)).min() > 0.0008
    image = garment.vertices * np.float32([-1, 1, 1])
    nearest = np.linalg.norm(image[:, None] - garment.vertices, axis=2).min(axis=1)
    assert nearest.max() < 0.002


@pytest.mark.parametrize("kind", KINDS)
def test_the_hem_is_as_far_below_the_top_as_asked(kind, each, shaped):
    lines = lines_of(plain_design(kind), shaped)
    assert lines.top - lines.hem == pytest.approx(plain_design(kind).length)
    assert each[kind].vertices[:, 1].min() == pytest.approx(lines.hem, abs=0.004)


@pytest.mark.parametrize("kind", KINDS)
def test_it_settles_and_stays_on(kind, each, shaped):
    found = fitness(each[kind], shaped)
    assert found.reason is None and found.figures["inside"] == 0


def test_skirts_and_trousers_are_pinned_at_the_waistband_and_others_nowhere(each):
    for kind in ("skirt", "trousers"):
        garment = each[kind]
        highest = max(boundary_loops(garment.faces), key=lambda loop: garment.vertices[loop, 1].mean())
        assert set(garment.pins.vertices.tolist()) == set(highest.tolist())
        assert garment.pins.heights.max() < 0.04
    assert not any(len(each[kind].pins) for kind in ("top", "dress", "jumpsuit"))


def test_more_length_width_or_flare_is_more_cloth(shaped, each):
    plain = plain_design("skirt")
    for change in ({"length": 0.75}, {"ease": 0.3, "flare": 0.35}):
        assert area(generate_garment(replace(plain, **change), shaped, edge=EDGE)) > 1.03 * area(each["skirt"])


def test_the_same_name_gives_the_same_bits_and_seeds_differ(shaped):
    garment = garments.load("skirt:4@45")
    assert garment.name == "skirt-4"
    assert garment.hash == generate_garment(random_design("skirt", 4), shaped, edge=EDGE).hash
    assert garments.load("skirt:4@45", shaped).hash == garment.hash
    assert random_design("dress", 3) == random_design("dress", 3) != random_design("dress", 4)


@pytest.mark.parametrize("kind", ["top", "trousers", "skirt"])
def test_a_close_design_is_the_same_one_nearer_to_the_skin(kind, shaped):
    from hemline.meshes import ClosestTree

    plain, close = garments.load(f"{kind}:4@45"), garments.load(f"close-{kind}:4@45")
    assert close.name == f"close-{kind}-4" and close.material == plain.material
    tree = ClosestTree(shaped.vertices, shaped.body.faces)
    far = [tree.closest(each.vertices.astype(float)).distances.mean() for each in (plain, close)]
    assert far[1] < 0.85 * far[0], far


def test_another_edge_gives_the_same_shape(shaped, each):
    from hemline.meshes import ClosestTree

    fine = generate_garment(plain_design("top"), shaped, edge=0.025)
    tree = ClosestTree(fine.vertices.astype(float), fine.faces)
    away = tree.closest(each["top"].vertices.astype(float)).distances
    assert np.percentile(away, 95) < 0.002 and away.max() < 0.006


def test_a_number_of_vertices_is_met(shaped):
    garment = generate_garment(plain_design("trousers"), shaped, vertex_count=900)
    assert len(garment.vertices) == pytest.approx(900, rel=0.03)


def test_an_obj_with_its_toml_reads_back_as_the_same_cloth(tmp_path, each, shaped):
    table = write_with_toml(tmp_path / "mine.obj", each["skirt"])
    back = garments.read(table, shaped)
    assert np.allclose(back.vertices, each["skirt"].vertices, atol=1e-4)
    assert (back.faces == each["skirt"].faces).all() and back.material == each["skirt"].material
    assert set(back.pins.vertices.tolist()) == set(each["skirt"].pins.vertices.tolist())


@pytest.mark.parametrize("name", ["dress:", "dress:x", "dress:7@4", "dress:7@90", "dress:-1", "top:1@", "close-dress:"])
def test_names_that_cannot_be_read_are_refused(name):
    with pytest.raises(BadGarment, match="name cannot be read.*KIND:SEED"):
        garments.load(name)


@pytest.mark.parametrize(
    ("measures", "said"),
    [
        ({"kind": "kilt"}, "unknown kind.*'kilt'.*use one of top"),
        ({"neckline": "boat"}, "unknown neckline.*'boat'"),
        ({"material": "steel"}, "unknown material.*'steel'"),
        ({"length": 3.0}, r"length of a garment must be from 0\.15 to 1\.45"),
        ({"flare": float("nan")}, "flare of a garment must be from 0 to 0.8"),
        ({"ease": True}, "ease of a garment"),
    ],
)
def test_measures_that_cannot_be_cut_are_refused(measures, said):
    with pytest.raises(BadInput, match=said):
        Design(**({"kind": "top"} | measures))


@pytest.mark.parametrize("size", [{"edge": 0.001}, {"edge": 0.2}, {"vertex_count": 0}, {"vertex_count": 10**7}])
def test_sizes_that_cannot_be_made_are_refused(size, shaped):
    with pytest.raises(BadInput, match="generated garment must"):
        generate_garment(Design("skirt"), shaped, **size)
