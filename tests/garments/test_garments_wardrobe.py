"""Clothes that ship by name, in two sizes."""

import igl
import numpy as np
import pytest

from hemline import bodies, garments
from hemline.errors import BadGarment
from hemline.garments.proxy.subdivide_garment import subdivide_garment
from hemline.meshes import boundary_loops, edge_lengths, self_crossings

SIZES = {"tshirt": (3150, 12414), "longsleeve": (4910, 19454), "trousers": (3485, 13819), "dress": (5964, 23574)}
OPENINGS = {"tshirt": 4, "longsleeve": 4, "trousers": 3, "dress": 4}


NAMES = [name + size for name in SIZES for size in ("", "-light")]


def test_all_have_a_light_and_a_paper_size():
    assert set(NAMES) < set(garments.names())


@pytest.mark.parametrize("name", SIZES)
def test_sizes_openings_and_cut(name):
    light, paper = garments.load(f"{name}-light"), garments.load(name)
    assert (len(light.vertices), len(paper.vertices)) == SIZES[name]
    # Euler: a sphere with so many holes has V + F - 2 + holes edges, each with a middle
    edges = len(light.vertices) + len(light.faces) - 2 + OPENINGS[name]
    assert len(paper.vertices) == len(light.vertices) + edges
    assert len(boundary_loops(light.faces)) == len(boundary_loops(paper.faces)) == OPENINGS[name]
    assert len(paper.faces) == 4 * len(light.faces) and light.name == f"{name}-light" and paper.name == name
    # the same cut: as much cloth, every edge half as long
    area = [np.linalg.det(each.rest_edges).sum() / 2 for each in (light, paper)]
    assert area[1] == pytest.approx(area[0], rel=1e-9)
    halves = np.sort(edge_lengths(paper.rest_edges).reshape(-1, 4, 3), axis=2)
    assert halves == pytest.approx(np.sort(edge_lengths(light.rest_edges), axis=1)[:, None] / 2 + 0 * halves, rel=1e-6)
    assert "made of" in light.notes[0] and light.flat_rest


@pytest.mark.parametrize("name", NAMES)
def test_starts_outside_the_body_and_untangled(name, shaped):
    garment = garments.load(name)
    faces = shaped.body.faces.astype(np.int64)
    winding = igl.fast_winding_number(shaped.vertices.astype(float), faces, garment.vertices.astype(float))
    assert (winding < 0.5).all()
    assert self_crossings(garment.vertices, garment.faces)["edge_percent"] < 0.1


def test_pins_are_at_the_waist_of_trousers_and_nowhere_else():
    counts = {name: len(garments.load(f"{name}-light").pins) for name in SIZES}
    assert counts["trousers"] == 52 and [counts[name] for name in ("tshirt", "longsleeve", "dress")] == [0, 0, 0]


def test_a_finer_garment_pins_middles_between_pins_to_the_skin(shaped):
    light = garments.load("trousers-light")
    paper = subdivide_garment(light, shaped)
    rim = max(boundary_loops(paper.faces), key=lambda loop: paper.vertices[loop, 1].mean())
    assert set(paper.pins.vertices) == set(rim) and len(rim) == 104
    at = paper.pins.positions(shaped.vertices, shaped.normals, shaped.body.faces, shaped.joints)
    assert paper.vertices[paper.pins.vertices] == pytest.approx(at, abs=2e-6)


def test_clothes_follow_the_shape_of_the_body():
    heavy = bodies.load("anny24").shaped((2.0,))
    worn = garments.load("dress", heavy)
    assert np.array_equal(worn.body_betas, heavy.betas) and len(worn.vertices) == SIZES["dress"][1]
    winding = igl.fast_winding_number(
        heavy.vertices.astype(float), heavy.body.faces.astype(np.int64), worn.vertices.astype(float)
    )
    assert (winding < 0.5).all()


def test_another_body_is_refused_with_the_way_out(shaped):
    from dataclasses import replace

    other = replace(shaped, body=replace(shaped.body, name="somebody"))
    with pytest.raises(BadGarment, match="'dress' was made on anny24; got a body called somebody; try its mesh on"):
        garments.load("dress", other)
