"""The file of a garment, opened once: what its TOML says, and its mesh."""

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Literal

from hemline.meshes import ReadMesh, read_mesh, weld

from .cloth import GarmentCloth, check_cloth_mesh, wind_consistently
from .garment_toml import GarmentFile, read_garment_toml
from .rest_shape import rest_shape
from .units import UNITS, unit_of


@dataclass(frozen=True, eq=False)
class GarmentSource:
    """A garment's file. The mesh is read when it is first asked for, and only once."""

    path: Path
    """The file that was named: a mesh, a TOML, clothes of MakeHuman or a garment of hemline's own."""
    description: GarmentFile
    """What the TOML says; for other files just the name of the file."""

    @classmethod
    def open(cls, path: str | Path, unit: str | None = None) -> "GarmentSource":
        """Opens a file.

        Args:
            path: The file.
            unit: Unit of the mesh, which overrides that of the TOML; None: as the TOML says, or guessed.

        Raises:
            BadGarment: The TOML cannot be read, see `read_garment_toml`.
        """
        path = Path(path)
        description = read_garment_toml(path) if path.suffix == ".toml" else GarmentFile(mesh=path.name)
        return cls(path, replace(description, unit=unit or description.unit))

    @property
    def kind(self) -> Literal["garment", "clothes", "mesh"]:
        """Kind of the file: a garment file of hemline, clothes of MakeHuman (`.mhclo`), or any other mesh."""
        if self.path.suffix.lower() == ".safetensors":
            return "garment"
        return "clothes" if Path(self.description.mesh).suffix.lower() == ".mhclo" else "mesh"

    @property
    def mesh_path(self) -> Path:
        """File of the mesh, or of the clothes."""
        return self.path.parent / self.description.mesh

    @cached_property
    def mesh(self) -> ReadMesh:
        """The mesh as it is in its file.

        Raises:
            BadMesh: The mesh cannot be read.
        """
        return read_mesh(self.mesh_path)

    @cached_property
    def cloth(self) -> GarmentCloth:
        """The mesh in metres, with its rest triangles, at the place and with the up axis that it has in its file.

        Raises:
            BadGarment: The unit contradicts the size, or the TOML asks for a pattern that the mesh does not have.
            BadMesh: The mesh cannot be read, or no cloth can be made of it.
        """
        description = self.description
        name = description.name or self.path.stem
        mesh = self.mesh if description.names_vertices else weld(self.mesh)
        notes = mesh.notes + check_cloth_mesh(mesh.vertices, mesh.faces, name)
        unit, unit_notes = unit_of(mesh.vertices, description.unit, name)
        scale = UNITS[unit]
        vertices = mesh.vertices * scale
        rest_edges, from_pattern, rest_notes = rest_shape(mesh, vertices, scale, description.pattern, name)
        notes += unit_notes + rest_notes
        return wind_consistently(GarmentCloth(name, vertices, mesh.faces, rest_edges, from_pattern, notes))
