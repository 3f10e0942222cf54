"""The spectral descriptor: what leaves it as it is, what changes it, and closed forms."""

import time

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hemline import garments
from hemline.animators.coarse.features.descriptor import AFFINITY_RADIUS, Descriptor, eigenvectors
from hemline.errors import BadMesh, HemlineWarning
from tests.animators.swingar.swingar_samples import sheet


def turned(vertices: np.ndarray, faces: np.ndarray, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """The mesh moved rigidly, its vertices and triangles in another order."""
    random = np.random.default_rng(seed)
    order = random.permutation(len(vertices))
    moved = Rotation.random(random_state=seed).apply(vertices) + [0.3, 1.2, -0.7]
    return moved[order].astype(np.float32), random.permutation(np.argsort(order)[faces]).astype(np.int32)


@pytest.mark.parametrize("name", ["cape-light", "skirt-light", "tshirt-light", "trousers-light", "longsleeve-light"])
def test_neither_rigid_motion_nor_the_order_of_vertices_changes_it(name):
    garment = garments.load(name)
    found = Descriptor.of(garment.vertices, garment.faces)
    moved, faces = turned(garment.vertices, garment.faces)
    other = Descriptor.of(moved, faces)
    assert np.abs(found.eigenvalues - other.eigenvalues).max() < 1e-3
    assert np.all(np.diff(found.eigenvalues) <= 0) and len(found.samples) == 256
    assert found.eigenvalues.sum() == pytest.approx(256, rel=1e-4)  # the trace: each point is like itself


def test_bending_leaves_it_and_scaling_does_not():
    vertices, faces = sheet(12, 15)
    flat = np.stack([vertices[:, 0], vertices[:, 1], 0 * vertices[:, 0]], 1)
    rolled = np.stack([flat[:, 0], 0.2 * np.sin(flat[:, 1] / 0.2), 0.2 * np.cos(flat[:, 1] / 0.2)], 1)
    one, bent, large = (Descriptor.of(np.float32(each), faces, size=64) for each in (flat, rolled, 2 * flat))
    assert one.distance(bent) < 0.05 * one.distance(large)
    straight = [Descriptor.of(np.float32(each), faces, size=64, distance="euclidean") for each in (flat, rolled)]
    assert one.distance(bent) < straight[0].distance(straight[1])


def test_two_points_have_the_eigenvalues_of_a_matrix_of_two():
    triangle = np.array([[0, 0, 0], [0.2, 0, 0], [0.1, 0.01, 0]], np.float32)
    found = Descriptor.of(triangle, np.array([[0, 1, 2]], np.int32), size=2)
    near = np.exp(-((0.2 / AFFINITY_RADIUS) ** 2) / 2)
    assert found.eigenvalues == pytest.approx([1 + near, 1 - near], rel=1e-4)
    assert sorted(found.samples.tolist()) == [0, 1]


def test_parts_that_hang_together_with_nothing_have_no_affinity():
    vertices, faces = sheet(5, 6)
    alone = Descriptor.of(vertices, faces, size=30)
    both = Descriptor.of(
        np.concatenate([vertices, vertices + np.float32([0.01, 0, 0])]), np.concatenate([faces, faces + 30]), size=60
    )
    assert both.eigenvalues[::2] == pytest.approx(alone.eigenvalues, abs=1e-4)
    assert both.eigenvalues[1::2] == pytest.approx(alone.eigenvalues, abs=1e-4)


def test_a_small_mesh_is_filled_up_and_says_so():
    vertices, faces = sheet(5, 6)
    with pytest.warns(HemlineWarning, match="filled up with zeros; got 30 vertices"):
        found = Descriptor.of(vertices, faces)
    assert 256 - len(found.samples) == 226 == np.sum(found.eigenvalues == 0) and np.all(np.diff(found.eigenvalues) <= 0)


def test_a_mesh_without_triangles_is_refused():
    with pytest.raises(BadMesh, match="a spectral descriptor needs a mesh"):
        Descriptor.of(np.zeros((3, 3), np.float32), np.zeros((0, 3), np.int32))


def test_twenty_thousand_vertices_take_seconds():
    vertices, faces = sheet(125, 160)
    begun = time.process_time()
    Descriptor.of(vertices, faces)
    assert time.process_time() - begun < 15


def test_the_same_kind_of_garment_is_the_most_similar():
    names = ["tshirt-light", "longsleeve-light", "skirt-light", "cape-light", "trousers-light"]
    found = [Descriptor.of(each.vertices, each.faces) for each in map(garments.load, names)]
    tshirt = garments.load("tshirt-light")
    longer = Descriptor.of(tshirt.vertices * np.float32([1.05, 1.1, 1.05]), tshirt.faces)
    assert names[int(np.argmin([longer.distance(each) for each in found]))] == "tshirt-light"
    assert found[0].distance(found[0]) == 0


def test_estimated_eigenvectors_are_those_of_the_whole_matrix():
    from scipy.sparse.csgraph import dijkstra

    from hemline.animators.coarse.features.descriptor import _edge_lengths, affinity

    vertices, faces = sheet(12, 15)
    found = eigenvectors(vertices, faces, Descriptor.of(vertices, faces, size=180), 3)
    whole = np.linalg.eigh(affinity(dijkstra(_edge_lengths(vertices, faces))))[1][:, ::-1][:, :3]
    cosines = np.abs(np.sum(found * whole, 0)) / np.linalg.norm(found, axis=0)
    assert np.all(cosines > 0.999)
    assert np.linalg.norm(found, axis=0) == pytest.approx(np.ones(3), rel=1e-3)
