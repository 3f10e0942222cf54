"""Chains on garments: the shipped cape, a tube with a closed rim, chains by hand."""

import functools
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from hemline import bodies, garments
from hemline.animators.ropes.layout.fault import layout_fault
from hemline.animators.ropes.layout.layout import build_ropes
from hemline.animators.ropes.layout.rim import rim_of, suspension_vertices
from hemline.animators.ropes.layout.unroll import UnrolledGarment
from hemline.errors import BadGarment, BadInput
from hemline.garments.garment import Garment
from hemline.garments.generate import Design, generate_garment
from hemline.garments.material import MATERIALS
from hemline.garments.pin_rules import NO_PINS
from hemline.garments.pins import Pins
from hemline.meshes import boundary_loops, geodesic_distances


@functools.cache
def shaped():
    return bodies.load("anny24").shaped()


@functools.cache
def cape(name="cape-light"):
    return garments.load(name)


def skirt(columns=40, rows=20, spacing=0.03):
    """A tube around the hips, pinned at its upper rim; its rest metric is that of its vertices."""
    angle = 2 * np.pi * np.arange(columns) / columns
    ring = np.stack([0.25 * np.sin(angle), np.zeros(columns), 0.25 * np.cos(angle)], 1)
    vertices = np.concatenate([ring - [0, spacing * row, 0] for row in range(rows)]).astype(np.float32)
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b = index[:-1], np.roll(index[:-1], -1, 1)
    c, d = index[1:], np.roll(index[1:], -1, 1)
    faces = np.concatenate([np.stack([a, c, b], -1).reshape(-1, 3), np.stack([b, c, d], -1).reshape(-1, 3)])
    one, two = (vertices[faces[:, k]] - vertices[faces[:, 0]] for k in (1, 2))
    first = np.linalg.norm(one, axis=1)
    along = (one * two).sum(1) / first
    height = np.sqrt(np.maximum((two**2).sum(1) - along**2, 0))
    edges = np.stack([np.stack([first, 0 * first], 1), np.stack([along, height], 1)], 2).astype(np.float64)
    pins = Pins(
        np.arange(columns, dtype=np.int32),
        np.zeros(columns, np.int32),
        np.tile([1.0, 0, 0], (columns, 1)).astype(np.float32),
        np.full(columns, 0.004, np.float32),
    )
    return Garment(
        "tube", vertices, faces.astype(np.int32), edges, MATERIALS["cotton"], pins, "pelvis", flat_rest=False
    )


def test_the_cape_of_the_paper_has_ten_chains_of_thirteen_to_fifteen_bones():
    ropes = build_ropes(cape("cape"), shaped())
    counts = np.diff(ropes.chains.offsets)
    assert len(counts) == 10 and counts.min() >= 13 and counts.max() <= 15
    assert 130 <= ropes.node_count <= 230
    unattached = int(ropes.chains.offsets[0])
    assert unattached == 11
    np.testing.assert_array_equal(ropes.kinematic, [*range(unattached), *ropes.chains.offsets[:-1]])
    lengths = ropes.lengths[ropes.parents >= 0]
    assert lengths.max() / lengths.min() < 1.3
    hem = [ropes.rest[end - 1] for end in ropes.chains.offsets[1:]]
    from_hem = np.linalg.norm(cape("cape").vertices[None] - np.array(hem)[:, None], axis=2)
    unrolled = UnrolledGarment(cape("cape"))
    assert (unrolled.distance[from_hem.argmin(1)] > 0.95 * unrolled.distance.max()).all()


def test_ropes_are_as_long_as_in_the_drape_and_as_their_cloth_where_it_lies_in_folds():
    tight, loose = (build_ropes(cape(), shaped(), strain_p99=strain) for strain in (0.0, 0.05))
    free = tight.parents >= 0
    spans = tight.chains.rest_spans[free]
    np.testing.assert_array_equal(tight.lengths[free], spans)
    total = np.add.reduceat(np.where(free, tight.lengths, 0), tight.chains.offsets[:-1])
    np.testing.assert_allclose(total, 0.985 * UnrolledGarment(cape()).distance.max(), rtol=0.03)
    np.testing.assert_array_equal(loose.lengths[free], spans)
    # a drape that is pushed together to half its height
    pressed = cape().vertices * np.array([1, 0.5, 1], np.float32)
    folded = build_ropes(cape(), shaped(), rest=pressed, strain_p99=0.05)
    slack = folded.lengths[free] > folded.chains.rest_spans[free]
    assert slack.mean() > 0.5
    assert (folded.chains.rest_tensions[free][slack] == 0).all()
    assert (folded.lengths[free] >= folded.chains.rest_spans[free]).all()


