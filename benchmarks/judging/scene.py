"""What all three engines are given: one piece of cloth, its pins and its body, frame by frame."""

from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np

from hemline.sim import Elastic, Sheet, SimSettings, make_sheet


@dataclass(frozen=True)
class JudgedScene:
    """Cloth that starts at rest.

    Attributes:
        name: What it is called in tables.
        vertices: Start positions (verts, 3) [m].
        faces: Triangles.
        rest_edges: Flat rest triangles (faces, 2, 2) [m].
        rest_vertices: A shape in space with that rest metric, or nearly (verts, 3) [m]; Blender wants one.
        elastic: The material.
        pinned: Where the pins are, frame by frame (frames, pins, 3) [m].
        pins: Pinned vertices.
        body: The body's vertices, frame by frame (frames, verts, 3) [m].
        body_faces: Its triangles.
        fps: Frames a second.
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
        """The cloth for our solver."""
        rest = None if self.flat else self.rest_vertices
        return make_sheet(self.faces, self.rest_edges, self.elastic, rest_vertices=rest)

    def still(self, frames: int) -> "JudgedScene":
        """The same, standing still in its first frame."""
        body, pinned = self.body[:1], self.pinned[:1]
        return replace(self, body=np.repeat(body, frames, axis=0), pinned=np.repeat(pinned, frames, axis=0))

    def first(self, frames: int) -> "JudgedScene":
        """Its first frames."""
        return replace(self, body=self.body[:frames], pinned=self.pinned[:frames])

    def write(self, path: Path, settings: SimSettings) -> None:
        """Write all that another engine needs as npz, without pickle."""
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
