"""The cones that the viewer draws are those that ropes collide with."""

import numpy as np
import pytest

from hemline import bodies, motions
from hemline.collide.primitives.body_primitives import BodyPrimitives
from hemline.collide.primitives.primitive_kernels import ROUND_CONE
from hemline.meshes import face_normals
from hemline.view.browser.colliders import cone_surfaces


def test_every_vertex_is_on_its_own_cone_and_none_is_deep_inside_all():
    body = bodies.load("anny24").shaped((1.5, -1.0))
    posed, primitives = body.posed(motions.load("kick")[30]), BodyPrimitives.fit(body)
    vertices, faces = cone_surfaces(primitives, posed.transforms)
    cones = len(primitives.joints)
    for number, own in enumerate(np.split(vertices.astype(np.float64), cones)):
        kinds, joints, shapes = (
            np.ascontiguousarray(each[number : number + 1])
            for each in (primitives.kinds, primitives.joints, primitives.shapes)
        )
        alone = BodyPrimitives(kinds, joints, shapes, primitives.pivots)
        assert np.abs(alone.distances(own, posed.transforms)[0]).max() < 1e-5
    assert primitives.distances(vertices.astype(np.float64), posed.transforms)[0].max() < 1e-5
    centres = vertices.reshape(cones, -1, 3).mean(axis=1)
    corners = vertices[faces].mean(axis=1).reshape(cones, -1, 3)
    outward = face_normals(vertices.astype(np.float64), faces).reshape(cones, -1, 3)
    assert (np.einsum("cfi,cfi->cf", outward, corners - centres[:, None]) > -1e-6).all()


@pytest.mark.parametrize("radii", [(0.1, 0.02), (0.02, 0.1), (0.05, 0.05)])
def test_a_cone_whose_one_end_holds_the_other_is_a_sphere(radii):
    shape = np.array([[0.0, 0.0, 0.0, 0.0, 0.03, 0.0, *radii, *[0.0] * 8]])
    primitives = BodyPrimitives(np.array([ROUND_CONE], np.int32), np.zeros(1, np.int32), shape, np.zeros((24, 3)))
    still = np.tile(np.eye(4)[:3], (24, 1, 1)).astype(np.float32)
    vertices, _ = cone_surfaces(primitives, still)
    assert np.abs(primitives.distances(vertices.astype(np.float64), still)[0]).max() < 1e-6
