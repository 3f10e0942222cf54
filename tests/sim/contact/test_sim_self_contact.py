"""Self-contact of cloth: search, forces, and untangling."""

import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from hemline.meshes import crossing_edges, edges, self_crossings, vertex_normals
from hemline.sim import Elastic, SimSettings, Stepper, StepScene, make_sheet
from hemline.sim.contact.pairs.pair_kernels import pair_forces
from hemline.sim.contact.pairs.pair_search_kernels import ClothMesh, _edge_edge, _vertex_face
from hemline.sim.contact.pairs.self_search import UNTANGLE_DISTANCE, SelfSearch

pytestmark = pytest.mark.usefixtures("all_threads")  # kernels with parallel loops

vertex_face, edge_edge = _vertex_face.py_func, _edge_edge.py_func

GRAVITY = 9.81
WEIGHTLESS = SimSettings(gravity=(0.0, 0.0, 0.0), residual_share=1e-3, solver_share=1e-3, newton_steps=30)


def grid(across, along, width, length):
    u, v = np.meshgrid(np.linspace(0, width, across), np.linspace(0, length, along), indexing="ij")
    number = np.arange(across * along).reshape(across, along)
    a, b, c, d = number[:-1, :-1].ravel(), number[1:, :-1].ravel(), number[1:, 1:].ravel(), number[:-1, 1:].ravel()
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    return np.stack([u.ravel(), 0 * u.ravel(), v.ravel()], axis=1), faces


def stack(layers, **material):
    """Flat layers, each (positions, faces), in one sheet; at rest where they are."""
    starts = np.cumsum([0] + [len(positions) for positions, _ in layers])
    x = np.concatenate([positions for positions, _ in layers])
    faces = np.concatenate([faces + start for (_, faces), start in zip(layers, starts[:-1], strict=True)])
    flat = np.concatenate([positions for positions, _ in layers])[:, [0, 2]]
    rest = np.stack([flat[faces[:, 1]] - flat[faces[:, 0]], flat[faces[:, 2]] - flat[faces[:, 0]]], axis=2)
    return make_sheet(faces.astype(np.int32), rest, Elastic(**material)), x, starts


def fold_strip(across=13, along=25, gap=0.0025):
    """A strip laid on itself around a half circle, with the sheet that it is made of."""
    x, faces = grid(across, along, 0.12, 0.24)
    sheet, _, _ = stack([(x, faces)], young=100.0)
    z, radius = x[:, 2], gap / 2
    around = (z - 0.12) / radius
    turn = np.clip(around, 0, np.pi)
    beyond = np.maximum(around - np.pi, 0) * radius
    # the second half runs back a little askew, so that no two edges are parallel
    folded_z = np.minimum(z, 0.12) + radius * np.sin(turn) - beyond
    return sheet, np.stack([x[:, 0] + 0.05 * beyond, radius * (1 - np.cos(turn)), folded_z], axis=1)


def still(pinned=None):
    scene = StepScene(np.zeros((0, 3)) if pinned is None else pinned)
    return lambda share: scene


def search_of(sheet, thickness=0.003):
    return SelfSearch(sheet, thickness=thickness, stiffness=5e4, friction=np.full(sheet.vertex_count, 0.3))


def point_triangle(p, a, b, c):
    """Distance: to the plane if the foot is inside, else to the nearest of the three segments."""
    n = np.cross(b - a, c - a)
    foot = p - n * ((p - a) @ n) / (n @ n)
    areas = [np.cross(q - foot, r - foot) @ n for q, r in ((a, b), (b, c), (c, a))]
    if min(areas) >= 0:
        return np.linalg.norm(p - foot)
    return min(
        np.linalg.norm(p - q - np.clip((p - q) @ (r - q) / ((r - q) @ (r - q)), 0, 1) * (r - q))
        for q, r in ((a, b), (b, c), (c, a))
    )


