"""Garments on rigged characters of unusual proportions, read from their files."""

from dataclasses import replace

import igl
import numpy as np
import pytest

import hemline
from hemline import bodies, garments
from hemline.bodies import own_size
from hemline.meshes import edge_strains
from hemline.tryon import open_garment, try_on
from tests.bodies.character_samples import CUSTOMS, Sample, cartoon, child, write_character

CHARACTERS = {
    "child": Sample(names=CUSTOMS["unity"], body=child(), vrm=1),
    "cartoon": Sample(names=CUSTOMS["mixamo"], body=cartoon(), extra=1, scale=100),
}


@pytest.fixture(scope="module", params=CHARACTERS)
def character(request, tmp_path_factory):
    path = write_character(tmp_path_factory.mktemp("characters") / f"{request.param}.glb", CHARACTERS[request.param])
    return bodies.load(str(path)).shaped()


def test_only_a_body_of_unusual_size_has_a_size_of_its_own(shaped):
    assert own_size(shaped) == own_size(cartoon().shaped()) == 1
    assert 0.7 < own_size(child().shaped()) < 0.75
    generator = np.random.default_rng(5)
    assert all(own_size(shaped.body.shaped(generator.normal(size=16))) == 1 for _ in range(20))


@pytest.mark.slow
def test_a_generated_garment_is_scaled_to_a_child(shaped):
    small, adult = child().shaped(), garments.load("skirt:3", shaped)
    skirt = garments.load("skirt:3", replace(small, body=replace(small.body, name="child")))
    length = [np.ptp(each.vertices[:, 1]) for each in (skirt, adult)]
    assert length[0] == pytest.approx(own_size(small) * length[1], rel=0.05)
    assert skirt.vertices[:, 1].min() > small.vertices[:, 1].min()
    # the floor was reached by the adult's length
    assert length[1] > skirt.vertices[:, 1].max() - small.vertices[:, 1].min()


def test_an_adults_shirt_is_worn_around_arms_and_trunk(character, mesh_of):
    tried = try_on(mesh_of("makehuman_cc0/f_tshirt.obj"), character)
    assert tried.fitness.reason is None and tried.alignment.through == () and tried.alignment.empty == 0


@pytest.mark.slow
def test_a_skirt_and_a_shirt_are_played_on_it(character, mesh_of):
    # the shirt has wide triangles, whose edges are stretched around shoulders
    for name, most in (("skirt:3", 0.15), (mesh_of("makehuman_cc0/f_tshirt.obj"), 0.5)):
        garment = open_garment(name, character)
        frames = list(
            hemline.play(
                hemline.load("live").animator_for(garment, character), character, hemline.motions.load("walk")[:30]
            )
        )
        for frame in frames[::5]:
            skin, faces = frame.body.vertices.astype(np.float64), frame.body.faces.astype(np.int64)
            inside = igl.winding_number(skin, faces, frame.vertices.astype(np.float64)) > 0.5
            assert not np.delete(inside, frame.report.pinched).any()
        assert np.percentile(edge_strains(frames[-1].vertices, garment.faces, garment.rest_edges), 99) < most
