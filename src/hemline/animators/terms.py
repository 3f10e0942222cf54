"""Licence terms of a garment and of an animator."""

from typing import Any

from hemline.garments.garment import Garment
from hemline.motions.terms import as_stated

MADE_OF = "made of "
"""Beginning of the note of a garment that names the mesh it was made of, with the terms of that mesh in brackets."""


def garment_terms(garment: Garment) -> tuple[str, ...]:
    """Returns the notes of a garment that name somebody else's mesh and its terms."""
    return tuple(note for note in garment.notes if note.startswith(MADE_OF))


def terms_of(animator: Any) -> tuple[str, ...]:
    """Returns the terms of everything that an animator and its parts were made of: bodies, garments and motions.

    Args:
        animator: An animator or a `Wearable`. An animator without `licences` adds no terms of its own.
    """
    parts = getattr(animator, "parts", None) or [getattr(animator, name, None) for name in ("moving", "shapes", "full")]
    texts = [text for part in parts if part is not None for text in terms_of(part)]
    texts += getattr(animator, "licences", ())
    garment = getattr(animator, "garment", None)
    return as_stated([*texts, *(garment_terms(garment) if isinstance(garment, Garment) else ())])
