"""What the graph network is given of a garment on a body."""

import numpy as np

from hemline.animators.swingar.features.proxy_on_body import TRAILS, ProxyOnBody
from hemline.arrays import Float
from hemline.bodies import PosedBody, ShapedBody
from hemline.meshes import ClosestTree, vertex_normals
from hemline.motions.quaternions import from_matrix, inverse, multiply, to_axis_angle

from .descriptor import Descriptor
from .estimator_config import JOINTS
from .graph import Graph
from .history import Seen
from .samples import GarmentSample

LAG = TRAILS + 3
"""Lag features of a vertex: how it trails, and where its key joint would carry it, in its turned frame."""
LEAST = 1e-3
"""Skin weights below this count as this in logits."""


def garment_inputs(proxy: ProxyOnBody, descriptor: int) -> GarmentSample:
    """The garment at rest.

    Args:
        proxy: The proxy on a body.
        descriptor: Numbers of the spectral descriptor.
    """
    garment, rest = proxy.garment, proxy.rest
    tree = ClosestTree(proxy.shaped.vertices, proxy.shaped.body.faces)
    fit = tree.signed_distances(rest)
    features = np.concatenate([vertex_normals(rest, garment.faces), rest, fit[:, None]], axis=1).astype(np.float32)
    return GarmentSample(
        Graph.of(garment.faces, len(rest)),
        garment.faces,
        features,
        Descriptor.of(garment.vertices, garment.faces, size=min(descriptor, len(rest))).padded_to(descriptor),
        skin_logits(proxy.skin.dense()),
        _masses(proxy),
    )


def skin_logits(weights: Float[np.ndarray, "verts joints"]) -> Float[np.ndarray, "verts joints"]:
    """Logits whose softmax are given skin weights, each counted as 0.001 at least; float32."""
    return np.log(np.maximum(weights, LEAST)).astype(np.float32)


def lag_inputs(told: Float[np.ndarray, "... dynamic"]) -> Float[np.ndarray, "... lag"]:
    """Of the features of `ProxyOnBody.describe`, those that the graph network is given."""
    return np.concatenate([told[..., :TRAILS], told[..., 2 * TRAILS : 2 * TRAILS + 3]], axis=-1)


def body_inputs(shaped: ShapedBody, posed: PosedBody, seen: Seen) -> Float[np.ndarray, " body"]:
    """Betas and axis-angles of the present pose, the root's without its heading, float32."""
    rotations = posed.pose.rotations.astype(np.float64)
    rotations[0] = multiply(inverse(from_matrix(seen.turn)), rotations[0])
    return np.concatenate([shaped.betas, to_axis_angle(rotations).reshape(3 * JOINTS)]).astype(np.float32)


def _masses(proxy: ProxyOnBody) -> Float[np.ndarray, " verts"]:
    """Mass of each vertex, a third of each of its triangles [kg]."""
    garment = proxy.garment
    one, two = garment.rest_edges[:, :, 0], garment.rest_edges[:, :, 1]
    areas = 0.5 * np.abs(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0])
    found = np.zeros(len(proxy.rest))
    np.add.at(found, garment.faces.ravel(), np.repeat(areas * garment.material.density / 3, 3))
    return found.astype(np.float32)
