"""Kernels of the whole-cloth step against plain NumPy and against other ways to the same number."""

import numpy as np

from hemline import garments
from hemline.collide import GarmentOnBody, WholeCloth, WholeSettings
from hemline.collide.whole.limit_kernels import PUSH, carry_vertices, decay_shifts, limit_coarse, limit_fine
from hemline.collide.whole.models import coarse_model, fine_model
from hemline.collide.whole.plane_kernels import (
    HalfSpaces,
    Samples,
    ShiftedCloth,
    constrain_samples,
    fill_cells,
    grid_around,
)
from hemline.meshes import ClosestTree, geodesic_distances, rest_lengths
from tests.collide.projection_samples import clip
from tests.collide.whole_samples import DT, RADIUS, at, prepared, sheet

NO_PINS = np.zeros(0, np.int64)


def model_of(garment, controls=60, samples=150, pins=NO_PINS):
    return coarse_model(garment.vertices, garment.faces, garment.rest_edges, pins, controls, samples)


def test_shifts_fade_exponentially_when_small_and_steadily_when_large():
    shifts = np.float32([[0.001, 0, 0], [0, 0.2, 0], [0, 0, 0]])
    left = np.empty_like(shifts)
    decay_shifts(shifts, np.float32(np.exp(-DT / 0.1)), np.float32(0.36 * DT), left)
    np.testing.assert_allclose(left[0], shifts[0] * np.exp(-DT / 0.1), rtol=1e-6)
    np.testing.assert_allclose(left[1], [0, 0.2 - 0.36 * DT, 0], rtol=1e-6)
    assert (left[2] == 0).all()


def test_weights_are_a_partition_that_is_one_at_a_control_vertex():
    garment = sheet()
    model = model_of(garment)
    np.testing.assert_allclose(model.weights.sum(axis=1), 1, atol=1e-6)
    assert (model.weights >= 0).all()
    shifts = np.random.default_rng(0).normal(size=(60, 3)).astype(np.float32)
    moved, carried = np.empty_like(garment.vertices), np.empty_like(garment.vertices)
    rest = np.random.default_rng(1).normal(size=garment.vertices.shape).astype(np.float32)
    carry_vertices(ShiftedCloth(garment.vertices, shifts), model, rest, np.float32(0.5), moved, carried)
    expected = garment.vertices + np.einsum("vk,vkx->vx", model.weights, shifts[model.weight_ids])
    np.testing.assert_allclose(carried, expected, atol=1e-6)
    np.testing.assert_allclose(moved, expected + 0.5 * rest, atol=1e-6)


def test_coarse_edges_join_neighbouring_cells_at_their_distance_along_the_cloth():
    garment = sheet()
    model = model_of(garment)
    for edge, length in list(zip(model.edges, model.lengths, strict=True))[::7]:
        one, other = model.controls[edge]
        ways = geodesic_distances(garment.vertices, garment.faces, [one], rest_edges=garment.rest_edges)
        assert abs(ways[other] - length) < 1e-5
        assert length >= np.linalg.norm(garment.vertices[one] - garment.vertices[other]) - 1e-5
    assert len(model.edges) > 2 * len(model.controls)  # a triangulation has three a vertex, less its rim
    assert len(np.unique(model.edges)) == len(model.controls)


def test_every_control_vertex_of_a_garment_in_several_pieces_has_its_own_piece():
    garment = sheet(count=11)
    two = np.concatenate([garment.vertices, garment.vertices + [1, 0, 0]]).astype(np.float32)
    faces = np.concatenate([garment.faces, garment.faces + len(garment.vertices)])
    model = coarse_model(two, faces, np.concatenate([garment.rest_edges] * 2), NO_PINS, 20, 20)
    piece = np.arange(len(two)) >= len(garment.vertices)
    used = model.weights > 0
    assert (piece[model.controls][model.weight_ids][used] == np.repeat(piece[:, None], 4, 1)[used]).all()


def plain_coarse(points, model, planes, held, sweeps, shifts):
    shifts = shifts.astype(float).copy()
    controls = points[model.controls].astype(float)
    for sweep in range(sweeps):
        for e in range(len(model.edges))[:: 1 if sweep % 2 == 0 else -1]:
            a, b = model.edges[e]
            along = controls[b] + shifts[b] - controls[a] - shifts[a]
            length, free = np.linalg.norm(along), model.free[[a, b]]
            if length > model.lengths[e]:
                pull = (length - model.lengths[e]) / length / max(free.sum(), 1)
                shifts[a] += pull * free[0] * along
                shifts[b] -= pull * free[1] * along
        for s in held:
            ids, weights = model.weight_ids[model.samples[s]], model.weights[model.samples[s]].astype(float)
            depth = planes[s, 3] - planes[s, :3] @ (points[model.samples[s]] + weights @ shifts[ids])
            if depth > 0:
                for c, w in zip(ids, weights, strict=True):
                    shifts[c] += PUSH * depth * w / (weights @ weights) * model.free[c] * planes[s, :3]
    return shifts


