"""A garment over another: no vertex of it behind the cloth beneath, and nothing moved where they are apart."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from hemline import bodies, garments
from hemline.collide import GarmentOnBody, LayeredProjector, inside, winding_numbers
from hemline.collide.layers.closed_cloth import ClosedCloth
from hemline.collide.surface.patches import make_patches
from hemline.meshes import ClosestTree, boundary_loops, vertex_normals


@cache
def trousers():
    """The body, the trousers on it, and their normals."""
    shaped, cloth = bodies.load("anny24").shaped(), garments.load("trousers-light")
    return shaped, cloth, vertex_normals(cloth.vertices, cloth.faces).astype(np.float32)


def lifted(heights, name="over"):
    """The trousers once more, at heights over themselves [m]."""
    _, cloth, normals = trousers()
    return replace(cloth, vertices=cloth.vertices + np.asarray(heights, np.float32).reshape(-1, 1) * normals, name=name)


@cache
def make_patches_once():
    return make_patches(trousers()[0])


def uneven(count, seed=0, low=-0.01, high=0.004):
    return np.random.default_rng(seed).uniform(low, high, count)


def projected(pieces, *, thickness=0.0015, whole=False):
    """Pieces in the rest pose, each where its own vertices are, after one frame; the bounds of each."""
    shaped = trousers()[0]
    vertices = np.concatenate([piece.vertices for piece in pieces])
    worn = GarmentOnBody.of(shaped, vertices, patches=make_patches_once())
    held = tuple(whole for _ in pieces)
    projector = LayeredProjector.prepare(shaped, pieces, worn, thickness=thickness, whole=held, cover=whole)
    posed = shaped.posed(shaped.rest_pose)
    _, out, report = projector.project(projector.start(), posed, vertices, dt=1 / 30)
    return [out[low:high] for low, high in zip(projector.bounds, projector.bounds[1:], strict=False)], report


def crossings(points, ways, vertices, faces):
    """How often each ray leaves an open surface less how often it enters it: Möller and Trumbore, all against all."""
    a, b, c = (vertices[faces[:, corner]].astype(np.float64) for corner in range(3))
    one, two = b - a, c - a
    count = np.zeros(len(points), int)
    for i, (point, way) in enumerate(zip(points, ways, strict=True)):
        across = np.cross(way, two)
        share = (one * across).sum(axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            u = ((point - a) * across).sum(axis=1) / share
            other = np.cross(point - a, one)
            v, t = other @ way / share, (two * other).sum(axis=1) / share
        hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)
        count[i] = np.sign((np.cross(one, two) @ way)[hit]).sum()
    return count


def test_lids_close_a_garment_so_that_beneath_its_cloth_is_inside():
    shaped, cloth, normals = trousers()
    closed = ClosedCloth.of(len(cloth.vertices), cloth.faces)
    vertices = closed.vertices(cloth.vertices)
    assert len(vertices) == len(cloth.vertices) + sum(len(rim) + 1 for rim in boundary_loops(cloth.faces))
    make_patches(closed.as_body(shaped, cloth.vertices))  # refuses what is not closed
    middle, out = cloth.vertices[cloth.faces].mean(axis=1), normals[cloth.faces].mean(axis=1)
    for height, number in ((-0.001, 1), (0.001, 0)):
        found = winding_numbers(vertices, closed.faces, middle + height * out)
        assert (found == number).mean() > 0.98  # folds turn a few


@pytest.mark.parametrize("whole", [False, True])
def test_rays_outward_from_a_garment_do_not_leave_the_cloth_beneath(whole):
    shaped, cloth, _ = trousers()
    (beneath, out), report = projected((cloth, lifted(uneven(len(cloth.vertices)))), whole=whole)
    rims = np.concatenate(boundary_loops(cloth.faces))
    far = np.linalg.norm(out[:, None] - beneath[rims][None], axis=2).min(axis=1) > 0.05
    chosen = np.flatnonzero(far)[::7]
    skin = ClosestTree(shaped.vertices.astype(np.float64), shaped.body.faces).closest(out[chosen])
    ways = out[chosen] - skin.positions
    before = lifted(uneven(len(cloth.vertices))).vertices[chosen]
    assert (crossings(before, ways, beneath, cloth.faces) > 0).mean() > 0.4
    kept = ~np.isin(chosen + len(cloth.vertices), report.caught)
    assert kept.mean() > 0.99
    assert (crossings(out[chosen], ways, beneath, cloth.faces)[kept] <= 0).all()


def test_what_is_left_behind_is_what_the_report_names_and_none_is_inside_the_body():
    shaped, cloth, _ = trousers()
    (beneath, out), report = projected((cloth, lifted(uneven(len(cloth.vertices), seed=1, low=-0.03))), whole=True)
    closed = ClosedCloth.of(len(beneath), cloth.faces)
    behind = np.flatnonzero(inside(closed.vertices(beneath), closed.faces, out)) + len(beneath)
    np.testing.assert_array_equal(behind, report.caught)
    buried = np.flatnonzero(inside(shaped.vertices, shaped.body.faces, np.concatenate([beneath, out])))
    assert np.isin(buried, report.pinched).all()


def test_where_garments_are_apart_nothing_is_moved():
    _, cloth, _ = trousers()
    outer = lifted(np.full(len(cloth.vertices), 0.02))
    # legs are two centimetres and more apart where the outer one is looked at
    away = np.abs(outer.vertices[:, 0]) > 0.12
    (_, out), report = projected((cloth, outer))
    np.testing.assert_array_equal(out[away], outer.vertices[away])
    (_, out), report = projected((cloth, outer), whole=True)
    np.testing.assert_allclose(out[away], outer.vertices[away], atol=1e-6)
    assert not len(report.caught)


@pytest.mark.parametrize("thickness", [0.001, 0.004])
def test_what_was_behind_ends_a_thickness_in_front(thickness):
    _, cloth, _ = trousers()
    (beneath, out), _ = projected((cloth, lifted(np.full(len(cloth.vertices), -0.004))), thickness=thickness)
    distances = ClosestTree(beneath.astype(np.float64), cloth.faces).closest(out).distances
    assert np.percentile(distances, 2) > 0.95 * thickness
    assert np.median(distances) < 3 * thickness + 0.001


def test_the_order_says_which_garment_is_outside():
    _, cloth, normals = trousers()
    one, other = lifted(np.zeros(len(cloth.vertices)), "one"), lifted(np.full(len(cloth.vertices), 0.0004), "other")
    for pieces, sign in (((one, other), 1), ((other, one), -1)):
        (beneath, out), _ = projected(pieces)
        above = ((out - beneath) * normals).sum(axis=1)
        assert np.median(above) > 0.001
        moved = np.abs(beneath - pieces[0].vertices).max(axis=1) > 0
        assert moved.mean() < 0.5, sign  # the inner one is left to the body


def test_a_third_garment_is_out_of_both():
    _, cloth, _ = trousers()
    pieces = cloth, lifted(uneven(len(cloth.vertices), 2), "second"), lifted(uneven(len(cloth.vertices), 3), "third")
    (first, second, third), report = projected(pieces)
    for beneath in (first, second):
        closed = ClosedCloth.of(len(beneath), cloth.faces)
        behind = np.flatnonzero(inside(closed.vertices(beneath), closed.faces, third)) + 2 * len(first)
        assert np.isin(behind, report.caught).all()
    assert len(report.caught) < 0.03 * len(first)


def test_the_state_is_not_changed_and_the_same_frame_has_the_same_bits():
    shaped, cloth, _ = trousers()
    outer = lifted(uneven(len(cloth.vertices)))
    vertices = np.concatenate([cloth.vertices, outer.vertices])
    worn = GarmentOnBody.of(shaped, vertices, patches=make_patches_once())
    projector = LayeredProjector.prepare(shaped, (cloth, outer), worn, whole=(False, True))
    posed, state = shaped.posed(shaped.rest_pose), projector.start()
    once, twice = (projector.project(state, posed, vertices, dt=1 / 30)[1] for _ in range(2))
    np.testing.assert_array_equal(once, twice)
