"""Named tuples of the projection's kernels: the garment of one frame, and the positions proposed for its vertices.

All positions are in the frame of the key bone, all vertices in the projector's own order.
"""

from typing import NamedTuple

import numpy as np

from hemline.arrays import Bool, Float, Int, Points


class Cloth(NamedTuple):
    """The garment in one frame, and what is remembered of each of its vertices."""

    points: Points
    """Positions as the animator made them, float32 [m]."""
    places: Int[np.ndarray, " verts"]
    """The face that contact holds each vertex off from, -1 for none."""
    anchors: Int[np.ndarray, " verts"]
    """The face found nearest last; kernels write to it."""
    heights: Float[np.ndarray, " verts"]
    """Signed distance to the skin when last measured [m]; kernels write to it."""
    offsets: Float[np.ndarray, "verts 3"]
    """Displacement in the last frame [m]."""


class LiftDistances(NamedTuple):
    """Distances of `ProjectionSettings` that decide how far vertices are moved out of the skin [m]."""

    margin: np.float32
    """A vertex nearer to the skin is moved out."""
    gap: np.float32
    """Least distance of moved vertices."""
    far: np.float32
    """A vertex farther out is measured only in some frames."""


class Escapes(NamedTuple):
    """Ways out for blocked vertices; kernels write to them."""

    trials: Float[np.ndarray, "blocked 3"]
    """Positions to test [m]."""
    fallbacks: Float[np.ndarray, "blocked 3"]
    """Positions outside of the own limb, for vertices whose trial is not free [m]."""


class LeafCorners(NamedTuple):
    """Corners of the faces of the leaves that were met in a frame, eight faces at a time; kernels write to them."""

    corners: Float[np.ndarray, "leaves 10 8"]
    """Three corners of each face [m], and the volume below which the face is in doubt [m^3]."""
    ready: Bool[np.ndarray, " leaves"]
    """Leaves whose corners were copied."""


class Proposal(NamedTuple):
    """Where each vertex near the skin should go, and how that place was tested."""

    positions: Float[np.ndarray, "near 3"]
    """Proposed positions [m]; kernels write to it."""
    signed: Float[np.ndarray, " near"]
    """Signed distances before the projection [m]."""
    winding: Int[np.ndarray, " near"]
    """Winding numbers of the proposed positions."""
    touching: Bool[np.ndarray, " near"]
    """Whether a proposed position is within rounding of the skin."""
