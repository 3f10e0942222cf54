"""Several garments worn together, as one: a shirt and a skirt, a dress and a cape."""

from collections.abc import Sequence
from dataclasses import fields, replace

import numpy as np

from hemline.errors import BadGarment

from .garment import Garment
from .pins import Pins


def worn_together(garments: Sequence[Garment], *, name: str | None = None) -> Garment:
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
    return whole.layered()


def pieces_apart(garment: Garment) -> tuple[Garment, ...]:
    """The pieces of a garment, each as a garment where it lies; one of a single piece is itself.

    Args:
        garment: From the skin outwards.
    """
    if len(garment.worn) == 1:
        return (garment,)
    ends = np.cumsum([piece.vertex_count for piece in garment.worn])
    of_pin, pins, apart = np.searchsorted(ends, garment.pins.vertices, side="right"), garment.pins, list[Garment]()
    for at, (piece, end) in enumerate(zip(garment.worn, ends, strict=True)):
        low, faces, held = end - piece.vertex_count, garment.face_pieces == at, of_pin == at
        own = {field.name: getattr(pins, field.name)[held] for field in fields(pins)}
        apart.append(
            replace(
                garment,
                name=piece.name,
                vertices=garment.vertices[low:end],
                faces=garment.faces[faces] - np.int32(low),
                rest_edges=garment.rest_edges[faces],
                material=piece.material,
                pins=replace(pins, **(own | {"vertices": own["vertices"] - np.int32(low)})),
                chains=(),
                flat_rest=piece.flat_rest,
                pieces=(),
            )
        )
    return tuple(apart)


def _same(one: np.ndarray, other: np.ndarray) -> bool:
    return np.array_equal(np.trim_zeros(one, "b"), np.trim_zeros(other, "b"))


def _body(garment: Garment) -> str:
    betas = np.trim_zeros(garment.body_betas, "b")
    return f"{garment.body_name} with betas {betas.round(3).tolist()}" if len(betas) else garment.body_name
