"""Order of the pairs for a participant, and the side of each clip."""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass

from .pairs import Pair


@dataclass(frozen=True)
class ShownPair:
    """A pair with the sides on which a participant sees its clips.

    Args:
        pair: The pair.
        a_left: Whether clip A is on the left.
    """

    pair: Pair
    a_left: bool


def order_for(participant: str, pairs: Sequence[Pair], seed: int) -> list[ShownPair]:
    """Returns all pairs in the random order of a participant, by hashing, so that all versions of Python agree.

    Sides are counterbalanced: A is on the left in a random half of the pairs of a participant. For an odd number of
    pairs, chance decides whether A or B has one more.

    Args:
        participant: Code of the participant.
        pairs: Pairs of the study.
        seed: Seed of the order.
    """

    def random_key(*what: str) -> bytes:
        return hashlib.sha256(json.dumps([seed, participant, *what]).encode()).digest()

    coin = random_key("first side")[0] % 2
    by_side = sorted(pairs, key=lambda pair: random_key("side", pair.name))
    a_left = {pair.name: (rank + coin) % 2 == 0 for rank, pair in enumerate(by_side)}
    return [
        ShownPair(pair, a_left[pair.name]) for pair in sorted(pairs, key=lambda pair: random_key("order", pair.name))
    ]
