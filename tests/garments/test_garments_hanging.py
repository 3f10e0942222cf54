"""What a garment hangs from, and how much of it hangs."""

from functools import cache

import numpy as np
import pytest

from hemline import bodies, garments
from hemline.garments.generate import Design, generate_garment
from hemline.garments.hanging import HANGING_DISTANCE, LITTLE_HANGS, MOSTLY_HANGS, hanging_percent
from hemline.garments.shoulders import carried_by_shoulders
from hemline.garments.upper_rim import upper_rim
from hemline.meshes import boundary_loops


@cache
def shaped():
    return bodies.load("anny24").shaped()


@cache
def garment(name):
    return garments.load(name)


def sheet(rows, columns, *, slope):
    """A sheet of 10 cm squares that falls by `slope` a row."""
    row, column = np.divmod(np.arange(rows * columns), columns)
    vertices = np.stack([0.1 * column, -slope * row, 0.1 * row], axis=1)
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:]
    faces = np.concatenate([np.stack([a, c, b], -1).reshape(-1, 3), np.stack([b, c, d], -1).reshape(-1, 3)])
    return vertices, faces.astype(np.int32)


def test_the_upper_rim_of_a_sheet_that_hangs_is_its_upper_edge_in_order():
    vertices, faces = sheet(6, 5, slope=0.08)
    rim = upper_rim(vertices, faces)
    # 10 cm down from the top edge: that edge, and the second row's two ends
    assert sorted(rim.tolist()) == [0, 1, 2, 3, 4, 5, 9]
    steps = np.abs(np.diff(vertices[rim], axis=0)).max(axis=1)
    np.testing.assert_allclose(steps, 0.1)
    assert {int(rim[0]), int(rim[-1])} == {5, 9}
    flat, _ = sheet(6, 5, slope=0.02)
    assert len(upper_rim(flat, faces)) == len(boundary_loops(faces)[0])
    assert len(upper_rim(vertices[:4], np.array([[0, 1, 2], [0, 3, 1], [1, 3, 2], [0, 2, 3]], np.int32))) == 0


def test_the_rim_of_a_skirt_is_its_waist_and_that_of_a_shirt_its_neckline():
    for name in ("skirt-light", "tshirt-light"):
        rim = upper_rim(garment(name).vertices, garment(name).faces)
        loops = [set(loop.tolist()) for loop in boundary_loops(garment(name).faces)]
        assert set(rim.tolist()) in loops
        heights = garment(name).vertices[:, 1]
        assert heights[rim].max() == max(heights[list(loop)].max() for loop in loops)


def test_shoulders_carry_what_has_openings_for_head_and_arms():
    shirt = generate_garment(Design(kind="top"), shaped(), edge=0.045)
    assert carried_by_shoulders(shirt.vertices, shirt.faces, shaped())
    assert not carried_by_shoulders(shirt.vertices - [0, 0.3, 0], shirt.faces, shaped())
    cape, skirt = garment("cape-light"), garment("skirt-light")
    assert not carried_by_shoulders(cape.vertices, cape.faces, shaped())
    assert not carried_by_shoulders(skirt.vertices, skirt.faces, shaped())


def test_nothing_of_a_shirt_hangs_and_most_of_a_cape():
    for name in ("tshirt-light", "longsleeve-light", "trousers-light"):
        assert hanging_percent(garment(name).vertices, garment(name).faces, shaped()) < LITTLE_HANGS
    for name in ("cape-light", "skirt-light"):
        assert hanging_percent(garment(name).vertices, garment(name).faces, shaped()) > MOSTLY_HANGS


def test_cloth_hangs_from_five_centimetres_off_the_skin():
    body = shaped()
    faces = body.body.faces
    near, far = (body.vertices + height * body.normals for height in (0.8 * HANGING_DISTANCE, 1.6 * HANGING_DISTANCE))
    assert hanging_percent(near, faces, body) == pytest.approx(0, abs=0.5)
    assert hanging_percent(far, faces, body) > 70  # in armpits and between the legs other skin is nearer
