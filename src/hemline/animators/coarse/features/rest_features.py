"""Properties of the vertices of a proxy at rest on its body."""

import numpy as np

from hemline.animators.coarse.proxy_on_body import ProxyOnBody
from hemline.arrays import Float
from hemline.meshes import ClosestTree, vertex_normals


def fit_features(proxy: ProxyOnBody) -> Float[np.ndarray, "verts 7"]:
    """Returns normal, position [m] and signed distance to the body [m] of each vertex at rest, float32."""
    tree = ClosestTree(proxy.shaped.vertices, proxy.shaped.body.faces)
    rest, away = proxy.rest, tree.signed_distances(proxy.rest)
    return np.concatenate([vertex_normals(rest, proxy.garment.faces), rest, away[:, None]], axis=1).astype(np.float32)


def vertex_masses(proxy: ProxyOnBody) -> Float[np.ndarray, " verts"]:
    """Returns the mass of each vertex, a third of each of its triangles [kg], float32."""
    garment = proxy.garment
    one, two = garment.rest_edges[:, :, 0], garment.rest_edges[:, :, 1]
    areas = 0.5 * np.abs(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0])
    found = np.zeros(len(proxy.rest))
    np.add.at(found, garment.faces.ravel(), np.repeat(areas * garment.material.density / 3, 3))
    return found.astype(np.float32)