def test_all_near_vertices_and_triangles_are_found():
    sheet, x = fold_strip()
    x = x + 0.0002 * np.random.default_rng(0).normal(size=x.shape)
    contact = search_of(sheet).find(x, x)
    found = {(int(row[0]), tuple(sorted(map(int, row[1:4])))) for row in contact.corners if row[4] == 0}
    normal = vertex_normals(x, sheet.faces.astype(np.int32))
    faces = sheet.faces.astype(int)
    middle, wanted = x[faces].mean(axis=1), set()
    for i in range(len(x)):
        for f in np.flatnonzero(np.linalg.norm(middle - x[i], axis=1) < 0.02):
            a, b, c = x[faces[f]]
            apart = i not in faces[f] and normal[i] @ np.cross(b - a, c - a) < -1e-9
            if apart and point_triangle(x[i], a, b, c) < 0.0029:
                wanted.add((i, tuple(sorted(map(int, faces[f])))))
    assert len(wanted) > 200
    assert wanted <= found


def crumple(seed=0):
    """A small sheet, rough enough for folds within a patch, and how it moves: all of it fast, each vertex a little."""
    x, faces = grid(9, 9, 0.06, 0.06)
    sheet, _, _ = stack([(x, faces)], young=100.0)
    generator = np.random.default_rng(seed)
    return sheet, x + 0.006 * generator.normal(size=x.shape), generator.normal(size=x.shape)


def every_pair(search, x, moved):
    """The pairs without any search: each element against each by the exact test; none is left out for being far."""
    sheet, patches, out = search.sheet, search.patches, np.zeros((1, 5), np.uint32)
    faces, edge = sheet.faces.astype(np.int64), sheet.edges.astype(np.int64)
    mesh = ClothMesh(faces, edge, patches.radius, patches.joined)
    label = np.empty(len(x), np.int64)
    for number in range(patches.count):
        label[patches.vertices.columns[patches.vertices.starts[number] : patches.vertices.starts[number + 1]]] = number
    of_face = np.cross(x[faces[:, 1]] - x[faces[:, 0]], x[faces[:, 2]] - x[faces[:, 0]])
    of_vertex = np.array([of_face[(faces == i).any(axis=1)].sum(axis=0) for i in range(len(x))])
    of_vertex /= np.linalg.norm(of_vertex, axis=1, keepdims=True)
    of_edge = of_vertex[edge].sum(axis=1)
    found = set()
    for i in range(len(x)):
        for f in range(len(faces)):
            agree = patches.joined[label[i], label[faces[f, 0]]] and of_vertex[i] @ of_face[f] > 0
            if not agree and vertex_face(x, moved, i, f, mesh, 0, out):
                found.add(tuple(map(int, out[0])))
    for e in range(len(edge)):
        for g in range(len(edge)):
            here, there = label[edge[e, 0]], label[edge[g, 0]]
            agree = patches.joined[here, there] and of_edge[e] @ of_edge[g] > 0
            later = here < there or (here == there and e < g)
            if later and not agree and edge_edge(x, moved, e, g, mesh, 0, out)[0]:
                found.add(tuple(map(int, out[0])))
    return found


@pytest.mark.parametrize(("speed", "drift"), [(0.0, 0.0), (0.002, 0.0), (0.002, 0.3), (0.01, 0.0)])
def test_the_search_leaves_out_nothing(speed, drift):
    sheet, x, way = crumple()
    # half of the sheet flies away from the other
    moved = speed * way + drift * np.where(np.arange(len(x)) < 40, 0.05, 0.0)[:, None]
    search = search_of(sheet)
    # what crosses is left out later on
    search._without_crossings = lambda crossed, corners: corners
    contact = search.find(x, x + moved)
    wanted = every_pair(search, x, (x + moved) - x)
    assert len(wanted) > 100
    assert {tuple(map(int, row)) for row in contact.corners} == wanted


def test_where_the_cloth_is_changes_nothing():
    # elements are compared in 32 bits, but for that they are counted from a vertex of the cloth
    sheet, x, way = crumple()
    away = np.array([5e4, 0.0, -2e5])
    here = search_of(sheet).find(x, x + 0.002 * way)
    far = search_of(sheet).find(x + away, x + away + 0.002 * way)
    assert len(here.corners) > 100 and np.array_equal(far.corners, here.corners)


