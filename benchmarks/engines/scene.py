"""Scene that all engines play: one piece of cloth, its pins and the body in each frame."""

from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np

from hemline.sim import Elastic, Sheet, SimSettings, make_sheet


@dataclass(frozen=True)
class EngineScene:
    """Cloth that starts at rest, with its pins and a moving body.

    Attributes:
        name: Name in tables.
        vertices: Start positions (verts, 3) [m].
        faces: Triangles.
        rest_edges: Flat rest triangles (faces, 2, 2) [m].
        rest_vertices: Shape in space with approximately that rest metric (verts, 3) [m], which Blender needs.
        elastic: Material.
        pinned: Positions of the pins in each frame (frames, pins, 3) [m].
        pins: Indices of the pinned vertices.
        body: Vertices of the body in each frame (frames, verts, 3) [m].
        body_faces: Triangles of the body.
        fps: Frames per second.
        flat: Whether the rest angles are zero; otherwise they are those of `rest_vertices`.
    """

    name: str
    vertices: np.ndarray
    faces: np.ndarray
    rest_edges: np.ndarray
    rest_vertices: np.ndarray
    elastic: Elastic
    pinned: np.ndarray
    pins: np.ndarray
    body: np.ndarray
    body_faces: np.ndarray
    fps: float = 30.0
    flat: bool = True

    @property
    def frame_count(self) -> int:
        """Number of frames, the start included."""
        return len(self.pinned)

    @property
    def sheet(self) -> Sheet:
        """Cloth for the solver of hemline."""
        rest = None if self.flat else self.rest_vertices
        return make_sheet(self.faces, self.rest_edges, self.elastic, rest_vertices=rest)

    def still(self, frames: int) -> "EngineScene":
        """Returns the scene with body and pins fixed in the first frame."""
        body, pinned = self.body[:1], self.pinned[:1]
        return replace(self, body=np.repeat(body, frames, axis=0), pinned=np.repeat(pinned, frames, axis=0))

    def first(self, frames: int) -> "EngineScene":
        """Returns the first frames of the scene."""
        return replace(self, body=self.body[:frames], pinned=self.pinned[:frames])

    def write(self, path: Path, settings: SimSettings) -> None:
        """Writes all that another engine needs to an npz file, without pickle."""
        sheet = self.sheet
        constants = {field.name: getattr(self.elastic, field.name) for field in fields(Elastic)}
        np.savez(
            path,
            allow_pickle=False,
            vertices=self.vertices,
            faces=self.faces,
            rest_edges=self.rest_edges,
            rest_vertices=self.rest_vertices,
            pins=self.pins,
            pinned=self.pinned,
            body=self.body,
            body_faces=self.body_faces,
            fps=self.fps,
            mass=sheet.mass,
            hinges=sheet.hinges,
            hinge_weight=sheet.hinge_weight,
            hinge_rest=sheet.hinge_rest,
            gravity=np.array(settings.gravity),
            thickness=settings.thickness,
            creep=settings.creep,
            push=settings.contact_stiffness * float(sheet.vertex_area.mean()),
            **constants,
        )
