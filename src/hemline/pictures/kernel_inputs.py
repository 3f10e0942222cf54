"""Named tuples that the kernels of pictures take: the mesh of a scene, its light, the look of the ground."""

from typing import NamedTuple

import numpy as np

from hemline.arrays import Faces, Float, Int, Vertices


class SceneMesh(NamedTuple):
    """All surfaces of a scene as one mesh."""

    faces: Faces
    """Triangles, int32."""
    face_surfaces: Int[np.ndarray, " faces"]
    """Surface that each triangle belongs to."""
    vertices: Vertices
    """Positions [m]."""
    normals: Vertices
    """Normals outward, of any length."""
    colours: Float[np.ndarray, "verts 3"]
    """Colours, linear, 0 to 1."""
    looks: Float[np.ndarray, "surfaces 4"]
    """Factors on the colour where the back of the surface is seen, then the amount of sheen [1]."""


class Lighting(NamedTuple):
    """The light of a scene."""

    lamps: Float[np.ndarray, "4 3"]
    """Unit directions to the key light and to the fill light, then colours of the sky and of the floor."""
    light_map: Float[np.ndarray, "3 4"]
    """Map from the world to x, y [texels] and nearness [m] in the shadow map."""
    shadow: Float[np.ndarray, "height width"]
    """Nearness to the key light of what it meets [m]."""
    bias: float
    """Distance from a surface at which its shadow is looked up [m]."""


class GroundLook(NamedTuple):
    """The ground plane and the background."""

    level: float
    """Height of the plane [m]."""
    tile_size: float
    """Edge of a tile [m]."""
    fade_radius: float
    """Distance from the middle at which the plane has faded [m]; 0 for no plane."""
    middle: Float[np.ndarray, "3"]
    """Point around which it fades [m]."""
    colours: Float[np.ndarray, "4 3"]
    """Sky at the top, horizon, light tile, dark tile; linear, 0 to 1."""