def test_edges_that_cross_are_those_of_the_exact_test():
    first, second = grid(9, 9, 0.1, 0.1), grid(9, 9, 0.1, 0.1)
    tilted = second[0] @ np.array([[1, 0.6, 0], [0, 1, 0], [0, 0.3, 1]]) + [0.003, -0.041, 0.0017]
    sheet, x, _ = stack([first, second])
    # not quite flat: triangles of one plane would cross by rounding
    x = np.concatenate([first[0], tilted]) + 1e-4 * np.random.default_rng(0).normal(size=x.shape)
    contact = search_of(sheet).find(x, x)
    exact = crossing_edges(x, sheet.faces.astype(np.int32))
    assert len(exact) > 10
    assert {tuple(sorted(map(int, edge))) for edge in contact.crossed} == {tuple(map(int, edge)) for edge in exact}


def test_a_sheet_on_a_sheet_rests_on_it():
    # in balance the pairs carry the upper sheet: nothing falls, and the distance is within the thickness
    below, above = grid(12, 12, 0.2, 0.2), grid(9, 9, 0.12, 0.12)
    sheet, x, starts = stack([below, above], young=100.0, damping=0.003)
    x[starts[1] :] += [0.0413, 0.004, 0.0377]
    pins = np.arange(starts[1])
    stepper = Stepper(sheet, pinned=pins, settings=SimSettings(residual_share=0.01, newton_steps=20))
    state = stepper.start(x)
    for _ in range(60):
        state, report = stepper.advance(state, 1 / 120, still(x[pins]))
    height = state.positions[starts[1] :, 1]
    assert report.residual_share < 0.01
    assert np.linalg.norm(state.velocities, axis=1).max() < 1e-3
    assert 0.001 < height.min() < height.max() < 0.002
    # second route to the load: what the pinned sheet feels is the weight of the other
    pushed = stepper.workspace.pressed[: starts[1], 1].sum()
    assert pushed == pytest.approx(GRAVITY * sheet.mass[starts[1] :].sum(), rel=0.02)


def test_two_sheets_that_collide_keep_their_momentum_and_gain_no_energy():
    below, above = grid(10, 10, 0.15, 0.15), grid(10, 10, 0.15, 0.15)
    sheet, x, starts = stack([below, above], young=100.0, damping=0.003)
    x[starts[1] :] += [0.0113, 0.008, 0.0077]
    stepper = Stepper(sheet, settings=WEIGHTLESS)
    velocities = np.zeros_like(x)
    velocities[starts[1] :] = [0.2, -1.0, 0.1]
    state = replace(stepper.start(x), velocities=velocities)
    momentum = (sheet.mass[:, None] * velocities).sum(axis=0)
    energy = 0.5 * (sheet.mass * (velocities**2).sum(axis=1)).sum()
    for _ in range(30):
        state, _ = stepper.advance(state, 1 / 240, still())
    found = (sheet.mass[:, None] * state.velocities).sum(axis=0)
    # forces of a pair cancel; what is left is the solver's residual
    assert np.abs(found - momentum).max() < 1e-3 * np.abs(momentum).max()
    kinetic = 0.5 * (sheet.mass * (state.velocities**2).sum(axis=1)).sum()
    assert kinetic + stepper.energy(state.positions) < energy
    # they met: the lower one moves now
    assert state.velocities[: starts[1], 1].mean() < -0.2
    assert self_crossings(state.positions, sheet.faces.astype(np.int32))["pairs"] == 0


@pytest.mark.parametrize("tangent", [0.15, 0.6])
def test_cloth_on_cloth_slides_only_beyond_the_angle_of_friction(tangent):
    # Coulomb, mu = 0.3: sticks below tan = 0.3, else slides with a = g (sin - mu cos)
    mu, angle = 0.3, np.arctan(tangent)
    below, above = grid(24, 10, 0.48, 0.2), grid(5, 5, 0.08, 0.08)
    sheet, x, starts = stack([below, above], young=200.0, friction=mu)
    x[starts[1] :] += [0.0413, 0.0019, 0.0577]
    down = (GRAVITY * np.sin(angle), -GRAVITY * np.cos(angle), 0.0)
    pins = np.arange(starts[1])
    settings = replace(WEIGHTLESS, gravity=down, creep=1e-3)
    stepper, h = Stepper(sheet, pinned=pins, settings=settings), 1 / 240
    state, slid = stepper.start(x), []
    for _ in range(48):
        state, _ = stepper.advance(state, h, still(x[pins]))
        slid.append(float((state.velocities[starts[1] :] * sheet.mass[starts[1] :, None]).sum(axis=0)[0]))
    speed = np.array(slid) / sheet.mass[starts[1] :].sum()
    if tangent < mu:
        # friction is smoothed below the creep speed
        assert abs(speed[-1]) < 2e-3
    else:
        # the load has to build up first: the slope of the speed after that
        found = (speed[-1] - speed[-25]) / (24 * h)
        wanted = GRAVITY * (np.sin(angle) - mu * np.cos(angle))
        # the patch hops over the edges of the lower sheet
        assert found == pytest.approx(wanted, rel=0.15)


