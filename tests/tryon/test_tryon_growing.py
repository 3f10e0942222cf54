"""Meshes of other makers, laid on a body that grows inside them: where they lie before gravity."""

import numpy as np
import pytest

from hemline import garments
from hemline.garments.reading.garment_toml import GarmentFile
from hemline.garments.reading.source import GarmentSource
from hemline.meshes import edge_strains
from hemline.tryon import try_on
from hemline.tryon.alignment import align
from hemline.tryon.growing import grow
from hemline.tryon.try_on import loose_garment


def laid(path, shaped):
    """A mesh as it is in its file, and where it is laid on the body."""
    cloth = GarmentSource.open(path).cloth
    return cloth, align(cloth.vertices, cloth.faces, shaped)


@pytest.mark.data
@pytest.mark.parametrize(
    ("name", "scale"),
    [
        # without the cost of openings that nothing goes through it lies 0.8 m too high, around the chest
        ("style3d_bsd3/skirt_12k.obj", 1.06),
        # without that of limbs through cloth the arms are beside the sleeves
        ("style3d_bsd3/h1_jacket_12k.obj", 1.0),
    ],
)
def test_limbs_are_laid_through_openings_and_not_through_cloth(shaped, mesh_of, name, scale):
    _, alignment = laid(mesh_of(name), shaped)
    assert alignment.through == () and alignment.empty == 0 and alignment.rims > 1 and alignment.up == "y"
    assert alignment.scale == pytest.approx(scale, abs=0.03)


def test_cloth_without_openings_is_laid_near_the_body(shaped):
    cape = garments.load("cape-light")
    alignment = align(cape.vertices - (0, 0, 0.15), cape.faces, shaped)
    assert alignment.rims == 0 and alignment.up == "y"
    assert np.linalg.norm(alignment.vertices - cape.vertices, axis=1).mean() < 0.01


@pytest.mark.slow
@pytest.mark.data
@pytest.mark.parametrize("name", ["style3d_bsd3/h1_jacket_12k.obj", "makehuman_cc0/f_shorts.obj"])
def test_a_mesh_with_z_up_is_laid_as_it_would_be_with_y_up(shaped, mesh_of, name):
    cloth, expected = laid(mesh_of(name), shaped)
    z_up = cloth.vertices[:, [0, 2, 1]] * (1, -1, 1)
    found = align(z_up, cloth.faces, shaped)
    assert (found.up, expected.up) == ("z", "y")
    assert np.array_equal(found.vertices, expected.vertices)


def test_a_cape_with_z_up_is_turned_unless_y_is_declared(shaped):
    cape = garments.load("cape-light")
    z_up = (cape.vertices - (0, 0, 0.15))[:, [0, 2, 1]] * (1, -1, 1)
    found = align(z_up, cape.faces, shaped)
    assert found.up == "z" and np.linalg.norm(found.vertices - cape.vertices, axis=1).mean() < 0.01
    assert align(z_up, cape.faces, shaped, up="y").up == "y"


@pytest.mark.data
@pytest.mark.parametrize(
    ("name", "girths", "longest"),
    [
        # begun at its full girth, not grown, or not turned, the body tears and tangles it
        ("makehuman_cc0/tshirt06.obj", (0.3,), 0.4),
        # panels that stand around the body: not sewn first, they go through each other. 15 or 16 vertices of the mesh
        # are inside the body where the rounding of a processor lays them, and 15 may be
        ("garmentcode_mit/pants_mean_female.obj", (0.8, 1.0), 0.4),
    ],
)
def test_the_body_grows_into_cloth_without_tangling_or_tearing_it(shaped, mesh_of, name, girths, longest):
    path = mesh_of(name)
    cloth, alignment = laid(path, shaped)
    garment = loose_garment(cloth, GarmentFile(mesh=path.name), shaped, alignment)
    result = grow(garment, shaped, alignment)
    strain = np.abs(edge_strains(result.vertices.astype(np.float32), garment.faces, garment.rest_edges))
    assert result.girth in girths and result.crossed_after == 0
    assert np.median(strain) < 0.01 and strain.max() < longest


@pytest.mark.slow
def test_triangles_wound_at_odds_are_turned_outward_aloud(shaped, worn, as_obj):
    trousers = worn["trousers"]
    turned = np.random.default_rng(1).random(len(trousers.faces)) < 0.9
    faces = np.where(turned[:, None], trousers.faces[:, [0, 2, 1]], trousers.faces)
    tried = try_on(as_obj("trousers", trousers.vertices, faces), shaped)
    assert tried.fitness.reason is None
    notes = tried.garment.notes
    assert f"winding: {(~turned).sum()} triangles were turned to agree with their neighbours" in notes
    assert "winding: all triangles were turned to face away from the body" in notes
    assert np.array_equal(np.sort(tried.garment.faces, axis=1), np.sort(trousers.faces, axis=1))
    smallest = tried.garment.faces.argmin(axis=1)
    first = np.take_along_axis(tried.garment.faces, (smallest[:, None] + np.arange(3)) % 3, axis=1)
    own = trousers.faces.argmin(axis=1)
    assert np.array_equal(first, np.take_along_axis(trousers.faces, (own[:, None] + np.arange(3)) % 3, axis=1))
