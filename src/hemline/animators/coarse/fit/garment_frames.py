"""Frames of one garment on one body, as a network learns from them."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Self

import numpy as np

from hemline.animators.coarse.proxy_on_body import Cells
from hemline.arrays import Bool, Faces, Float, Int
from hemline.meshes import edges


@dataclass(frozen=True, eq=False)
class GarmentFrames:
    """What is known of a proxy on a body, and of some frames of the takes of it.

    Frames are seen from the heading of the body's pelvis, which is the origin. Arrays may be mapped from a file.
    """

    body_name: str
    faces: Faces
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
    near: Int[np.ndarray, "verts near"]
    shares: Float[np.ndarray, "verts near"]
    """These three: see `LimbGrid`."""
    take: Int[np.ndarray, " frames"]
    """Which take each frame is of."""
    frame: Int[np.ndarray, " frames"]
    """Which frame of it."""
    wanted: Bool[np.ndarray, " frames"]
    """Whether it was asked for; the others are the two before one that was."""
    told: Float[np.ndarray, "frames verts dynamic"]
    """Features that change, see `Trail.told`; float16."""
    turns: Float[np.ndarray, "frames verts 4"]
    """From the turned frame of each vertex to the frame's own, wxyz; float16."""
    apart: Float[np.ndarray, "frames verts 3"]
    """Where the truth is, from where skinning puts each vertex, in its turned frame; float16 [m]."""
    truth: Float[np.ndarray, "frames verts 3"]
    """The garment of the truth [m]."""
    motion: Float[np.ndarray, "frames poses 75"]
    """The last poses, see `Times.window`; float16."""
    transforms: Float[np.ndarray, "frames joints 3 4"]
    """Skinning transforms of the joints [m]."""
    joints: Float[np.ndarray, "frames joints 3"]
    """Positions of the joints [m]."""
    body: Float[np.ndarray, "frames body"]
    """Betas, axis-angles of the pose."""
    heading: Float[np.ndarray, "frames 3 3"]
    """Rotations from the frame's own heading to the world."""

    @classmethod
    def of(cls, body_name: str, arrays: Mapping[str, np.ndarray]) -> Self:
        """From arrays by the names of the attributes, and the name of the body."""
        return cls(body_name, **{name: arrays[name] for name in cls._names()})

    def arrays(self) -> dict[str, np.ndarray]:
        """By the names of the attributes."""
        return {name: getattr(self, name) for name in self._names()}

    @classmethod
    def _names(cls) -> list[str]:
        return [each.name for each in fields(cls) if each.name != "body_name"]

    def __len__(self) -> int:
        """Number of frames."""
        return len(self.take)

    @cached_property
    def cells(self) -> Cells:
        """The cells that it is cut into."""
        return Cells(np.array(self.cell), np.array(self.near), np.array(self.shares))

    @cached_property
    def edges(self) -> Int[np.ndarray, "edges 2"]:
        """Edges of the proxy as vertex ids."""
        return edges(np.asarray(self.faces))

    @cached_property
    def before(self) -> Int[np.ndarray, "frames 2"]:
        """Which frames come one and two before each; the frame itself where that is not among them."""
        known = {at: row for row, at in enumerate(zip(self.take.tolist(), self.frame.tolist(), strict=True))}
        found = [
            [known.get((take, max(frame - back, 0)), row) for back in (1, 2)] for (take, frame), row in known.items()
        ]
        return np.array(found, np.int64).reshape(-1, 2)

    @property
    def skinned_mm(self) -> float:
        """Mean distance of the truth from skinning [mm]."""
        return 1e3 * float(np.linalg.norm(np.asarray(self.apart, np.float32), axis=2).mean())