def test_all_of_the_cloth_is_shared_out_as_mass():
    ropes = build_ropes(cape(), shaped())
    area = np.abs(np.linalg.det(cape().rest_edges)).sum() / 2
    assert ropes.masses.sum() == pytest.approx(area * cape().material.density, rel=0.02)


def test_a_closed_rim_has_chains_all_around():
    tube = skirt()
    rim = rim_of(tube)
    assert rim.closed and len(rim.vertices) == 40
    ropes = build_ropes(tube, shaped(), chain_count=8, bone_counts=(6, 6))
    offsets = ropes.chains.offsets
    assert offsets[0] == 8 and (np.diff(offsets) == 6).all()
    for first, last in pairwise(offsets):
        chain = ropes.rest[first:last]
        # straight down the tube
        assert np.abs(chain[:, [0, 2]] - chain[0, [0, 2]]).max() < 2e-3
        np.testing.assert_allclose(ropes.lengths[first + 1 : last], 0.985 * 0.57 / 5, rtol=1e-3)
    angles = np.sort(np.arctan2(ropes.rest[offsets[:-1], 0], ropes.rest[offsets[:-1], 2]))
    np.testing.assert_allclose(np.diff(angles), 2 * np.pi / 8, atol=0.02)
    # every free bone has two neighbours, and the cloth between them is an arc
    assert len(ropes.chains.pairs) == 8 * 5
    np.testing.assert_allclose(ropes.chains.pair_spans[:, 1], 1.02 * 2 * np.pi * 0.25 / 8, rtol=0.02)
    assert (ropes.chains.across[ropes.parents >= 0] != np.flatnonzero(ropes.parents >= 0)[:, None]).all()


def test_more_chains_than_the_rim_has_vertices_still_reach_the_hem():
    """A coarse mesh of 16 columns, 26 chains of 9 bones (what a fit asks for by default)."""
    ropes = build_ropes(skirt(columns=16, rows=10), shaped(), chain_count=26, bone_counts=(9, 9))
    ends = ropes.rest[ropes.chains.offsets[1:] - 1]
    assert len(ends) == 26
    np.testing.assert_allclose(ends[:, 1], -0.27, atol=0.012)


def test_without_pins_the_chains_hang_from_the_highest_rim():
    pinned = skirt()
    loose = replace(pinned, pins=NO_PINS)
    with_pins, without = build_ropes(pinned, shaped(), chain_count=6), build_ropes(loose, shaped(), chain_count=6)
    np.testing.assert_allclose(without.rest, with_pins.rest, atol=1e-6)
    np.testing.assert_allclose(without.lengths, with_pins.lengths, atol=1e-6)


def test_the_chains_of_a_dress_reach_from_its_collar_to_its_hem():
    dress = cape("dress-light")
    ropes = build_ropes(dress, shaped())
    roots, tips = ropes.rest[ropes.chains.offsets[:-1]], ropes.rest[ropes.chains.offsets[1:] - 1]
    low, high = dress.vertices[:, 1].min(), dress.vertices[:, 1].max()
    assert roots[:, 1].min() > high - 0.2 and len(dress.pins) == 0
    assert (tips[:, 1] < low + 0.1).sum() >= 4


def test_chains_by_hand_are_taken():
    tube = skirt()
    chains = ((0, 80, 160, 240), (10, 90, 170))
    ropes = build_ropes(replace(tube, chains=chains), shaped(), strain_p99=0.0)
    np.testing.assert_array_equal(ropes.chains.offsets, [0, 4, 7])
    np.testing.assert_allclose(ropes.rest, tube.vertices[[*chains[0], *chains[1]]], atol=1e-6)
    np.testing.assert_allclose(ropes.lengths[[1, 2, 3, 5, 6]], 0.06, rtol=1e-4)
    np.testing.assert_allclose(ropes.positions_on(tube.vertices), ropes.rest, atol=1e-6)


