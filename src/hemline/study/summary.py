"""What people answered, in numbers."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hemline.errors import BadInput

from .answers import NEUTRAL, POINTS, Answer


@dataclass(frozen=True)
class SummaryRow:
    """Answers to one question, about one pair or all of them; below 4 A is better, above 4 B.

    Args:
        question: What was asked.
        pair: The pair's name; None: all pairs together.
        participants: How many answered.
        counts: How often each of 1, 2, 3, 4, 5, 6, 7 was chosen.
        mean: Of the participants' answers, 1 to 7; over all pairs, of each participant's mean.
        deviation: Their standard deviation, of a sample; None: one participant.
        t: The statistic of a one-sample t-test against 4, no preference; None: one participant, or all of one mind.
        freedom: Its degrees of freedom.
        p: Its two-sided p-value.
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
    """Statistics by question: a row for each pair, then, where there are several, one for all.

    A participant's answers are not independent of each other. So the row for all pairs tests the participants' means.

    Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations", 2021,
    Section 4.8 and Table 3.
    Differs: the paper has no row for all scenarios.

    Args:
        answers: In any order.

    Raises:
        BadInput: There are none.
    """
    if not answers:
        raise BadInput("there is nothing to summarise", "no answers", "ask somebody: 'hemline compare A B --blind'")
    rows = []
    for question in dict.fromkeys(answer.question for answer in answers):
        asked = [answer for answer in answers if answer.question == question]
        pairs = sorted({answer.pair for answer in asked})
        rows += [_row(question, pair, [answer for answer in asked if answer.pair == pair]) for pair in pairs]
        if len(pairs) > 1:
            rows.append(_row(question, None, asked))
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