def test_coarse_sweeps_are_those_of_plain_numpy():
    garment = sheet(pinned=range(41))
    model = model_of(garment, pins=np.arange(41))
    assert 0 < (model.free == 0).sum() < 20
    random = np.random.default_rng(2)
    points = (1.1 * garment.vertices + random.normal(0, 0.01, garment.vertices.shape)).astype(np.float32)
    normal = random.normal(size=(150, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    height = (normal * points[model.samples]).sum(axis=1, keepdims=True) + random.normal(0, 0.02, (150, 1))
    planes = np.concatenate([normal, height], axis=1).astype(np.float32)
    held, shifts = np.arange(0, 150, 3), random.normal(0, 0.01, (60, 3)).astype(np.float32)
    expected = plain_coarse(points, model, planes.astype(float), held, 3, shifts)
    limit_coarse(points, model, planes, held, 3, shifts)
    np.testing.assert_allclose(shifts, expected, atol=2e-5)


def test_fine_sweeps_end_where_no_edge_is_too_long_and_pins_stay():
    garment = sheet()
    pins = np.arange(41)
    model = fine_model(garment.faces, garment.rest_edges, pins)
    edges, lengths = rest_lengths(garment.faces, garment.rest_edges)
    inner = ~np.isin(edges, pins).all(axis=1)
    assert sorted(map(tuple, model.edges)) == sorted(map(tuple, edges[inner]))
    moved = (1.12 * garment.vertices).astype(np.float32)
    moved[pins] = garment.vertices[pins]
    limit_fine(model, np.float32(1.06), 2000, moved)
    along = np.linalg.norm(moved[edges[inner, 1]] - moved[edges[inner, 0]], axis=1)
    assert (along / lengths[inner]).max() < 1.07
    assert (moved[pins] == garment.vertices[pins]).all()
    assert limit_fine(model, np.float32(1.08), 4, moved) == 0  # nothing to do, nothing done


def test_blocks_that_are_skipped_had_nothing_to_do():
    """Sweeps over all blocks, each time, by plain NumPy: after enough sweeps both leave no edge too long."""
    garment = sheet(count=21)
    model = fine_model(garment.faces, garment.rest_edges, NO_PINS)
    moved = garment.vertices.copy()
    moved[200] += np.float32([0, 0.05, 0])  # one vertex far off: work spreads from there
    limit_fine(model, np.float32(1.02), 400, moved)
    along = np.linalg.norm(moved[model.edges[:, 1]] - moved[model.edges[:, 0]], axis=1)
    assert (along / model.lengths).max() < 1.0205


def test_cells_are_set_where_a_widened_box_is():
    boxes = np.float32([[0.1, 0.5], [0.1, 0.5], [0.1, 0.5], [0.2, 0.6], [0.3, 0.6], [0.2, 0.6]])
    cells = np.zeros((14, 14, 14), np.uint32)
    fill_cells(boxes, np.uint32([1, 2]), np.float32([0, 0, 0]), np.float32(0.05), np.float32(0.02), cells)
    low, high = np.indices(cells.shape) * 0.05, (np.indices(cells.shape) + 1) * 0.05
    for k, bit in enumerate((1, 2)):
        met = np.ones(cells.shape, bool)
        for axis in range(3):
            met &= (high[axis] > boxes[axis, k] - 0.02) & (low[axis] < boxes[axis + 3, k] + 0.02)
        assert ((cells & bit > 0) == met).all()


def test_the_grid_reaches_around_all_boxes():
    boxes = np.random.default_rng(0).uniform(-1, 1, (6, 7)).astype(np.float32)
    boxes[3:] = boxes[:3] + np.abs(boxes[3:])
    low, counts, widen = np.empty(3, np.float32), np.empty(3, np.int64), np.float32(0.02)
    grid_around(boxes, np.float32(0.05), widen, low, counts)
    np.testing.assert_allclose(low, boxes[:3].min(axis=1) - widen)
    reach = (boxes[3:].max(axis=1) + widen - low) / 0.05
    assert (reach <= counts + 1e-4).all() and (counts < reach + 1).all()


def test_samples_near_the_skin_are_held_over_their_nearest_place():
    """On a ball: the half-space is the tangent plane of the nearest point, by another search."""
    garment = sheet(height=0.1)
    shaped, whole = prepared(garment)
    posed, settings = at(shaped, (0, 0, 0)), whole.settings
    surface = whole.on_body.surface(posed)
    points, count = surface.into_bone_frame(garment.vertices, whole.on_body.order), len(whole.coarse.samples)
    planes, held, memory = np.empty((count, 4), np.float32), np.empty(count, np.int64), whole.start().memory
    near = constrain_samples(
        surface.skin,
        whole.limbs,
        whole.limb_grid(surface),
        ShiftedCloth(points, np.zeros((60, 3), np.float32)),
        whole.coarse,
        Samples(np.arange(count), whole.margins, np.float32(settings.reach), 0, False),
        memory,
        HalfSpaces(planes, held),
    )
    places = points[whole.coarse.samples].astype(float)
    closest = ClosestTree(posed.vertices.astype(float), posed.faces).closest(places)
    height = np.linalg.norm(places, axis=1) - RADIUS
    assert set(held[:near]) == set(np.flatnonzero(height < whole.margins + settings.reach))
    for s in held[:near]:
        toward = places[s] / np.linalg.norm(places[s])
        assert planes[s, :3] @ toward > 0.999
        assert abs(planes[s, 3] - whole.margins[s] - closest.positions[s] @ planes[s, :3]) < 1e-5


def test_pins_of_a_garment_are_where_the_simulation_has_them():
    shaped, poses, _ = clip("dance", frames=1, first=30)
    for name in ("cape-light", "skirt-light"):
        garment = garments.load(name)
        worn = GarmentOnBody.of(shaped, garment.vertices)
        whole = WholeCloth.prepare(shaped, garment, worn, WholeSettings(controls=50, samples=50))
        surface = worn.surface(poses[0])
        places = surface.out_of_bone_frame(
            whole.pin_places(poses[0], surface), np.arange(len(whole.pins), dtype=np.int32)
        )
        number = np.argsort(garment.pins.vertices)
        expected = garment.pins.on(poses[0])[number]
        found = places[np.argsort(worn.order[whole.pins])]
        np.testing.assert_allclose(found, expected, atol=3e-6)
