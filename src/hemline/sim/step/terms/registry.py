"""The list of additional energy terms, which every step and every static solve include."""

from .term import MakeTerm, Term, TermInputs

TERMS: tuple[MakeTerm, ...] = ()
"""One entry per term: the function in its file in `terms/` that makes it."""


def make_terms(inputs: TermInputs) -> list[Term]:
    """Makes the additional terms of one step."""
    terms = (make(inputs) for make in TERMS)
    return [term for term in terms if term is not None]
