"""What the graph network is given of a garment on a body."""

import numpy as np

from hemline.animators.coarse.features.descriptor import Descriptor
from hemline.animators.coarse.features.rest_features import fit_features, vertex_masses
from hemline.animators.coarse.fit.garment_frames import GarmentFrames
from hemline.animators.coarse.proxy_on_body import DYNAMIC_COUNT, STATIC_COUNT, TRAIL_COUNT, ProxyOnBody
from hemline.animators.swingar.fit.samples import GarmentSample
from hemline.arrays import Faces, Float, Vertices

from .graph import Graph

STATE_TOLD = TRAIL_COUNT + 3
"""Features of a vertex that the state encoder is given: how it trails, and where its key joint would carry it."""
TOLD = STATIC_COUNT + DYNAMIC_COUNT
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
    return _sample(garment.faces, *parts, descriptor=descriptor)


def garment_of_frames(frames: GarmentFrames, descriptor: int) -> GarmentSample:
    """The same of a garment whose frames are learned from."""
    faces, *parts = (np.array(each) for each in (frames.faces, frames.cut, frames.fit, frames.skin, frames.mass))
    return _sample(faces, *parts, descriptor=descriptor)


def _sample(
    faces: Faces, cut: Vertices, fit: np.ndarray, skin: np.ndarray, mass: np.ndarray, *, descriptor: int
) -> GarmentSample:
    found = Descriptor.of(cut, faces, size=min(descriptor, len(cut))).pad_to(descriptor)
    return GarmentSample(Graph.of(faces, len(cut)), faces, fit, found, skin_logits(skin), mass)


def vertex_inputs(
    told: Float[np.ndarray, "... verts dynamic"], static: Float[np.ndarray, "verts static"]
) -> Float[np.ndarray, "... verts told"]:
    """All features of vertices, those of the state encoder first, float32.

    Args:
        told: Those that change, see `Trail.told`.
        static: Those that do not, see `ProxyOnBody.static`.
    """
    key = slice(2 * TRAIL_COUNT, 2 * TRAIL_COUNT + 3)
    parts = told[..., :TRAIL_COUNT], told[..., key], told[..., TRAIL_COUNT : 2 * TRAIL_COUNT], told[..., key.stop :]
    still = np.broadcast_to(static, (*told.shape[:-1], static.shape[1]))
    return np.concatenate([*parts, still], axis=-1, dtype=np.float32)


def skin_logits(weights: Float[np.ndarray, "verts joints"]) -> Float[np.ndarray, "verts joints"]:
    """Logits whose softmax are given skin weights, each counted as 0.001 at least; float32."""
    return np.log(np.maximum(weights, LEAST)).astype(np.float32)
