"""A garment that starts tangled: untangled where that can be done, else refused with the place."""

from dataclasses import replace

import numpy as np
import pytest

from hemline import bodies, garments, motions
from hemline.errors import SimulationFailed
from hemline.meshes import crossing_edges, self_crossings
from hemline.sim import SimSettings, rest_drape, simulate
from hemline.sim.rest.ironing import iron
from hemline.sim.rest.tangles import refuse_tangles
from hemline.sim.step.dressed_body import make_garment_sheet


@pytest.fixture(scope="module")
def cape():
    return garments.make_cape(bodies.load("anny24").shaped(), rows=30, columns=45, name="napkin")


def turn_up(cape, depth):
    """The cape with its hem turned up behind the back, the edge of it through the cloth."""
    vertices, lowest = cape.vertices.copy(), cape.vertices[:, 1].min()
    share = np.clip(1 - (vertices[:, 1] - lowest) / 0.08, 0, 1)
    behind = (vertices[:, 2] < -0.1) & (np.abs(vertices[:, 0]) < 0.25) & (share > 0)
    vertices[behind, 1] += 2 * 0.08 * share[behind]
    vertices[behind, 2] -= np.float32(0.012) * (1 - share[behind]) - np.float32(depth) * share[behind]
    return replace(cape, vertices=vertices)


@pytest.mark.parametrize("depth", [0.025, 0.03, 0.035, 0.04])
def test_a_hem_that_starts_through_the_cloth_is_untangled(cape, depth):
    body = bodies.load("anny24").shaped()
    tangled = turn_up(cape, depth)
    assert self_crossings(tangled.vertices, tangled.faces)["pairs"] > 5
    settled = rest_drape(tangled, body)
    assert self_crossings(settled.vertices[0], tangled.faces)["pairs"] == 0
    assert settled.figures["self_crossing_percent"] == 0


def test_ironing_opens_a_crumple_and_leaves_the_rest_as_it_is(square):
    sheet, positions = square(12)
    faces = sheet.faces.astype(np.int32)
    low, high = positions.min(axis=0), positions.max(axis=0)
    inner, tip = (
        int(np.linalg.norm(positions - low - share * (high - low), axis=1).argmin())
        for share in ([0.3, 0, 0.5], [0.6, 0, 0.5])
    )
    crumpled = positions.copy()
    # one vertex drawn through the wall of a tent beside it
    crumpled[inner, [0, 2]] = positions[tip, [0, 2]]
    crumpled[inner, 1], crumpled[tip, 1] = 0.02, 0.05
    crossed = crossing_edges(crumpled.astype(np.float32), faces)
    assert len(crossed)
    free = np.ones(sheet.vertex_count, bool)
    flat = iron(sheet, crumpled, crossed, free)
    assert not len(crossing_edges(flat.astype(np.float32), faces))
    touched = np.isin(faces, crossed).any(axis=1)
    far = np.setdiff1d(np.arange(sheet.vertex_count), faces[touched])
    assert len(far) and np.array_equal(flat[far], crumpled[far])
    assert np.array_equal(iron(sheet, crumpled, crossed, ~free), crumpled)


def test_what_stays_tangled_is_refused_and_the_place_is_named(cape):
    posed = bodies.load("anny24").shaped().posed(bodies.load("anny24").shaped().rest_pose)
    sheet, nobody = make_garment_sheet(cape), np.zeros(len(cape.vertices), bool)
    settled = rest_drape(cape, bodies.load("anny24").shaped()).vertices[0]
    assert refuse_tangles("cape", sheet, settled, posed, nobody) == 0
    # the left shoulder's cloth pushed through the cloth behind it
    centre = posed.joints[16]
    near = np.linalg.norm(settled - centre, axis=1) < 0.2
    vertices = settled.copy()
    vertices[near] = centre + (vertices[near] - centre) * np.float32([-1, 1, 0.2])
    with pytest.raises(SimulationFailed, match=r"'cape' is tangled: \d+ of \d+ edges .* near the left_\w+ at \("):
        refuse_tangles("cape", sheet, vertices, posed, nobody)
    # where the body cuts through itself, there may be no other place
    assert refuse_tangles("cape", sheet, vertices, posed, near) > 0


def test_a_coarse_cape_that_crosses_itself_in_a_kick_does_not_explode():
    """288 vertices, 6 cm apart: what pulls crossings apart must not feed them."""
    shaped = bodies.load("anny24").shaped()
    napkin = garments.make_cape(shaped, rows=12, columns=24, name="napkin")
    motion = shaped.untangle_motion(shaped.placed(motions.load("kick").resample(30)))[:70]
    take = simulate(napkin, shaped, motion, SimSettings(settle=0.5))
    assert take.failed is None
    # it does cross itself, and comes apart again
    assert 0 < take.figures["self_crossing_percent"] < 4 and take.figures["edge_strain_max"] < 0.4