def drop_strip(self_contact):
    """Crossings of an upright strip that falls onto a sheet, step by step, and where it ends."""
    x, faces = grid(9, 41, 0.08, 0.3)
    wave = 0.004 * np.sin(40 * x[:, 2])
    upright = np.stack([x[:, 0] + 0.03 * x[:, 2], 0.3 - x[:, 2], wave], axis=1)
    ground, ground_faces = grid(8, 8, 0.5, 0.5)
    sheet, _, starts = stack([(x, faces), (ground, ground_faces)], young=60.0, bending=2e-5, damping=0.003)
    start = np.concatenate([upright, ground + [-0.2, -0.01, -0.25]])
    pins = np.arange(starts[1], sheet.vertex_count)
    stepper = Stepper(sheet, pinned=pins, settings=SimSettings(self_contact=self_contact))
    state, pairs = stepper.start(start), []
    for _ in range(70):
        state, _ = stepper.advance(state, 1 / 120, still(start[pins]))
        pairs.append(self_crossings(state.positions, sheet.faces.astype(np.int32))["pairs"])
    return pairs, state.positions[: starts[1]]


def test_a_falling_strip_piles_up_and_ends_without_crossing_itself():
    # folds that are narrower than the mesh cross for a moment, and come apart again
    pairs, heap = drop_strip(self_contact=True)
    assert pairs[-1] == 0
    assert heap[:, 1].min() > -0.0101
    without, fallen = drop_strip(self_contact=False)
    assert max(without) > 10
    assert fallen[:, 1].max() < -0.1


def test_crossed_cloth_comes_apart():
    # the corner of an upper sheet goes through the lower one
    below, above = grid(14, 14, 0.2, 0.2), grid(14, 14, 0.2, 0.2)
    sheet, x, starts = stack([below, above], young=60.0, damping=0.01)
    upper = above[0]
    corner = np.maximum(upper[:, 0] + upper[:, 2] - 0.28, 0)
    x[starts[1] :] = upper + np.stack([0.0313 + 0 * corner, 0.008 - 0.3 * corner, 0.0277 + 0 * corner], axis=1)
    faces = sheet.faces.astype(np.int32)
    assert self_crossings(x, faces)["pairs"] > 5
    stepper = Stepper(sheet, settings=replace(WEIGHTLESS, residual_share=0.1))
    state = stepper.start(x)
    for _ in range(60):
        state, _ = stepper.advance(state, 1 / 120, still())
        state = replace(state, velocities=0.8 * state.velocities)
    assert self_crossings(state.positions, faces)["pairs"] == 0
    # as little as it takes: the corner comes back up, nobody tears
    assert np.abs(state.positions - x).max() < 0.05


