"""Subdivides a garment into four times as many triangles."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from hemline.garments.clearance import push_out_of_body
from hemline.garments.dressing import body_tree
from hemline.garments.garment import Garment
from hemline.garments.pins import Pins
from hemline.meshes import subdivide

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

CLEARANCE = 0.001
"""Least distance of new vertices from the skin: more would push cloth in an armpit through itself [m]."""


def subdivide_garment(garment: Garment, shaped: "ShapedBody") -> Garment:
    """Cuts each triangle of a garment in four; cut and material stay the same.

    The middle of an edge between two pinned vertices is pinned to the skin, with the smaller stiffness of the two.

    Args:
        garment: A garment on this body, of one piece and without chains.
        shaped: The body.
    """
    faces, ends = subdivide(garment.faces, len(garment.vertices))
    middles = garment.vertices[ends].mean(axis=1)
    tree = body_tree(shaped)
    vertices = np.concatenate([garment.vertices, push_out_of_body(middles, tree, CLEARANCE)])
    edge = garment.rest_edges
    turned = np.stack([edge[:, :, 1], edge[:, :, 1] - edge[:, :, 0]], axis=2)
    rest_edges = 0.5 * np.stack([edge, edge, edge, turned], axis=1).reshape(-1, 2, 2)
    stiffness = np.zeros(len(garment.vertices), np.float32)
    stiffness[garment.pins.vertices] = garment.pins.stiffness
    between = np.flatnonzero((stiffness[ends] > 0).all(axis=1))
    pins = garment.pins
    if len(between):
        ids = len(garment.vertices) + between
        new = Pins.bind(ids, vertices[ids], tree, shaped.normals)
        new = replace(new, stiffness=stiffness[ends[between]].min(axis=1))
        vertices[ids] = new.positions(shaped.vertices, shaped.normals, shaped.body.faces, shaped.joints)
        pins = Pins.concatenate([pins, new])
    return replace(garment, vertices=vertices.astype(np.float32), faces=faces, rest_edges=rest_edges, pins=pins)
