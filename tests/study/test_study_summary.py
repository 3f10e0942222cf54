"""Statistics against the paper's own table, and against the t-distribution written another way."""

import math

import pytest
from scipy.special import betainc

from hemline.errors import BadInput
from hemline.study import QUESTIONS, summarise
from tests.study.study_samples import answer

TABLE = {
    QUESTIONS[0]: [
        ((4, 5, 6, 3, 0, 0, 0), 2.44, 1.042, -6.336),
        ((4, 6, 7, 1, 0, 0, 0), 2.28, 0.895, -8.166),
        ((4, 9, 3, 1, 1, 0, 0), 2.22, 1.060, -7.114),
    ],
    QUESTIONS[1]: [
        ((6, 7, 1, 4, 0, 0, 0), 2.17, 1.150, -6.761),
        ((4, 12, 1, 0, 0, 1, 0), 2.06, 1.110, -7.432),
        ((1, 11, 4, 0, 2, 0, 0), 2.50, 1.043, -6.101),
    ],
    QUESTIONS[2]: [
        ((4, 6, 4, 3, 0, 1, 0), 2.56, 1.338, -4.579),
        ((5, 6, 3, 4, 0, 0, 0), 2.33, 1.138, -6.216),
        ((5, 3, 6, 4, 0, 0, 0), 2.50, 1.150, -5.532),
    ],
}
"""Counts, mean and deviation of Table 3 of the AgentDress paper, and t of its Section 4.8, for three scenarios."""
CASES = [(question, place) for question in TABLE for place in range(3)]


def answers_of(counts, **changes) -> list:
    """One participant for each answer."""
    points = [point for point, count in enumerate(counts, 1) for _ in range(count)]
    return [answer(participant=f"P{n}", preference=point, **changes) for n, point in enumerate(points)]


@pytest.mark.parametrize("question, place", CASES)
def test_the_papers_table_comes_out(question, place):
    """The paper rounds to 2 or 3 decimals."""
    counts, mean, deviation, t = TABLE[question][place]
    (row,) = summarise(answers_of(counts, question=question))
    assert (row.question, row.pair, row.participants, row.counts, row.freedom) == (question, "walk", 18, counts, 17)
    assert row.mean == pytest.approx(mean, abs=0.0051)
    assert row.deviation == pytest.approx(deviation, abs=0.00051)
    assert row.t == pytest.approx(t, abs=0.0011)
    assert row.p < 0.001


@pytest.mark.parametrize("counts", [(4, 5, 6, 3, 0, 0, 0), (1, 0, 2, 3, 2, 1, 1), (0, 0, 0, 1, 1, 0, 0)])
def test_t_and_p_are_those_of_the_formula(counts):
    (row,) = summarise(answers_of(counts))
    assert row.t == pytest.approx((row.mean - 4) / (row.deviation / math.sqrt(row.participants)))
    freedom = row.participants - 1
    assert row.p == pytest.approx(betainc(freedom / 2, 0.5, freedom / (freedom + row.t**2)))


def test_all_pairs_are_tested_by_participant():
    """P1 says 1 and 3 (mean 2), P2 says 3 and 5 (mean 4), P3 left after saying 6."""
    said = {"P1": (1, 3), "P2": (3, 5), "P3": (6,)}
    answers = [
        answer(participant=person, pair=pair, preference=point)
        for person, points in said.items()
        for pair, point in zip(("walk", "turn"), points, strict=False)
    ]
    turn, walk, both = summarise(answers)
    assert [row.pair for row in (turn, walk, both)] == ["turn", "walk", None]
    assert (turn.participants, walk.participants, both.participants) == (2, 3, 3)
    assert both.counts == (1, 0, 2, 0, 1, 1, 0)
    assert both.mean == pytest.approx(4) and both.deviation == pytest.approx(2)
    assert both.t == pytest.approx(0) and both.p == pytest.approx(1)


def test_one_participant_is_no_sample():
    (row,) = summarise([answer(preference=7)])
    assert (row.mean, row.deviation, row.t, row.p, row.freedom) == (7, None, None, None, 0)


def test_where_all_say_the_same_there_is_no_test():
    (row,) = summarise(answers_of((0, 5, 0, 0, 0, 0, 0)))
    assert (row.mean, row.deviation, row.t, row.p) == (2, 0, None, None)


def test_no_answers_are_said():
    with pytest.raises(BadInput, match="there is nothing to summarise; got no answers; ask somebody"):
        summarise([])
