"""Garments that tests of statics share."""

import numpy as np

from hemline import bodies
from hemline.garments import Garment
from hemline.garments.material import Material
from hemline.garments.pins import Pins
from hemline.meshes import ClosestTree
from tests.sim.sim_sheets import grid


def hanging_strip(*, pinned: bool = True, young: float = 60.0):
    """A strip of 0.6 m, pinned above, that hangs before the chest without touching; the body, and the length."""
    shaped, length = bodies.load("anny24").shaped(), 0.6
    flat, faces, rest = grid(4, 31, 0.06, length)
    vertices = np.stack([flat[:, 0] - 0.03, 0.3 - flat[:, 1], np.full(len(flat), 0.22)], axis=1)
    tree = ClosestTree(shaped.vertices.astype(np.float64), shaped.body.faces)
    top = np.flatnonzero(flat[:, 1] == 0) if pinned else np.zeros(0, int)
    pins = Pins.bind(top, vertices[top], tree, shaped.normals)
    vertices[top] = pins.positions(shaped.vertices, shaped.normals, shaped.body.faces, shaped.joints)
    material = Material("test", density=0.15, young=young, poisson=0.0, bending=1e-7, drag=0.0, lift=0.0)
    garment = Garment(
        name="strip",
        vertices=vertices.astype(np.float32),
        faces=faces,
        rest_edges=rest,
        material=material,
        pins=pins,
        key_joint="spine3",
    )
    return garment, shaped, length


def hanging_loop(*, gap: float = 0.0008, radius: float = 0.03):
    """A strip of 0.6 m hung by both ends, nearer to each other than cloth is to itself: its halves press; the body."""
    shaped, length = bodies.load("anny24").shaped(), 0.6
    flat, faces, rest = grid(4, 41, 0.06, length)
    along, straight = flat[:, 1], (length - np.pi * radius) / 2
    # a teardrop: two legs that part from the gap above to half a circle below
    angle, leg = np.clip((along - straight) / radius, 0, np.pi), np.minimum(np.minimum(along, length - along), straight)
    side = np.sign(length / 2 - along) * (gap / 2 + (radius - gap / 2) * leg / straight)
    x = np.where((angle > 0) & (angle < np.pi), radius * np.cos(angle), side)
    vertices = np.stack([x, 0.3 - leg - radius * np.sin(angle), 0.22 + flat[:, 0]], axis=1)
    tree = ClosestTree(shaped.vertices.astype(np.float64), shaped.body.faces)
    ends = np.flatnonzero((along == 0) | (along == along.max()))
    pins = Pins.bind(ends, vertices[ends], tree, shaped.normals)
    vertices[ends] = pins.positions(shaped.vertices, shaped.normals, shaped.body.faces, shaped.joints)
    material = Material("test", density=0.15, young=60.0, poisson=0.0, bending=3e-6, drag=0.0, lift=0.0)
    garment = Garment(
        name="loop",
        vertices=vertices.astype(np.float32),
        faces=faces,
        rest_edges=rest,
        material=material,
        pins=pins,
        key_joint="spine3",
    )
    return garment, shaped
