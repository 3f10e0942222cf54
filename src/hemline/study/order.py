"""In which order a participant sees the pairs, and which clip of each is on the left."""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass

from .pairs import Pair


@dataclass(frozen=True)
class ShownPair:
    """A pair as a participant sees it.

    Args:
        pair: The pair.
        a_left: Whether clip A is on the left.
    """

    pair: Pair
    a_left: bool


def order_for(participant: str, pairs: Sequence[Pair], seed: int) -> list[ShownPair]:
    """All pairs in the order of a participant: drawn by hashing, so that no version of Python shows another one.

    Sides are counterbalanced: A is on the left in half of a participant's pairs (for an odd number, in one more or one
    less than B, by chance), which half being as random as the order.

    Args:
        participant: The participant's code.
        pairs: The pairs of the study.
        seed: Another seed gives everybody another order.
    """

    def drawn(*what: str) -> bytes:
        return hashlib.sha256(json.dumps([seed, participant, *what]).encode()).digest()

    coin = drawn("first side")[0] % 2
    by_side = sorted(pairs, key=lambda pair: drawn("side", pair.name))
    a_left = {pair.name: (rank + coin) % 2 == 0 for rank, pair in enumerate(by_side)}
    return [ShownPair(pair, a_left[pair.name]) for pair in sorted(pairs, key=lambda pair: drawn("order", pair.name))]
