"""The mesh from which the shipped body was made, with the vertices that its skin omits: `hm08` of MakeHuman.

Clothes made for MakeHuman are bound to vertices of that mesh, most of them to helpers: a suit of tights and a skirt
around the body, which change with its shape as the skin does.
"""

import functools
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hemline.arrays import Float, Int, Vertices
from hemline.errors import BadBody
from hemline.files import read_tensors, write_tensors

from .body import ShapedBody
from .body_file import shapedirs_in_steps, shapedirs_of_steps

_SHIPPED = {"hm08": Path(__file__).parents[1] / "models" / "hm08.safetensors"}
_ARRAYS = {"body_vertices", "helper_vertices", "template", "shapedirs", "shapedirs_scales"}
_CURE = "make it again with: python -m hemline.models.make.base_mesh"


@dataclass(frozen=True, eq=False)
class BaseMesh:
    """A mesh that consists of a body and more vertices, the helpers, that follow the same betas.

    Raises:
        BadBody: The arrays contradict each other.
    """

    name: str
    """Name of the mesh, such as `hm08`."""
    body_name: str
    """Name of the body that is a part of the mesh."""
    body_hash: str
    """Hash of this body."""
    body_vertices: Int[np.ndarray, " verts"]
    """Number in this mesh of each vertex of the body."""
    helper_vertices: Int[np.ndarray, " helpers"]
    """Number in this mesh of each helper."""
    template: Float[np.ndarray, "helpers 3"]
    """Positions of the helpers at rest in the mean shape, the pelvis at the origin [m]."""
    shapedirs: Float[np.ndarray, "betas helpers 3"]
    """Displacement of the helpers by one standard deviation of each beta [m]."""
    licence: str
    """Terms of the data."""

    def __post_init__(self) -> None:
        numbers = np.sort(np.concatenate([self.body_vertices, self.helper_vertices]))
        if not np.array_equal(numbers, np.arange(len(numbers))):
            raise BadBody(f"{self.name} must name each of its vertices once", f"{len(numbers)} numbers", _CURE)
        shape = (len(self.shapedirs), len(self.helper_vertices), 3)
        if self.template.shape != shape[1:] or self.shapedirs.shape != shape:
            got = f"template {self.template.shape}, shapedirs {self.shapedirs.shape}"
            raise BadBody(f"{self.name} must place its {shape[1]} helpers", got, _CURE)

    def __len__(self) -> int:
        return len(self.body_vertices) + len(self.helper_vertices)

    def on(self, shaped: ShapedBody) -> Vertices:
        """Returns all vertices at rest on a shape of the body, in the order of the mesh, float64 [m].

        Args:
            shaped: The body.

        Raises:
            BadBody: It is another body, or another version of it.
        """
        if shaped.body.hash != self.body_hash:
            what, cure = (
                f"{self.name} is the mesh of the body '{self.body_name}'",
                f"use bodies.load('{self.body_name}')",
            )
            raise BadBody(what, f"'{shaped.body.name}' with another mesh", cure)
        result = np.full((len(self), 3), np.nan)
        result[self.body_vertices] = shaped.vertices
        change = np.einsum("b,bvc->vc", shaped.betas.astype(np.float64), self.shapedirs)
        result[self.helper_vertices] = self.template + change
        return result


@functools.cache
def base_mesh(name: str = "hm08") -> BaseMesh:
    """Returns a base mesh that ships; it is read once and cached.

    Args:
        name: `hm08`, MakeHuman's mesh of 19,158 vertices.

    Raises:
        BadBody: No such mesh ships.
    """
    if name not in _SHIPPED:
        raise BadBody("no base mesh of that name ships", repr(name), f"use one of {', '.join(_SHIPPED)}")
    return read_base_mesh(_SHIPPED[name])


def write_base_mesh(path: str | Path, base: BaseMesh) -> None:
    """Writes a base mesh, with shapedirs as int16 and one scale per beta, like those of bodies.

    Raises:
        BadOutput: The path cannot be written.
    """
    arrays = shapedirs_in_steps(base.shapedirs) | {
        "template": base.template.astype(np.float32),
        "body_vertices": base.body_vertices.astype(np.uint16),
        "helper_vertices": base.helper_vertices.astype(np.uint16),
    }
    names = {"name": base.name, "body_name": base.body_name, "body_hash": base.body_hash, "licence": base.licence}
    write_tensors(path, arrays, {"kind": "base mesh"} | names)


def read_base_mesh(path: str | Path) -> BaseMesh:
    """Reads a base mesh that `write_base_mesh` wrote.

    Raises:
        BadBody: The file is missing, truncated, a pickle, of another kind or a future version, or its content
            contradicts itself.
    """
    arrays, metadata = read_tensors(path, "base mesh", error=BadBody)
    if missing := sorted(_ARRAYS - arrays.keys()):
        raise BadBody(f"{path} lacks arrays", ", ".join(missing), _CURE)
    arrays["shapedirs"] = shapedirs_of_steps(arrays["shapedirs"], arrays.pop("shapedirs_scales"), path)
    names = {key: str(metadata.get(key, "")) for key in ("name", "body_name", "body_hash", "licence")}
    return BaseMesh(
        body_vertices=arrays["body_vertices"].astype(np.int32),
        helper_vertices=arrays["helper_vertices"].astype(np.int32),
        template=arrays["template"],
        shapedirs=arrays["shapedirs"],
        **names,
    )
