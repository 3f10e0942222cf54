"""Statistics of the answers."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hemline.errors import BadInput

from .answers import NEUTRAL, POINTS, Answer


@dataclass(frozen=True)
class SummaryRow:
    """Statistics of one question about one pair or all pairs; below 4 A is better, above 4 B.

    Args:
        question: The question.
        pair: Name of the pair; None: all pairs together.
        participants: Number of participants who answered.
        counts: Number of answers at each point from 1 to 7.
        mean: Mean answer of the participants, 1 to 7; over all pairs, mean of the means of participants.
        deviation: Sample standard deviation of the participants; None for one participant.
        t: Statistic of a one-sample t-test against 4, no preference; None for one participant or equal answers.
        freedom: Degrees of freedom of the test.
        p: Two-sided p-value of the test.
    """

    question: str
    pair: str | None
    participants: int
    counts: tuple[int, ...]
    mean: float
    deviation: float | None
    t: float | None
    freedom: int
    p: float | None


def summarise(answers: Sequence[Answer]) -> list[SummaryRow]:
    """Returns statistics by question: a row for each pair, and one for all pairs where there are several.

    Answers of one participant are not independent of each other, so the row for all pairs tests the means of the
    participants.

    Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations", 2021,
    Section 4.8 and Table 3.
    Differs: the paper has no row for all scenarios.

    Args:
        answers: Answers in any order.

    Raises:
        BadInput: There are no answers.
    """
    if not answers:
        raise BadInput("there is nothing to summarise", "no answers", "ask somebody: 'hemline compare A B --blind'")
    rows = []
    for question in dict.fromkeys(answer.question for answer in answers):
        answers_to = [answer for answer in answers if answer.question == question]
        pairs = sorted({answer.pair for answer in answers_to})
        rows += [_row(question, pair, [answer for answer in answers_to if answer.pair == pair]) for pair in pairs]
        if len(pairs) > 1:
            rows.append(_row(question, None, answers_to))
    return rows


def _row(question: str, pair: str | None, answers: Sequence[Answer]) -> SummaryRow:
    chosen = np.array([answer.preference for answer in answers])
    people = np.array([answer.participant for answer in answers])
    means = np.array([chosen[people == one].mean() for one in dict.fromkeys(people.tolist())])
    counts = tuple(np.bincount(chosen, minlength=POINTS + 1)[1:].tolist())
    deviation = float(means.std(ddof=1)) if len(means) > 1 else None
    t, p = None, None
    if deviation is not None and np.ptp(means) > 0:
        from scipy.stats import ttest_1samp

        t, p = np.array(ttest_1samp(means, NEUTRAL)).tolist()
    return SummaryRow(question, pair, len(means), counts, float(means.mean()), deviation, t, len(means) - 1, p)
