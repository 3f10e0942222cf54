"""The file of a garment, opened once: what its TOML says, and its mesh."""

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Literal

from hemline.meshes import ReadMesh, check_mesh, read_mesh

from .cloth import GarmentCloth, wind_consistently
from .cloth_of_mesh import cloth_of_mesh
from .file_parts import only_part, split_part
from .garment_toml import GarmentFile, read_garment_toml
from .rest_shape import rest_shape
from .units import UNITS
from .vertex_rules import on_cloth


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
            path: The file; `FILE:NAME` is one part of a mesh, see `only_part`.
            unit: Unit of the mesh, which overrides that of the TOML; None: as the TOML says, or guessed.

        Raises:
            BadGarment: The TOML cannot be read, see `read_garment_toml`.
        """
        file, part = split_part(path)
        name = f"{file.name}:{part}" if part else file.name
        description = read_garment_toml(file) if file.suffix == ".toml" else GarmentFile(mesh=name)
        return cls(file, replace(description, unit=unit or description.unit))

    @property
    def kind(self) -> Literal["garment", "clothes", "mesh"]:
        """Kind of the file: a garment file of hemline, clothes of MakeHuman (`.mhclo`), or any other mesh."""
        if self.path.suffix.lower() == ".safetensors":
            return "garment"
        return "clothes" if Path(self.description.mesh).suffix.lower() == ".mhclo" else "mesh"

    @property
    def mesh_path(self) -> Path:
        """File of the mesh, or of the clothes."""
        return self.path.parent / split_part(self.description.mesh)[0]

    @property
    def name(self) -> str:
        """Name of the garment: as the TOML says, or that of the part or the file."""
        part = split_part(self.description.mesh)[1]
        return self.description.name or (part or "").replace("/", " ") or self.path.stem

    @cached_property
    def mesh(self) -> ReadMesh:
        """The mesh as it is in its file, or the part of it that was named.

        Raises:
            BadMesh: The mesh cannot be read.
            BadGarment: The file has no part of that name.
        """
        mesh = read_mesh(self.mesh_path)
        part = split_part(self.description.mesh)[1]
        return only_part(mesh, part, self.mesh_path.name) if part else mesh

    @cached_property
    def cloth(self) -> GarmentCloth:
        """The cloth of the mesh in metres, with its rest triangles, where the file has it.

        What is no cloth is left out, thick and doubled cloth becomes one sheet, and faults of the mesh are repaired;
        the notes say so.

        Raises:
            BadGarment: The unit contradicts the size, the TOML asks for a pattern that the mesh does not have or pins a
                vertex that was left out, or the file has no cloth, or several garments.
            BadMesh: The mesh cannot be read, or no cloth can be made of it.
        """
        return self._read[0]

    @property
    def unit(self) -> str:
        """Unit of the file, declared or guessed, see `cloth`."""
        return self._read[2]

    def in_unit(self, unit: str) -> "GarmentSource":
        """Returns this file, its mesh already read, in another unit."""
        other = replace(self, description=replace(self.description, unit=unit))
        other.__dict__["mesh"] = self.mesh
        return other

    @cached_property
    def cloth_description(self) -> GarmentFile:
        """What the TOML says, with pins and chains as vertices of `cloth`.

        Raises:
            BadGarment, BadMesh: As `cloth`.
        """
        return self._read[1]

    @cached_property
    def _read(self) -> tuple[GarmentCloth, GarmentFile, str]:
        name, pattern = self.name, self.description.pattern
        mesh, unit, unit_notes = cloth_of_mesh(self.mesh, self.description.unit, name, self.mesh_path.name)
        notes = mesh.notes + check_mesh(mesh.vertices, mesh.faces, name=name) + unit_notes
        rest_edges, from_pattern, rest_notes = rest_shape(mesh, UNITS[unit], pattern, name)
        description, pin_notes = on_cloth(self.description, mesh, name)
        notes += rest_notes + pin_notes
        cloth = GarmentCloth(name, mesh.vertices, mesh.faces, rest_edges, from_pattern, notes)
        return wind_consistently(cloth), description, unit
