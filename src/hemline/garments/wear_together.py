"""Combines garments that are worn together into one, such as a shirt and a skirt, and splits them again."""

from collections.abc import Sequence
from dataclasses import fields, replace

import numpy as np

from hemline.errors import BadGarment

from .garment import Garment
from .pins import Pins


def wear_together(garments: Sequence[Garment], *, name: str | None = None) -> Garment:
    """Combines garments into one of several pieces, each with its own material and pins.

    A piece that intersects one beneath it is moved out of it, with its pins.

    Args:
        garments: Garments on the same body, from the skin outwards.
        name: Name of the combination; None: the names joined by `+`.

    Returns:
        A garment that is simulated, stored and exported like any other; its key joint is that of the innermost one.

    Raises:
        BadGarment: There is no garment, or they are on several bodies.
    """
    if not garments:
        raise BadGarment("no garments to wear together", "an empty list", "name at least one")
    first = garments[0]
    for other in garments[1:]:
        if other.body_name != first.body_name or not _same(other.body_betas, first.body_betas):
            got = f"'{first.name}' on {_body(first)}, '{other.name}' on {_body(other)}"
            raise BadGarment("garments worn together must be on one body", got, "dress them on the same body first")
    pieces = tuple(piece for garment in garments for piece in garment.layers)
    offsets = np.cumsum([0, *(len(garment.vertices) for garment in garments)])[:-1]
    both = list(zip(garments, offsets, strict=True))
    by_hand = all(garment.chains for garment in garments)
    whole = Garment(
        name=name or "+".join(garment.name for garment in garments),
        vertices=np.concatenate([garment.vertices for garment in garments]),
        faces=np.concatenate([garment.faces + np.int32(offset) for garment, offset in both]),
        rest_edges=np.concatenate([garment.rest_edges for garment in garments]),
        material=pieces[0].material,
        pins=Pins.concatenate([replace(g.pins, vertices=g.pins.vertices + np.int32(offset)) for g, offset in both]),
        key_joint=first.key_joint,
        chains=tuple(tuple(v + int(o) for v in chain) for g, o in both for chain in g.chains) if by_hand else (),
        body_name=first.body_name,
        body_betas=first.body_betas,
        flat_rest=all(piece.flat_rest for piece in pieces),
        notes=tuple(f"{garment.name}: {note}" for garment in garments for note in garment.notes),
        pieces=pieces,
    )
    return whole.separate_pieces()


def split_pieces(garment: Garment) -> tuple[Garment, ...]:
    """Splits a garment into its pieces, each a garment in its place. A garment of one piece is returned as it is.

    Args:
        garment: The garment.

    Returns:
        One garment per piece, from the skin outwards.
    """
    if len(garment.layers) == 1:
        return (garment,)
    ends = np.cumsum([piece.vertex_count for piece in garment.layers])
    of_pin, pins, pieces = np.searchsorted(ends, garment.pins.vertices, side="right"), garment.pins, list[Garment]()
    for at, (piece, end) in enumerate(zip(garment.layers, ends, strict=True)):
        low, faces, own_pins = end - piece.vertex_count, garment.face_pieces == at, of_pin == at
        own = {field.name: getattr(pins, field.name)[own_pins] for field in fields(pins)}
        pieces.append(
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
    return tuple(pieces)


def _same(one: np.ndarray, other: np.ndarray) -> bool:
    return np.array_equal(np.trim_zeros(one, "b"), np.trim_zeros(other, "b"))


def _body(garment: Garment) -> str:
    betas = np.trim_zeros(garment.body_betas, "b")
    return f"{garment.body_name} with betas {betas.round(3).tolist()}" if len(betas) else garment.body_name
