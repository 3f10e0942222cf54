"""Blinded comparisons of clips by people: pairs, their order for each participant, answers, a page, statistics."""

from .answers import Answer as Answer
from .answers import read_answers as read_answers
from .pairs import Pair as Pair
from .pairs import pairs_of as pairs_of
from .server import Viewer as Viewer
from .study import QUESTIONS as QUESTIONS
from .study import Study as Study
from .summary import SummaryRow as SummaryRow
from .summary import summarise as summarise

__all__ = ["QUESTIONS", "Answer", "Pair", "Study", "SummaryRow", "Viewer", "pairs_of", "read_answers", "summarise"]
