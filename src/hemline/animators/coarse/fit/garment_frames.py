"""Training frames of one garment on one body."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Self

import numpy as np

from hemline import bodies
from hemline.animators.coarse.proxy_on_body import Cells
from hemline.arrays import Bool, Faces, Float, Int
from hemline.meshes import edges

KEYS = {"features": "told", "displacements": "apart"}
"""Names of arrays in files, where they differ from the names of the attributes."""


@dataclass(frozen=True, eq=False)
class GarmentFrames:
    """A proxy on a body, with some frames of its takes.

    Frames are in the coordinates of a `PelvisFrame`. Arrays may be mapped from a file.
    """

    body_name: str
    """Name of the body."""
    faces: Faces
    """Triangles of the proxy."""
    cut: Float[np.ndarray, "verts 3"]
    """The proxy as it was made for that body, before it settled [m]."""
    fit: Float[np.ndarray, "verts 7"]
    """Normal, position [m] and signed distance to the body [m] of each vertex of the settled proxy."""
    skin: Float[np.ndarray, "verts joints"]
    """Skin weights."""
    mass: Float[np.ndarray, " verts"]
    """Mass of each vertex [kg]."""
    static: Float[np.ndarray, "verts static"]
    """Features of vertices that do not change, see `ProxyOnBody.static`."""
    cell: Int[np.ndarray, " verts"]
    """Cell of each vertex, see `Cells.cell`."""
    near: Int[np.ndarray, "verts near"]
    """Cells that reach each vertex, see `Cells.near`."""
    shares: Float[np.ndarray, "verts near"]
    """Weights of these cells, see `Cells.shares`."""
    take: Int[np.ndarray, " frames"]
    """Number of the take of each frame."""
    frame: Int[np.ndarray, " frames"]
    """Number of each frame in its take."""
    wanted: Bool[np.ndarray, " frames"]
    """Whether a frame is trained on; the others come before one that is."""
    features: Float[np.ndarray, "frames verts dynamic"]
    """Features that change, see `Trail.features`; float16."""
    turns: Float[np.ndarray, "frames verts 4"]
    """Rotation from the frame of each vertex to the pelvis frame, wxyz; float16."""
    displacements: Float[np.ndarray, "frames verts 3"]
    """Displacement of the truth from skinning, in the rotated frame of each vertex; float16 [m]."""
    truth: Float[np.ndarray, "frames verts 3"]
    """Simulated positions [m]."""
    motion: Float[np.ndarray, "frames poses 75"]
    """The last poses, see `PoseHistory.window`; float16."""
    transforms: Float[np.ndarray, "frames joints 3 4"]
    """Skinning transforms of the joints [m]."""
    joints: Float[np.ndarray, "frames joints 3"]
    """Positions of the joints [m]."""
    body: Float[np.ndarray, "frames body"]
    """Betas and axis-angles of the pose."""
    heading: Float[np.ndarray, "frames 3 3"]
    """Rotations from the pelvis frame to the world."""

    @property
    def on_body(self) -> bodies.Body:
        """The body that the takes are of."""
        return bodies.load(self.body_name)

    @classmethod
    def of(cls, body_name: str, arrays: Mapping[str, np.ndarray]) -> Self:
        """Makes frames from the name of the body and the arrays of a file."""
        return cls(body_name, **{name: arrays[KEYS.get(name, name)] for name in cls._names()})

    def arrays(self) -> dict[str, np.ndarray]:
        """Returns the arrays by their names in a file."""
        return {KEYS.get(name, name): getattr(self, name) for name in self._names()}

    @classmethod
    def _names(cls) -> list[str]:
        return [each.name for each in fields(cls) if each.name != "body_name"]

    def __len__(self) -> int:
        """Number of frames."""
        return len(self.take)

    @cached_property
    def cells(self) -> Cells:
        """Cells of the proxy."""
        return Cells(np.array(self.cell), np.array(self.near), np.array(self.shares))

    @cached_property
    def edges(self) -> Int[np.ndarray, "edges 2"]:
        """Edges of the proxy as vertex ids."""
        return edges(np.asarray(self.faces))

    @cached_property
    def before(self) -> Int[np.ndarray, "frames 2"]:
        """Rows of the frames one and two before each; its own row if such a frame is missing."""
        row_of = {at: row for row, at in enumerate(zip(self.take.tolist(), self.frame.tolist(), strict=True))}
        rows = [
            [row_of.get((take, max(frame - back, 0)), row) for back in (1, 2)] for (take, frame), row in row_of.items()
        ]
        return np.array(rows, np.int64).reshape(-1, 2)

    @cached_property
    def has_past(self) -> Bool[np.ndarray, " frames"]:
        """Whether the frames one and two before each are here, too."""
        here = set(zip(self.take.tolist(), self.frame.tolist(), strict=True))
        pairs = zip(self.take.tolist(), self.frame.tolist(), strict=True)
        return np.array([all((take, frame - back) in here for back in (1, 2)) for take, frame in pairs], bool)
