"""Order and sides: all pairs once, counterbalanced, and fair over participants and over seeds."""

from collections import Counter
from itertools import permutations
from pathlib import Path

import pytest
from scipy.stats import binomtest, chisquare

from hemline.study import Pair
from hemline.study.order import order_for

PEOPLE = [f"P{number}" for number in range(3000)]


def pairs(count: int) -> list[Pair]:
    return [Pair(f"clip {n}", Path(f"a{n}.webp"), Path(f"b{n}.webp"), "sha256:0123456789ab") for n in range(count)]


@pytest.mark.parametrize("count", [1, 2, 3, 6, 7])
def test_each_sees_all_pairs_once_and_a_on_the_left_in_half(count):
    for person in PEOPLE[:50]:
        shown = order_for(person, pairs(count), 0)
        assert {each.pair.name for each in shown} == {each.name for each in pairs(count)} and len(shown) == count
        assert sum(each.a_left for each in shown) in {count // 2, (count + 1) // 2}


@pytest.mark.parametrize("over", ["participants", "seeds"])
def test_orders_and_sides_are_fair(over):
    """Chi-square over all orders of three pairs; a binomial test for the side of each pair and of each place."""
    runs = [
        order_for(p, pairs(3), 5) if over == "participants" else order_for("P1", pairs(3), int(p[1:])) for p in PEOPLE
    ]
    orders = Counter(tuple(each.pair.name for each in shown) for shown in runs)
    assert set(orders) == set(permutations(each.name for each in pairs(3)))
    assert chisquare(list(orders.values())).pvalue > 1e-4
    for name in (each.name for each in pairs(3)):
        left = sum(each.a_left for shown in runs for each in shown if each.pair.name == name)
        assert binomtest(left, len(runs)).pvalue > 1e-4
    for place in range(3):
        assert binomtest(sum(shown[place].a_left for shown in runs), len(runs)).pvalue > 1e-4


def test_the_order_is_kept_however_the_pairs_come():
    assert order_for("P1", pairs(6), 3) == order_for("P1", pairs(6)[::-1], 3)
    assert order_for("P1", pairs(6), 3) != order_for("P1", pairs(6), 4)
    assert order_for("P1", pairs(6), 3) != order_for("P2", pairs(6), 3)
