"""Rendering of triangle meshes on one core, without a display or a GPU."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hemline.arrays import Faces, Float, UInt, Vertices
from hemline.errors import BadInput

from . import picture_kernels as kernels
from .camera import Camera
from .kernel_inputs import GroundLook, Lighting, SceneMesh

CLOTH = (0.72, 0.23, 0.17)
"""Warm red, for garments (sRGB, 0 to 1)."""

BODY = (0.70, 0.68, 0.66)
"""Neutral grey, for bodies (sRGB, 0 to 1)."""

TRUTH = (0.20, 0.42, 0.62)
"""Calm blue, for simulated garments (sRGB, 0 to 1)."""

Picture = UInt[np.ndarray, "height width 3"]
"""sRGB bytes, rows from the top."""

AnyPicture = UInt[np.ndarray, "height _width 3"]
"""One of several pictures of equal height, whose widths differ."""

_SHADOW_SIZE = 640
_TO_KEY_LIGHT, _TO_FILL_LIGHT = (0.75, 1.35, 0.5), (-0.8, 0.25, 0.55)
"""Directions to the two lights: to the right of the camera, up in the world, to the camera. They follow the camera."""
_SKY_LIGHT, _FLOOR_LIGHT = (0.50, 0.54, 0.60), (0.24, 0.22, 0.20)
_BACKGROUND = ((0.90, 0.92, 0.94), (0.975, 0.975, 0.97), (0.91, 0.905, 0.895), (0.86, 0.855, 0.845))
"""Sky at the top, horizon, light tile, dark tile (sRGB)."""
_SHADOW_BIAS = np.float32(0.006)
"""Distance from a surface at which its shadow is looked up [m]."""
_TILE_SIZE = np.float32(0.5)
"""Edge of a ground tile [m]."""


@dataclass(frozen=True)
class ShadedSurface:
    """A mesh with its appearance.

    Attributes:
        vertices: Positions [m].
        faces: Triangles, counter-clockwise from outside.
        colour: sRGB, 0 to 1.
        inside: Factor on the colour of the back, so that the two sides of cloth differ.
        sheen: Light at grazing angles; 0.1 looks like cloth, 0 like plaster.
        colours: sRGB at each vertex, 0 to 1; replaces `colour`.
    """

    vertices: Vertices
    faces: Faces
    colour: tuple[float, float, float] = CLOTH
    inside: tuple[float, float, float] = (0.62, 0.66, 0.78)
    sheen: float = 0.08
    colours: Float[np.ndarray, "verts 3"] | None = None


def render(
    surfaces: Sequence[ShadedSurface],
    camera: Camera,
    size: tuple[int, int] = (640, 640),
    *,
    ground: float | None = 0.0,
) -> Picture:
    """Renders surfaces with a depth buffer, smooth normals, soft shadows and four samples per pixel.

    A triangle with a corner behind the camera is skipped.

    Args:
        surfaces: The surfaces, which hide and shade each other.
        camera: The camera.
        size: Width and height [pixels].
        ground: Height of the ground plane [m]; None: no ground.

    Returns:
        The picture (height, width, 3) uint8, sRGB.

    Raises:
        BadInput: A face points past the last vertex, or a vertex is not finite.
    """
    for surface in surfaces:
        check_surface(surface)
    width, height = size
    vertices = _join([surface.vertices for surface in surfaces], np.float32)
    starts = np.cumsum([0] + [len(surface.vertices) for surface in surfaces])[:-1]
    faces = _join([surface.faces + start for surface, start in zip(surfaces, starts, strict=True)], np.int32)
    face_surfaces = np.repeat(np.arange(len(surfaces), dtype=np.int32), [len(surface.faces) for surface in surfaces])
    colours = linear(_join([_vertex_colours(surface) for surface in surfaces], np.float32))
    looks = np.array([(*surface.inside, surface.sheen) for surface in surfaces], np.float32).reshape(-1, 4)
    normals = np.empty_like(vertices)
    kernels.accumulate_normals(vertices, faces, normals)
    screen = camera.project(vertices, (2 * width, 2 * height))
    screen[:, 2] = np.where(screen[:, 2] > 0.02, 1 / np.maximum(screen[:, 2], 0.02), -1)
    screen = screen.astype(np.float32)
    depth, faces_seen = np.zeros((2 * height, 2 * width), np.float32), np.full((2 * height, 2 * width), -1, np.int32)
    kernels.rasterise(screen, faces, depth, faces_seen)
    to_lights = _to_lights(camera)
    box = _bounds(vertices)
    light_map, shadow = _shadow_map(vertices, faces, to_lights[0])
    eye = np.array(camera.eye, np.float32)
    background = np.empty((height, width, 3), np.float32)
    _shade_ground(camera, ground, box, light_map, shadow, background)
    picture = np.empty_like(background)
    lamps = np.array([*to_lights, _SKY_LIGHT, _FLOOR_LIGHT], np.float32)
    mesh = SceneMesh(faces, face_surfaces, vertices, normals, colours, looks)
    kernels.shade(screen, mesh, eye, Lighting(lamps, light_map, shadow, _SHADOW_BIAS), faces_seen, background, picture)
    bytes_out = np.empty((height, width, 3), np.uint8)
    kernels.encode(picture, _SRGB_TABLE, bytes_out)
    return bytes_out


def linear(srgb: Float[np.ndarray, "... 3"] | tuple[float, float, float]) -> Float[np.ndarray, "... 3"]:
    """Converts sRGB values in [0, 1] to linear light (IEC 61966-2-1)."""
    srgb = np.asarray(srgb, np.float32)
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4).astype(np.float32)


def _to_lights(camera: Camera) -> Float[np.ndarray, "2 3"]:
    right = camera.axes[0]
    frame = np.stack([right, [0.0, 1.0, 0.0], np.cross(right, [0.0, 1.0, 0.0])])
    lights = np.array([_TO_KEY_LIGHT, _TO_FILL_LIGHT]) @ frame
    return lights / np.linalg.norm(lights, axis=1, keepdims=True)


def _bounds(points: np.ndarray) -> Float[np.ndarray, "2 3"]:
    if not len(points):
        return np.zeros((2, 3), np.float32)
    return np.array([[axis.min() for axis in points.T], [axis.max() for axis in points.T]], np.float32)


def _shadow_map(vertices: np.ndarray, faces: np.ndarray, to_light: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns the map from the world to (x, y [texels], nearness to the light [m]) as (3, 4), and the shadow map."""
    shadow = np.full((_SHADOW_SIZE, _SHADOW_SIZE), -1e9, np.float32)
    if not len(vertices):
        return np.zeros((3, 4), np.float32), shadow
    axes = Camera(tuple(to_light.tolist()), (0.0, 0.0, 0.0)).axes
    in_light = vertices @ axes.T.astype(np.float32)
    low, high = _bounds(in_light)
    rim = 40  # texels that stay free, so that blurred shadows end inside the map
    scale = (_SHADOW_SIZE - 2 * rim) / max(float((high - low)[:2].max()), 1e-6)
    middle = 0.5 * (low + high)
    rows = np.concatenate([axes, -np.array([[middle[0]], [middle[1]], [low[2] - 1.0]])], axis=1)
    rows[:2] *= scale
    rows[:2, 3] += 0.5 * _SHADOW_SIZE
    light_map = rows.astype(np.float32)
    screen = np.ascontiguousarray(vertices @ light_map[:, :3].T + light_map[:, 3])
    kernels.rasterise(screen, faces, shadow, np.empty(shadow.shape, np.int32))
    return light_map, shadow


