"""Inputs of the graph network."""

import numpy as np

from hemline.animators.coarse.features.columns import DYNAMIC, STATIC, FeatureTable
from hemline.animators.coarse.features.descriptor import Descriptor
from hemline.animators.coarse.features.rest_features import fit_features, vertex_masses
from hemline.animators.coarse.proxy_on_body import ProxyOnBody
from hemline.arrays import Faces, Float, Vertices

from .garment_sample import GarmentSample
from .graph import Graph

ORDER = (
    *("skinned trail", "carried", "carried trail", "gravity"),
    *("nearness", "carried nearness", "joints", "beginning"),
)
"""Order in which the estimator is given the features that change."""
VERTEX = FeatureTable(*DYNAMIC.named(*ORDER), *STATIC.features)
"""Features of the blend shape and the displacement; those of the state encoder come first."""
STATE_FEATURES = VERTEX["carried"].stop
"""Number of features of the state encoder: the trail of a vertex and where its key joint would carry it."""
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
    return garment_sample(garment.faces, *parts, descriptor=descriptor)


def garment_sample(
    faces: Faces, cut: Vertices, fit: np.ndarray, skin: np.ndarray, mass: np.ndarray, *, descriptor: int
) -> GarmentSample:
    """Returns the inputs of a garment at rest from its parts.

    Args:
        faces: Triangles.
        cut: Vertices as the garment was made, from which its descriptor is computed (verts, 3) [m].
        fit: Normal, position [m] and signed distance to the body [m] of each settled vertex (verts, 7).
        skin: Skin weights (verts, joints).
        mass: Mass of each vertex (verts,) [kg].
        descriptor: Number of entries of the spectral descriptor.
    """
    eigenvalues = Descriptor.of(cut, faces, size=min(descriptor, len(cut))).pad_to(descriptor)
    return GarmentSample(Graph.of(faces, len(cut)), faces, fit, eigenvalues, skin_logits(skin), mass)


def vertex_inputs(
    dynamic: Float[np.ndarray, "... verts dynamic"], static: Float[np.ndarray, "verts static"]
) -> Float[np.ndarray, "... verts features"]:
    """Joins all features of vertices in the columns of `VERTEX`, float32.

    Args:
        dynamic: Features that change, see `Trail.features`.
        static: Features that do not change, see `ProxyOnBody.static`.
    """
    repeated = np.broadcast_to(static, (*dynamic.shape[:-1], static.shape[1]))
    return np.concatenate([*(dynamic[..., DYNAMIC[name]] for name in ORDER), repeated], axis=-1, dtype=np.float32)


def skin_logits(weights: Float[np.ndarray, "verts joints"]) -> Float[np.ndarray, "verts joints"]:
    """Returns logits whose softmax are given skin weights, clipped to at least 0.001, float32."""
    return np.log(np.maximum(weights, MIN_SKIN_WEIGHT)).astype(np.float32)
