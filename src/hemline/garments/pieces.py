"""Several garments worn together, as one: a shirt and a skirt, a dress and a cape."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from hemline.arrays import Faces, Int, Vertices
from hemline.errors import BadGarment
from hemline.meshes import ClosestTree, boundary_loops

from .material import Material
from .pins import Pins

if TYPE_CHECKING:
    from .garment import Garment

GAP = 0.003
"""Distance between one piece and the next at the start [m]."""

_REACH = 0.03
"""How far into a piece the next one may start [m]; farther off it is taken to be elsewhere."""

_ROUNDS = 8


@dataclass(frozen=True)
class Piece:
    """One of several pieces of cloth in a garment; its vertices and faces follow those of the piece beneath."""

    name: str
    vertex_count: int
    """Its vertices."""
    material: Material
    """What it is made of."""
    flat_rest: bool
    """Whether it is flat when nothing bends it."""

    def as_dict(self) -> dict[str, Any]:
        """As JSON-like values."""
        return {
            "name": self.name,
            "vertex_count": self.vertex_count,
            "material": self.material.as_dict(),
            "flat_rest": self.flat_rest,
        }

    @classmethod
    def of(cls, content: Mapping[str, Any]) -> "Piece":
        """The piece that `as_dict` described."""
        return cls(
            str(content["name"]),
            int(content["vertex_count"]),
            Material.of(content["material"]),
            bool(content["flat_rest"]),
        )


def worn_together(garments: Sequence["Garment"], *, name: str | None = None) -> "Garment":
    """One garment of several pieces, each with its own material and pins.

    Where a piece starts within the one beneath it, it is moved out of it, pins included.

    Args:
        garments: From the skin outwards, on the same body.
        name: Its name; None: theirs, joined by `+`.

    Returns:
        A garment that is simulated, stored and exported like any other; it hangs on the innermost one's key joint.

    Raises:
        BadGarment: No garment, or garments of several bodies.
    """
    from .garment import Garment

    if not garments:
        raise BadGarment("no garments to wear together", "an empty list", "name at least one")
    first = garments[0]
    for other in garments[1:]:
        if other.body_name != first.body_name or not _same(other.body_betas, first.body_betas):
            got = f"'{first.name}' on {_body(first)}, '{other.name}' on {_body(other)}"
            raise BadGarment("garments worn together must be on one body", got, "dress them on the same body first")
    pieces = tuple(piece for garment in garments for piece in garment.worn)
    offsets = np.cumsum([0, *(len(garment.vertices) for garment in garments)])[:-1]
    both = list(zip(garments, offsets, strict=True))
    by_hand = all(garment.chains for garment in garments)
    whole = Garment(
        name=name or "+".join(garment.name for garment in garments),
        vertices=np.concatenate([garment.vertices for garment in garments]),
        faces=np.concatenate([garment.faces + np.int32(offset) for garment, offset in both]),
        rest_edges=np.concatenate([garment.rest_edges for garment in garments]),
        material=pieces[0].material,
        pins=Pins.merged([replace(g.pins, vertices=g.pins.vertices + np.int32(offset)) for g, offset in both]),
        key_joint=first.key_joint,
        chains=tuple(tuple(v + int(o) for v in chain) for g, o in both for chain in g.chains) if by_hand else (),
        body_name=first.body_name,
        body_betas=first.body_betas,
        flat_rest=all(piece.flat_rest for piece in pieces),
        notes=tuple(f"{garment.name}: {note}" for garment in garments for note in garment.notes),
        pieces=pieces,
    )
    return layered(whole)


def layered(garment: "Garment") -> "Garment":
    """The same garment with each piece outside of those beneath it, pins included."""
    vertices = np.array(garment.vertices, np.float64)
    bounds = np.cumsum([0, *(piece.vertex_count for piece in garment.worn)])
    owner = face_pieces(garment)
    for outer in range(1, len(garment.worn)):
        own = slice(bounds[outer], bounds[outer + 1])
        for _ in range(_ROUNDS):
            before = vertices[own].copy()
            for inner in range(outer):
                low, high = bounds[inner], bounds[inner + 1]
                vertices[own] = _outside(vertices[own], vertices[low:high], garment.faces[owner == inner] - low)
            if np.array_equal(before, vertices[own]):
                break
    moved = vertices - garment.vertices
    pins = garment.pins
    on_skin = pins.joints < 0
    raised = np.where(on_skin, np.linalg.norm(moved[pins.vertices], axis=1), 0.0)
    offsets = pins.offsets + np.where(on_skin[:, None], 0.0, moved[pins.vertices])
    return replace(
        garment,
        vertices=vertices.astype(np.float32),
        pins=replace(pins, heights=(pins.heights + raised).astype(np.float32), offsets=offsets.astype(np.float32)),
    )


def face_pieces(garment: "Garment") -> Int[np.ndarray, " faces"]:
    """Number of the piece that each face belongs to."""
    ends = np.cumsum([piece.vertex_count for piece in garment.worn])
    return np.searchsorted(ends, garment.faces[:, 0], side="right")


def _outside(vertices: np.ndarray, inner: Vertices, faces: Faces) -> np.ndarray:
    """Vertices near an open surface and less than the gap in front of it, moved there; not those beyond its rim."""
    tree = ClosestTree(np.asarray(inner, np.float64), faces)
    closest, result = tree.closest(vertices), vertices.copy()
    outward = tree.outward(closest)
    height = ((vertices - closest.positions) * outward).sum(axis=1)
    on_rim = np.zeros(len(inner), bool)
    for loop in boundary_loops(faces):
        on_rim[loop] = True
    beyond = (on_rim[faces[closest.faces]] | (closest.weights <= 0)).all(axis=1)
    near = (closest.distances < _REACH) & ~beyond & (height < GAP - 1e-6)
    result[near] = (closest.positions + 1.0001 * GAP * outward)[near]
    return result


def _same(one: np.ndarray, other: np.ndarray) -> bool:
    return np.array_equal(np.trim_zeros(one, "b"), np.trim_zeros(other, "b"))


def _body(garment: "Garment") -> str:
    betas = np.trim_zeros(garment.body_betas, "b")
    return f"{garment.body_name} with betas {betas.round(3).tolist()}" if len(betas) else garment.body_name
