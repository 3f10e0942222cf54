"""The promise within rounding of the skin: judged in the world, of the float32 positions that come back."""

import dataclasses

import numpy as np
import pytest

from hemline.collide import Projector
from hemline.collide.projection.project_frame import ProjectedFrame
from hemline.collide.winding.numbers import winding_numbers
from hemline.meshes import ClosestTree
from tests.collide.projection_samples import clip, inside_count

NO_FACES = np.empty((0, 3), np.int32)


def grazing(posed, turn, count, seed):
    """Points within 2e-7 m of the skin: on faces, edges and vertices, half of them at silhouettes along six axes.

    Silhouettes of the axes of `turn` (3,3): edges at which one face looks along the axis and the other against it.
    """
    random = np.random.default_rng(seed)
    vertices, faces = posed.vertices.astype(float), posed.faces
    normals = np.cross(vertices[faces[:, 1]] - vertices[faces[:, 0]], vertices[faces[:, 2]] - vertices[faces[:, 0]])
    edges = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    rank = np.lexsort(edges.T)
    one, other = rank[::2], rank[1::2]
    assert (edges[one] == edges[other]).all()
    looks = normals @ turn
    silhouette = one[(looks[one // 3] * looks[other // 3] < 0).any(axis=1)]
    assert len(silhouette) > 500
    picked = edges[random.choice(silhouette, count // 2)]
    on_edges = vertices[picked[:, 0]] + random.uniform(0, 1, (count // 2, 1)) * (
        vertices[picked[:, 1]] - vertices[picked[:, 0]]
    )
    corners = faces[random.integers(0, len(faces), count // 4)]
    on_faces = np.einsum("nc,nck->nk", random.dirichlet([1, 1, 1], count // 4), vertices[corners])
    at_vertices = vertices[random.integers(0, len(vertices), count // 4)]
    places = np.concatenate([on_edges, on_faces, at_vertices])
    return (places + random.uniform(-2e-7, 2e-7, places.shape) / np.sqrt(3)).astype(np.float32)


def windings_along_axes(posed, vertices):
    """Winding numbers in float64 by rays along x, y and z of the world."""
    return [
        winding_numbers(np.roll(posed.vertices, turn, axis=1), posed.faces, np.roll(vertices, turn, axis=1))
        for turn in range(3)
    ]


@pytest.mark.parametrize(
    ("name", "first", "away"), [("run", 3, 0), ("kick", 30, 0), ("dance", 40, 0), ("turn", 17, 30), ("run", 20, 300)]
)
def test_no_vertex_within_rounding_of_the_skin_is_inside_in_the_world(name, first, away):
    shaped, poses, _ = clip(name, frames=3, first=first)
    step = np.array([away, 0, -away], np.float32)
    poses = [
        shaped.posed(dataclasses.replace(posed.pose, translation=posed.pose.translation + step)) for posed in poses
    ]
    frames = [grazing(posed, posed.transforms[9, :, :3], 8000, seed) for seed, posed in enumerate(poses)]
    projector = Projector.prepare(shaped, shaped.vertices[np.arange(8000) % len(shaped.vertices)], NO_FACES)
    state, grazed = projector.start(), 0
    for posed, vertices in zip(poses, frames, strict=True):
        state, out, report = projector.project(state, posed, vertices, dt=1 / 30)
        free = np.setdiff1d(np.arange(len(out)), report.pinched)
        for winding in windings_along_axes(posed, out):
            assert np.count_nonzero(winding[free]) == 0
        grazed += np.count_nonzero(windings_along_axes(posed, vertices)[0] == 0)
        lifted = ClosestTree(posed.vertices.astype(float), posed.faces).closest(out[free]).distances
        assert lifted.min() > 1e-6
    assert grazed > 3000
    assert inside_count(poses[-1], frames[-1], []) > 3000
    assert inside_count(poses[-1], out, report.pinched) == 0


@pytest.mark.parametrize("way", range(6))
def test_what_is_within_rounding_of_the_skin_is_found_along_all_directions(way):
    shaped, poses, _ = clip("dance", frames=1, first=10)
    vertices = grazing(poses[0], poses[0].transforms[9, :, :3], 8000, 5)
    projector = Projector.prepare(shaped, vertices, NO_FACES)
    frame = ProjectedFrame(projector, projector.start(), poses[0], vertices)
    frame.state.directions[:] = way
    every = np.arange(len(vertices), dtype=np.int32)
    assert frame.rounding < 1e-5
    winding, near = frame.windings(frame.points, every)
    assert near.all()
    real = frame.patches.faces[frame.patches.faces[:, 0] != frame.patches.faces[:, 1]]
    skin = ClosestTree(frame.skin.body.astype(float), real)
    off = skin.closest(frame.points).distances > 1e-12  # on the skin itself there is no winding number
    assert off.sum() > 6000
    assert (winding == winding_numbers(frame.skin.body, real, frame.points))[off].all()
    for off in (3e-6, 1e-5, 1e-3):
        moved = (frame.points + np.float32(off) * np.array([0.36, 0.48, 0.8], np.float32)).astype(np.float32)
        _, near = frame.windings(moved, every)
        distance = skin.closest(moved).distances
        clear = np.abs(distance - frame.rounding) > 1e-7
        assert (near == (distance <= frame.rounding))[clear].all()
