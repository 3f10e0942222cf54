"""A square sheet over a ball, and what an animator could make of it."""

from types import SimpleNamespace

import numpy as np

from hemline.collide import GarmentOnBody, WholeCloth, WholeSettings
from hemline.garments import Pins
from tests.collide.projection_samples import spheres

DT = 1 / 30
SMALL = WholeSettings(controls=60, samples=150)
RADIUS = 0.1


def ball():
    """A body of one bone: a ball of 10 cm around the origin."""
    rest, faces = spheres((0, 0, 0), radius=RADIUS, subdivisions=4)
    indices, weights = np.zeros((len(rest), 6), np.int32), np.zeros((len(rest), 6), np.float32)
    weights[:, 0] = 1
    body = SimpleNamespace(faces=faces, weight_indices=indices, weights=weights, parents=np.array([-1]))
    return SimpleNamespace(body=body, vertices=rest)


def at(shaped, centre, turn=None):
    """The ball moved, and turned about the vertical [rad]."""
    transforms = np.zeros((1, 3, 4), np.float32)
    cosine, sine = np.cos(turn or 0), np.sin(turn or 0)
    transforms[0, :, :3] = [[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]]
    transforms[0, :, 3] = centre
    vertices = (shaped.vertices @ transforms[0, :, :3].T + transforms[0, :, 3]).astype(np.float32)
    return SimpleNamespace(
        shaped=shaped, transforms=transforms, vertices=vertices, faces=shaped.body.faces, joints=transforms[:, :, 3]
    )


def sheet(side=0.4, count=41, height=0.12, pinned=()):
    """A level square sheet over the ball, 1 cm edges, faces upwards; pins hang on the ball's bone."""
    place = np.linspace(-side / 2, side / 2, count)
    x, z = np.meshgrid(place, place)
    vertices = np.stack([x, np.full_like(x, height), z], axis=-1).reshape(-1, 3)
    corner = (np.arange(count - 1)[:, None] * count + np.arange(count - 1)).reshape(-1)
    one = np.stack([corner, corner + count, corner + 1], axis=1)
    other = np.stack([corner + 1, corner + count, corner + count + 1], axis=1)
    faces = np.concatenate([one, other]).astype(np.int32)
    flat = vertices[faces][:, :, [0, 2]]
    rest_edges = np.stack([flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]], axis=2)
    pins = np.asarray(pinned, np.int32)
    return SimpleNamespace(
        vertices=vertices.astype(np.float32),
        faces=faces,
        rest_edges=rest_edges,
        pins=Pins.on_joint(pins, vertices[pins], 0, np.zeros((1, 3), np.float32)),
    )


def prepared(garment, settings=SMALL):
    """Body and step."""
    shaped = ball()
    return shaped, WholeCloth.prepare(shaped, garment, GarmentOnBody.of(shaped, garment.vertices), settings)


def stepped(whole, state, posed, vertices, frames=1, dt=DT):
    """The same frame several times over."""
    for _ in range(frames):
        state, held = whole.step(state, posed, vertices, dt=dt)
    return state, held


def stretches(garment, vertices):
    """One-sided stretch of all edges [1]."""
    from hemline.meshes import rest_lengths, strains

    return np.maximum(strains(vertices.astype(float), *rest_lengths(garment.faces, garment.rest_edges)), 0)