def columns_of(garment, chosen, rows, columns):
    """The garment with chains along some columns of a grid."""
    return replace(garment, chains=tuple(tuple(row * columns + column for row in rows) for column in chosen))


def test_chains_by_hand_all_around_are_joined_where_they_close():
    tube = columns_of(skirt(), range(0, 40, 5), (0, 5, 10, 15), 40)
    chains = build_ropes(tube, shaped(), strain_p99=0.0).chains
    assert len(chains.pairs) == 8 * 3
    assert (chains.lengths[chains.offsets[:-1]] == 0).all()
    closing = chains.pairs[(chains.pairs >= 28).any(1) & (chains.pairs < 4).any(1)]
    np.testing.assert_array_equal(np.sort(closing), [[1, 29], [2, 30], [3, 31]])
    # the cloth between two of them is an arc of five edges, not the chord
    np.testing.assert_allclose(chains.pair_spans[:, 1], 5 * 0.5 * np.sin(np.pi / 40), rtol=1e-3)
    assert (chains.pair_spans[:, 1] > 1.02 * chains.pair_spans[:, 0]).all()
    open_sheet = build_ropes(columns_of(cape(), range(4, 80, 10), (1, 17, 33, 49), 80), shaped()).chains
    assert len(open_sheet.pairs) == 7 * 3


def test_chains_by_hand_on_separate_cloths_are_not_joined():
    tube = skirt()
    below = replace(
        tube,
        vertices=np.concatenate([tube.vertices, tube.vertices - np.array([0, 1, 0], np.float32)]),
        faces=np.concatenate([tube.faces, tube.faces + 800]),
        rest_edges=np.concatenate([tube.rest_edges] * 2),
        chains=((0, 80, 160), (5, 85, 165), (800, 880, 960)),
    )
    chains = build_ropes(below, shaped()).chains
    np.testing.assert_array_equal(chains.pairs, [[1, 4], [2, 5]])
    assert np.isfinite(chains.pair_spans).all()


def test_the_skirt_of_the_paper_has_its_twenty_six_chains_of_nine_bones():
    light = garments.load("skirt-light")
    ropes = build_ropes(light, shaped())
    assert (np.diff(ropes.chains.offsets) == 9).all() and ropes.node_count == 26 * 9
    assert len(ropes.chains.pairs) == 26 * 8
    np.testing.assert_allclose(ropes.rest, light.vertices[np.concatenate(light.chains)], atol=1e-6)


def test_points_have_the_coordinates_that_were_asked_for():
    unrolled = UnrolledGarment(skirt())
    for fraction, depth in ((0.13, 0.1), (0.99, 0.31), (0.5, 0.5)):
        corners, weights = unrolled.point(fraction, depth)
        assert weights @ unrolled.distance[corners] == pytest.approx(depth, abs=1e-9)
        assert np.abs(weights @ unrolled.rim.difference(unrolled.fraction[corners], fraction)) < 1e-9


@pytest.mark.parametrize(
    "options", [{"chain_count": 0}, {"bone_counts": (1, 3)}, {"bone_counts": (5, 3)}, {"strain_p99": -0.1}]
)
def test_counts_that_cannot_be_used_are_refused(options):
    with pytest.raises(BadGarment, match="cannot be made"):
        build_ropes(cape(), shaped(), **options)


def test_chains_that_do_not_fit_are_refused():
    for chains in (((0,),), ((0, 5_000_000),)):
        with pytest.raises(BadGarment, match=r"chain"):
            build_ropes(replace(skirt(), chains=chains), shaped())


def test_a_rim_of_one_vertex_is_refused():
    tube = skirt()
    one = Pins(*(getattr(tube.pins, name)[:1] for name in ("vertices", "body_faces", "barycentric", "heights")))
    with pytest.raises(BadGarment, match="pinned or an open rim"):
        build_ropes(replace(tube, pins=one), shaped())


