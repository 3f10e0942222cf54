"""A garment that starts tangled: untangled where that can be done, else refused with the place."""

from dataclasses import replace

import numpy as np
import pytest

from hemline import bodies, garments
from hemline.errors import SimulationFailed
from hemline.meshes import self_crossings
from hemline.sim import rest_drape
from hemline.sim.dressed_body import sheet_of
from hemline.sim.tangles import refuse_tangles


@pytest.fixture(scope="module")
def cape():
    return garments.make_cape(bodies.load("anny24").shaped(), rows=30, columns=45, name="napkin")


def turned_up(cape, depth):
    """The cape with its hem turned up behind the back, the edge of it through the cloth."""
    vertices, lowest = cape.vertices.copy(), cape.vertices[:, 1].min()
    share = np.clip(1 - (vertices[:, 1] - lowest) / 0.08, 0, 1)
    behind = (vertices[:, 2] < -0.1) & (np.abs(vertices[:, 0]) < 0.25) & (share > 0)
    vertices[behind, 1] += 2 * 0.08 * share[behind]
    vertices[behind, 2] -= np.float32(0.012) * (1 - share[behind]) - np.float32(depth) * share[behind]
    return replace(cape, vertices=vertices)


def test_a_hem_that_starts_through_the_cloth_is_untangled(cape):
    body = bodies.load("anny24").shaped()
    tangled = turned_up(cape, 0.03)
    assert self_crossings(tangled.vertices, tangled.faces)["pairs"] > 5
    settled = rest_drape(tangled, body)
    assert self_crossings(settled.vertices[0], tangled.faces)["pairs"] == 0
    assert settled.figures["self_crossing_percent"] == 0


def test_what_stays_tangled_is_refused_and_the_place_is_named(cape):
    posed = bodies.load("anny24").shaped().posed(bodies.load("anny24").shaped().rest_pose)
    sheet, nobody = sheet_of(cape), np.zeros(len(cape.vertices), bool)
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
