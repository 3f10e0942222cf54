"""What the graph network is given of a garment on a body."""

import numpy as np

from hemline.animators.swingar.features.proxy_on_body import DYNAMIC, STATIC, TRAILS, ProxyOnBody
from hemline.animators.swingar.features.worn_frames import WornFrames
from hemline.arrays import Faces, Float, Vertices
from hemline.bodies import PosedBody, ShapedBody
from hemline.meshes import ClosestTree, vertex_normals
from hemline.motions.quaternions import from_matrix, inverse, multiply, to_axis_angle

from .descriptor import Descriptor
from .estimator_config import JOINTS
from .graph import Graph
from .history import Seen
from .samples import GarmentSample

STATE_TOLD = TRAILS + 3
"""Features of a vertex that the state encoder is given: how it trails, and where its key joint would carry it."""
TOLD = STATIC + DYNAMIC
"""Features of a vertex that the blend shape and the displacement are given; those of the state encoder come first."""
LEAST = 1e-3
"""Skin weights below this count as this in logits."""


def garment_inputs(proxy: ProxyOnBody, descriptor: int) -> GarmentSample:
    """The garment at rest.

    Args:
        proxy: The proxy on a body.
        descriptor: Numbers of the spectral descriptor.
    """
    garment = proxy.garment
    parts = garment.vertices, fit_features(proxy), proxy.skin.dense(), vertex_masses(proxy)
    return _sample(garment.faces, *parts, descriptor)


def garment_of_frames(frames: WornFrames, descriptor: int) -> GarmentSample:
    """The same of a garment whose frames are learned from."""
    parts = (np.array(each) for each in (frames.faces, frames.cut, frames.fit, frames.skin, frames.mass))
    return _sample(*parts, descriptor)


def _sample(
    faces: Faces, cut: Vertices, fit: np.ndarray, skin: np.ndarray, mass: np.ndarray, descriptor: int
) -> GarmentSample:
    found = Descriptor.of(cut, faces, size=min(descriptor, len(cut))).padded_to(descriptor)
    return GarmentSample(Graph.of(faces, len(cut)), faces, fit, found, skin_logits(skin), mass)


def fit_features(proxy: ProxyOnBody) -> Float[np.ndarray, "verts 7"]:
    """Normal, position [m] and signed distance to the body [m] of each vertex at rest, float32."""
    tree = ClosestTree(proxy.shaped.vertices, proxy.shaped.body.faces)
    rest, away = proxy.rest, tree.signed_distances(proxy.rest)
    return np.concatenate([vertex_normals(rest, proxy.garment.faces), rest, away[:, None]], axis=1).astype(np.float32)


def vertex_inputs(
    told: Float[np.ndarray, "... verts dynamic"], static: Float[np.ndarray, "verts static"]
) -> Float[np.ndarray, "... verts told"]:
    """All features of vertices, those of the state encoder first, float32.

    Args:
        told: Those that change, see `Trail.told`.
        static: Those that do not, see `ProxyOnBody.static`.
    """
    key = slice(2 * TRAILS, 2 * TRAILS + 3)
    parts = told[..., :TRAILS], told[..., key], told[..., TRAILS : 2 * TRAILS], told[..., key.stop :]
    still = np.broadcast_to(static, (*told.shape[:-1], static.shape[1]))
    return np.concatenate([*parts, still], axis=-1, dtype=np.float32)


def skin_logits(weights: Float[np.ndarray, "verts joints"]) -> Float[np.ndarray, "verts joints"]:
    """Logits whose softmax are given skin weights, each counted as 0.001 at least; float32."""
    return np.log(np.maximum(weights, LEAST)).astype(np.float32)


def body_inputs(shaped: ShapedBody, posed: PosedBody, seen: Seen) -> Float[np.ndarray, " body"]:
    """Betas and axis-angles of the present pose, the root's without its heading, float32."""
    rotations = posed.pose.rotations.astype(np.float64)
    rotations[0] = multiply(inverse(from_matrix(seen.turn)), rotations[0])
    return np.concatenate([shaped.betas, to_axis_angle(rotations).reshape(3 * JOINTS)]).astype(np.float32)


def vertex_masses(proxy: ProxyOnBody) -> Float[np.ndarray, " verts"]:
    """Mass of each vertex, a third of each of its triangles [kg]."""
    garment = proxy.garment
    one, two = garment.rest_edges[:, :, 0], garment.rest_edges[:, :, 1]
    areas = 0.5 * np.abs(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0])
    found = np.zeros(len(proxy.rest))
    np.add.at(found, garment.faces.ravel(), np.repeat(areas * garment.material.density / 3, 3))
    return found.astype(np.float32)
