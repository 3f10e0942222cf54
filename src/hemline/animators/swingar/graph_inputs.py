"""Inputs of the graph network."""

import numpy as np

from hemline.animators.coarse.features.descriptor import Descriptor
from hemline.animators.coarse.features.rest_features import fit_features, vertex_masses
from hemline.animators.coarse.fit.garment_frames import GarmentFrames
from hemline.animators.coarse.proxy_on_body import DYNAMIC_COUNT, STATIC_COUNT, TRAIL_COUNT, ProxyOnBody
from hemline.animators.swingar.fit.samples import GarmentSample
from hemline.arrays import Faces, Float, Vertices

from .graph import Graph

STATE_FEATURES = TRAIL_COUNT + 3
"""Number of features of the state encoder: the trail of a vertex and where its key joint would carry it."""
VERTEX_FEATURES = STATIC_COUNT + DYNAMIC_COUNT
"""Number of features of the blend shape and the displacement; those of the state encoder come first."""
MIN_SKIN_WEIGHT = 1e-3
"""Smallest skin weight in logits."""


def garment_inputs(proxy: ProxyOnBody, descriptor: int) -> GarmentSample:
    """Returns the inputs of a garment at rest.

    Args:
        proxy: The proxy on a body.
        descriptor: Number of entries of the spectral descriptor.
    """
    garment = proxy.garment
    parts = garment.vertices, fit_features(proxy), proxy.skin.dense(), vertex_masses(proxy)
    return _sample(garment.faces, *parts, descriptor=descriptor)


def garment_of_frames(frames: GarmentFrames, descriptor: int) -> GarmentSample:
    """Returns the inputs of a garment at rest whose frames are trained on."""
    faces, *parts = (np.array(each) for each in (frames.faces, frames.cut, frames.fit, frames.skin, frames.mass))
    return _sample(faces, *parts, descriptor=descriptor)


def _sample(
    faces: Faces, cut: Vertices, fit: np.ndarray, skin: np.ndarray, mass: np.ndarray, *, descriptor: int
) -> GarmentSample:
    eigenvalues = Descriptor.of(cut, faces, size=min(descriptor, len(cut))).pad_to(descriptor)
    return GarmentSample(Graph.of(faces, len(cut)), faces, fit, eigenvalues, skin_logits(skin), mass)


def vertex_inputs(
    dynamic: Float[np.ndarray, "... verts dynamic"], static: Float[np.ndarray, "verts static"]
) -> Float[np.ndarray, "... verts features"]:
    """Joins all features of vertices, those of the state encoder first, float32.

    Args:
        dynamic: Features that change, see `Trail.features`.
        static: Features that do not change, see `ProxyOnBody.static`.
    """
    key = slice(2 * TRAIL_COUNT, 2 * TRAIL_COUNT + 3)
    trails = dynamic[..., :TRAIL_COUNT], dynamic[..., key], dynamic[..., TRAIL_COUNT : 2 * TRAIL_COUNT]
    repeated = np.broadcast_to(static, (*dynamic.shape[:-1], static.shape[1]))
    return np.concatenate([*trails, dynamic[..., key.stop :], repeated], axis=-1, dtype=np.float32)


def skin_logits(weights: Float[np.ndarray, "verts joints"]) -> Float[np.ndarray, "verts joints"]:
    """Returns logits whose softmax are given skin weights, clipped to at least 0.001, float32."""
    return np.log(np.maximum(weights, MIN_SKIN_WEIGHT)).astype(np.float32)
