"""A small picture of a garment for notebooks, in plain numpy, since garments import no renderer."""

import base64
import html
import struct
import zlib

import numpy as np

from hemline.arrays import Faces, Float, UInt, Vertices

LONGEST = 240
"""Number of pixels along the longer side of the garment."""
MARGIN = 6
"""Width of the empty border [pixels]."""
CLOTH, PAPER = np.array([184.0, 59.0, 43.0]), 255
"""Colour of cloth in full light, and of the background (sRGB, 0 to 255)."""
LIGHT = np.array([0.35, 0.45, 0.82])
"""Direction to the light: to the right, up, and to the viewer."""


def thumbnail(vertices: Vertices, faces: Faces) -> UInt[np.ndarray, "height width 3"]:
    """Draws a mesh from the front: sRGB bytes, rows from the top.

    Args:
        vertices: Positions [m], y up; the viewer looks along -z.
        faces: Triangles, counter-clockwise from outside.
    """
    low, extent = vertices.min(axis=0), np.ptp(vertices, axis=0)
    pixel = max(float(extent[:2].max()), 1e-6) / LONGEST
    corners = ((vertices - low) / pixel)[faces].astype(np.float64)
    points, colours = _points(corners, _colours(corners))
    columns, rows = (np.floor(points[:, axis]).astype(int) + MARGIN for axis in (0, 1))
    width, height = (int(each / pixel) + 2 * MARGIN + 1 for each in extent[:2])
    nearest_last = np.argsort(points[:, 2])
    picture = np.full((height, width, 3), PAPER, np.uint8)
    picture[height - 1 - rows[nearest_last], columns[nearest_last]] = colours[nearest_last]
    return picture


def png_bytes(picture: UInt[np.ndarray, "height width 3"]) -> bytes:
    """Encodes a picture (sRGB bytes, rows from the top) as PNG."""
    height, width, _ = picture.shape
    lines = np.concatenate([np.zeros((height, 1), np.uint8), picture.reshape(height, -1)], axis=1)

    def chunk(kind: bytes, content: bytes) -> bytes:
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    body = zlib.compress(lines.tobytes())
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", body) + chunk(b"IEND", b"")


def figure_html(picture: UInt[np.ndarray, "height width 3"], caption: str) -> str:
    """Returns a picture (sRGB bytes, rows from the top) and its caption as HTML that needs no other file."""
    image = base64.b64encode(png_bytes(picture)).decode("ascii")
    text = html.escape(caption)
    return f"<figure><img alt='{text}' src='data:image/png;base64,{image}'><figcaption>{text}</figcaption></figure>"


def _points(
    corners: Float[np.ndarray, "faces 3 3"], colours: Float[np.ndarray, "faces 3"]
) -> tuple[Float[np.ndarray, "points 3"], Float[np.ndarray, "points 3"]]:
    """Returns points that lie closer than a pixel on all triangles, in pixels, with their colours (sRGB, 0 to 255)."""
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=-1).max(axis=1)
    counts = 2 ** np.ceil(np.log2(1.5 * longest + 1)).astype(int)  # steps along an edge; few sizes, so few groups
    points, point_colours = [], []
    for count in np.unique(counts):
        a, b = (each.ravel() for each in np.meshgrid(np.arange(count + 1), np.arange(count + 1)))
        weights = (np.stack([a, b, count - a - b], axis=1) / count)[a + b <= count]
        chosen = counts == count
        points.append(np.einsum("wc,fcx->fwx", weights, corners[chosen]).reshape(-1, 3))
        point_colours.append(colours[chosen].repeat(len(weights), axis=0))
    return np.concatenate(points), np.concatenate(point_colours)


def _colours(corners: Float[np.ndarray, "faces 3 3"]) -> Float[np.ndarray, "faces 3"]:
    """Returns the colour of each triangle (sRGB, 0 to 255), whose corners are in pixels; its back is darker."""
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    front = normals[:, 2] >= 0
    light = np.clip(np.where(front, 1.0, -1.0) * (normals @ LIGHT), 0, 1) * np.where(front, 1.0, 0.6)
    return CLOTH * (0.35 + 0.65 * light[:, None])