def _shade_ground(camera, ground, box, light_map, shadow, background) -> None:
    height, width = background.shape[:2]
    occupied = (shadow > 0).astype(np.float32)
    blurred, sums = np.empty_like(occupied), np.empty_like(occupied)
    for _ in range(2):
        kernels.box_blur(occupied, 7, sums, blurred)
        occupied, blurred = blurred, occupied
    right, up, back = camera.axes
    pixel = 2 * np.tan(0.5 * camera.field_of_view) / height
    corner = -back + (0.5 - 0.5 * width) * pixel * right + (0.5 * height - 0.5) * pixel * up
    rays = np.array([corner, right * pixel, -up * pixel], np.float32)
    extent = float((box[1] - box[0]).max())
    fade_radius = np.float32(0.0 if ground is None else 1.6 * extent + 1.0)
    middle, colours = 0.5 * (box[0] + box[1]), linear(np.array(_BACKGROUND, np.float32))
    look = GroundLook(np.float32(ground or 0.0), _TILE_SIZE, fade_radius, middle, colours)
    kernels.shade_ground(rays, np.array(camera.eye, np.float32), look, light_map, occupied, background)


def _join(arrays: list[np.ndarray], dtype: type) -> np.ndarray:
    return np.ascontiguousarray(np.concatenate([np.zeros((0, 3), dtype), *arrays]), dtype)


def _vertex_colours(surface: ShadedSurface) -> np.ndarray:
    if surface.colours is not None:
        return np.asarray(surface.colours, np.float32)
    return np.tile(np.array(surface.colour, np.float32), (len(surface.vertices), 1))


def check_surface(surface: ShadedSurface) -> None:
    """Refuses a surface that cannot be rendered.

    Raises:
        BadInput: A face points past the last vertex, or a vertex is not finite.
    """
    if len(surface.faces) and (surface.faces.min() < 0 or surface.faces.max() >= len(surface.vertices)):
        got = f"face indices {surface.faces.min()} to {surface.faces.max()} for {len(surface.vertices)} vertices"
        raise BadInput("a face points past the last vertex", got, "pass the vertices that belong to these faces")
    if not np.isfinite(surface.vertices).all():
        raise BadInput("vertices must be finite", "NaN or infinity", "draw only frames that were computed")


_LEVELS = np.linspace(0, 1, 4096)
_SRGB_TABLE = np.round(
    255 * np.where(_LEVELS <= 0.0031308, 12.92 * _LEVELS, 1.055 * _LEVELS ** (1 / 2.4) - 0.055)
).astype(np.uint8)