def test_what_pulls_a_crossing_apart_pulls_all_ends_of_its_edges_one_way_and_by_no_more():
    """Over triangles of 2 cm, whose corners lie far on both sides of the plane that they go through."""
    first, second = grid(9, 9, 0.16, 0.16), grid(9, 9, 0.16, 0.16)
    tilted = second[0] @ np.array([[0.9, 0.43, 0], [-0.43, 0.9, 0], [0, 0.3, 1]]) + [0.013, -0.051, 0.0017]
    sheet, _, _ = stack([first, second])
    x = np.concatenate([first[0], tilted])
    x += 0.004 * np.random.default_rng(1).normal(size=x.shape)
    contact = search_of(sheet).find(x, x)
    _, untangling = contact.pair_rows(x)
    assert untangling.size > 20
    between = np.einsum("pc,pcx->px", untangling.weights, x[untangling.corners])
    height = np.einsum("px,px->p", between, untangling.normal)
    assert height.min() < -2 * UNTANGLE_DISTANCE and height.max() > 2 * UNTANGLE_DISTANCE
    forces, energy = np.empty((untangling.size, 3)), np.empty(1 + untangling.size // 64)
    pair_forces(x, untangling, 1.0, forces, energy)
    load = -np.einsum("px,px->p", forces, untangling.normal)
    assert load == pytest.approx(untangling.stiffness * UNTANGLE_DISTANCE)
    # nothing is left once they have gone that far
    pair_forces(x, untangling._replace(reach=height), 1.0, forces, energy)
    assert np.abs(forces).max() < 1e-12


def test_pairs_are_the_same_whatever_the_order_of_the_search():
    sheet, x = fold_strip()
    roomy, narrow = search_of(sheet), search_of(sheet)
    narrow._room = dict.fromkeys(narrow._room, 1)
    one, two = roomy.find(x, x), narrow.find(x, x)
    assert len(one.corners) > 100
    assert np.array_equal(one.corners, two.corners)


def crossing_roofs(distance):
    """Two strips of two triangles, folded like roofs, ridge across ridge: only the ridges are near each other."""
    ridge = np.array([[-0.05, 0, 0], [0.05, 0, 0], [0.003, -0.04, 0.06], [0.003, -0.04, -0.06]])
    faces = np.array([[0, 2, 1], [0, 1, 3]])
    flat = [ridge * [1, 0, np.hypot(0.04, 0.06) / 0.06]] * 2
    sheet, _, _ = stack([(each, faces) for each in flat], young=100.0)
    other = ridge[:, [2, 1, 0]] * [1, -1, 1] + [0.001, distance, 0.002]
    return sheet, np.concatenate([ridge, other])


def test_edges_hold_edges_off():
    # no vertex is near a triangle here: without pairs of edges nothing would be found
    sheet, x = crossing_roofs(0.001)
    contact = search_of(sheet, thickness=0.002).find(x, x)
    assert contact.corners[:, 4].tolist() == [1]
    pairs = contact.pair_rows(x)[0]
    assert abs(pairs.normal[0, 1]) > 0.99
    stepper = Stepper(sheet, settings=WEIGHTLESS)
    state = stepper.start(x)
    for _ in range(20):
        state, _ = stepper.advance(state, 1 / 120, still())
    assert state.positions[[4, 5], 1].mean() - state.positions[[0, 1], 1].mean() > 0.0019


THREADS = """
import hashlib, sys
from tests.sim.contact.test_sim_self_contact import drop_strip
print(hashlib.sha256(drop_strip(self_contact=True)[1].tobytes()).hexdigest())
"""


def test_the_number_of_threads_changes_no_bit():
    code = THREADS
    found = []
    for threads in ("1", "2"):
        environment = os.environ | {"NUMBA_NUM_THREADS": threads, "OMP_WAIT_POLICY": "passive"}
        done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
        found.append(done.stdout)
    assert found[0] == found[1]


def test_thickness_is_less_where_edges_are_short():
    x, faces = grid(5, 5, 0.01, 0.01)
    sheet, _, _ = stack([(x, faces)])
    shortest = min(np.linalg.norm(x[i] - x[j]) for i, j in edges(faces.astype(np.int32)))
    assert search_of(sheet, thickness=0.01).thickest == pytest.approx(0.5 * shortest)


def test_pairs_hold_their_own_side():
    # a vertex that a step carried through a triangle is pushed back to where it came from
    below, above = grid(4, 4, 0.09, 0.09), grid(2, 2, 0.004, 0.004)
    sheet, x, starts = stack([below, above])
    x[starts[1] :] += [0.0413, 0.0015, 0.0377]
    through = x.copy()
    through[starts[1] :, 1] = -0.002
    contact = search_of(sheet).find(x, through)
    pairs = contact.pair_rows(through)[0]
    # of a vertex and a triangle, the nearest point within it
    within = (pairs.weights[:, 0] == 1) & (pairs.weights[:, 1:] < 0).all(axis=1)
    upper = within & np.isin(pairs.corners[:, 0], range(starts[1], len(x)))
    assert upper.any()
    assert (pairs.normal[upper, 1] > 0.9).all()