@pytest.mark.parametrize(
    ("chains", "match"),
    [
        (((0, 90, 170), (10, 80, 160)), r"chains must not cross; got chains \[0, 1\]"),
        (((160, 80, 0),), "hangs from its first vertex; got chain 0 ends above it"),
    ],
)
def test_chains_by_hand_that_cannot_hang_are_refused(chains, match):
    with pytest.raises(BadGarment, match=match):
        build_ropes(replace(skirt(), chains=chains), shaped())


def swinging(tube, centres, columns, rows):
    """Frames of a tube whose upper third stands still; below it sectors around four fractions of the rim move alone."""
    random = np.random.default_rng(0)
    fraction, row = np.arange(columns * rows) % columns / columns, np.arange(columns * rows) // columns
    owner = np.abs((fraction[:, None] - centres + 0.5) % 1 - 0.5).argmin(1)
    moves = random.normal(0, 0.1, (15, len(centres), 3))
    return tube.vertices + np.where((row > rows // 3)[:, None], moves[:, owner], 0.0)


def test_a_skinning_decomposition_puts_chains_where_cloth_moves_as_one():
    tube, centres = skirt(40, 21), (np.arange(4) + 0.3) / 4
    frames = swinging(tube, centres, 40, 21)
    ropes = build_ropes(tube, shaped(), frames=frames, chain_count=4, bone_counts=(3, 3), strain_p99=0.0)
    chains = ropes.chains
    angle = np.arctan2(ropes.rest[:, 0], ropes.rest[:, 2]) / (2 * np.pi) % 1
    np.testing.assert_allclose(np.sort(angle[chains.offsets[:-1]]), centres, atol=0.03)
    np.testing.assert_allclose(np.sort(angle[: chains.offsets[0]]), np.sort((centres + 0.125) % 1), atol=0.03)
    for first, last in pairwise(chains.offsets):
        depth = -ropes.rest[first:last, 1]
        assert depth[0] == pytest.approx(0, abs=1e-6) and depth[-1] == pytest.approx(0.985 * 0.6, abs=1e-3)
        assert depth[1] > 0.33  # amid what moves, 0.42 m down; half way would be 0.296 m


def test_decomposed_bones_that_lie_on_each_other_become_one():
    tube = skirt(40, 21)
    frames = swinging(tube, (np.arange(4) + 0.3) / 4, 40, 21)
    chains = build_ropes(tube, shaped(), frames=frames, chain_count=4, bone_counts=(9, 9), strain_p99=0.0).chains
    spacing = 0.985 * 0.6 / 8
    assert chains.lengths[chains.parents >= 0].min() > 0.3 * spacing
    assert np.diff(chains.offsets).min() >= 4 and np.diff(chains.offsets).max() <= 14


def test_a_decomposition_into_more_bones_than_it_has_vertices_for_is_refused():
    tube = skirt(12, 6)
    with pytest.raises(BadInput, match="fewer bones"):
        build_ropes(tube, shaped(), frames=tube.vertices[None], chain_count=10, bone_counts=(13, 15))


def sleeved():
    """A generated top with sleeves, and the same one cut open down its front."""
    top = generate_garment(Design(kind="top", length=0.6, sleeve=0.4, ease=0.16, waist_ease=0.2), shaped(), edge=0.045)
    vertices, faces = top.vertices.astype(float), top.faces.copy()
    line = np.flatnonzero((np.abs(vertices[:, 0]) < 1e-5) & (vertices[:, 2] > np.median(vertices[:, 2])))
    doubles = dict(zip(line.tolist(), range(len(vertices), len(vertices) + len(line)), strict=True))
    for face in np.flatnonzero(vertices[faces].mean(axis=1)[:, 0] < 0):
        faces[face] = [doubles.get(int(vertex), int(vertex)) for vertex in faces[face]]
    vertices = np.concatenate([vertices, vertices[line]])
    vertices[line, 0] += 0.01
    vertices[-len(line) :, 0] -= 0.01
    jacket = replace(top, vertices=vertices.astype(np.float32), faces=faces.astype(np.int32), pins=NO_PINS)
    return top, jacket


def swaying(garment):
    """Frames of a garment whose parts sway by smooth fields."""
    random = np.random.default_rng(1)
    middles = garment.vertices[random.integers(len(garment.vertices), size=6)]
    near = np.exp(-(np.linalg.norm(garment.vertices[:, None] - middles, axis=2) ** 2) / 0.02)
    moves = random.normal(0, 0.05, (12, 6, 3))
    return garment.vertices + np.einsum("vm,fmx->fvx", near, moves)


def test_the_chains_of_an_open_jacket_hang_from_its_neck_and_not_from_a_cuff():
    _, jacket = sleeved()
    assert len(jacket.pins) == 0 and len(boundary_loops(jacket.faces)) == 3
    ropes = build_ropes(jacket, shaped())
    roots, tips = ropes.rest[ropes.chains.offsets[:-1]], ropes.rest[ropes.chains.offsets[1:] - 1]
    assert roots[:, 1].min() > jacket.vertices[:, 1].max() - 0.12
    assert (tips[:, 1] < roots[:, 1]).all()
    assert not rim_of(jacket).closed


def test_chains_that_jump_from_a_sleeve_to_the_side_are_found_and_those_of_capes_and_skirts_suit():
    for garment in sleeved():
        assert "jumps to other cloth" in layout_fault(garment, build_ropes(garment, shaped(), chain_count=26))
    for name in ("cape-light", "dress-light"):
        assert layout_fault(cape(name), build_ropes(cape(name), shaped(), chain_count=26)) is None
    tube = skirt()
    assert layout_fault(tube, build_ropes(tube, shaped(), chain_count=12, bone_counts=(6, 6))) is None


def test_scattered_chains_follow_the_cloth_of_any_garment():
    for garment in (*sleeved(), skirt()):
        ropes = build_ropes(
            garment, shaped(), frames=swaying(garment), chain_count=10, bone_counts=(5, 5), scattered=True
        )
        chains, free = ropes.chains, np.flatnonzero(ropes.parents >= 0)
        assert np.diff(chains.offsets).min() >= 2 and 20 <= len(free) <= 40
        bones = np.array(
            [
                corner[weight.argmax()]
                for corner, weight in zip(ropes.embedding.corners, ropes.embedding.barycentric, strict=True)
            ]
        )
        assert len(np.unique(bones[free])) == len(free)  # no bone is on two chains
        seeds = np.flatnonzero(np.isin(np.arange(len(garment.vertices)), bones[chains.offsets[:-1]]))
        depth = geodesic_distances(
            garment.vertices, garment.faces, suspension_vertices(garment), rest_edges=garment.rest_edges
        )
        assert (depth[seeds] == 0).all()
        assert (depth[bones[free]] > depth[bones[free - 1]]).all()  # every chain runs away from what it hangs from
        assert (chains.rest_spans[free] <= 1.02 * chains.lengths[free]).all()  # and never through the air
        state = ropes.start(shaped().posed(shaped().rest_pose))
        moved = state
        for _ in range(5):
            moved = ropes.step(moved, shaped().posed(shaped().rest_pose), 1 / 30)
        np.testing.assert_allclose(moved.positions, state.positions, atol=1e-4)  # the drape is an equilibrium


def test_every_piece_of_a_garment_gets_scattered_bones():
    tube = skirt()
    two = replace(
        tube,
        vertices=np.concatenate([tube.vertices, tube.vertices - np.array([0, 1, 0], np.float32)]),
        faces=np.concatenate([tube.faces, tube.faces + 800]),
        rest_edges=np.concatenate([tube.rest_edges] * 2),
    )
    assert "farther than" in layout_fault(two, build_ropes(two, shaped(), chain_count=12, bone_counts=(6, 6)))
    ropes = build_ropes(two, shaped(), frames=swaying(two), chain_count=10, bone_counts=(5, 5), scattered=True)
    bones = ropes.embedding.corners[:, 0]
    assert 0.3 < (bones < 800).mean() < 0.7
    away = geodesic_distances(two.vertices, two.faces, bones, rest_edges=two.rest_edges)
    assert away.max() < 0.45  # of two tubes of 0.57 x 1.57 m


def test_scattered_chains_need_frames():
    with pytest.raises(BadInput, match="needs simulated frames"):
        build_ropes(skirt(), shaped(), scattered=True)
