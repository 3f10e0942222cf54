"""The terms that come with a garment and with what moves it."""

from typing import Any

from hemline.garments.garment import Garment
from hemline.motions.terms import as_stated

MADE_OF = "made of "
"""How the note of a garment begins that names the mesh it was made of, and in brackets the terms of that."""


def garment_terms(garment: Garment) -> tuple[str, ...]:
    """Notes of a garment that name another's mesh and its terms; none where the garment is the user's own."""
    return tuple(note for note in garment.notes if note.startswith(MADE_OF))


def terms_of(animator: Any) -> tuple[str, ...]:
    """Terms of all that an animator was made of: body, garment, motions; of several, those of all.

    Args:
        animator: An animator, or a `Wearable`. One without `licences` says nothing of itself.
    """
    parts = getattr(animator, "parts", None) or [getattr(animator, name, None) for name in ("moving", "shapes", "full")]
    texts = [text for part in parts if part is not None for text in terms_of(part)]
    texts += getattr(animator, "licences", ())
    garment = getattr(animator, "garment", None)
    return as_stated([*texts, *(garment_terms(garment) if isinstance(garment, Garment) else ())])
