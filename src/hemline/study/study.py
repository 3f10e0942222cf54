"""A study: the next pair and question for each participant, and their answers."""

import hmac
import json
import secrets
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from hemline.errors import BadAnswer, BadInput
from hemline.files import check_writable

from .answers import POINTS, Answer, add_answer, check_cell, normalise_code, read_answers
from .appending import open_locked
from .order import ShownPair, order_for
from .pairs import Pair

QUESTIONS = (
    "Which clothing animation looks more realistic?",
    "Which wrinkles look more natural?",
    "Which agent looks more like a real person?",
)
"""Questions about each scenario in Wu et al. 2021 (Section 4.8)."""
_LONGEST_ANSWER = 1e7
"""Longest time that an answer can take [s]."""


@dataclass(frozen=True)
class Item:
    """One question about one pair.

    Args:
        number: Number of the item for the participant, from 0.
        shown: The pair, with the sides of its clips.
        question: The question.
        token: Token that an answer must carry. It depends on participant, clips, sides and question, so that no answer
            is stored for another item, whatever has changed since the page was loaded. It is made with a secret of the
            `Study`, so nobody can guess it, and it does not reveal the side of A.
    """

    number: int
    shown: ShownPair
    question: str
    token: str


@dataclass(frozen=True)
class Study:
    """A blinded paired comparison within subjects. Its only memory is the CSV, so it can be interrupted at any time.

    Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations", 2021,
    Section 4.8.
    Differs: the page shows both clips at once; the paper shows one scene after the other in a headset, for a fixed
    time. Clip A is the method of the paper.

    Args:
        pairs: Pairs of clips.
        answers: Path of the CSV.
        questions: Questions about each pair, in their order.
        seed: Seed of the order and of the sides.

    Raises:
        BadInput: There is no question; a question occurs twice, is not one line of text or would be a formula in a
            spreadsheet; or the CSV contains answers of another study.
        BadOutput: The CSV cannot be written.
    """

    pairs: tuple[Pair, ...]
    answers: Path
    questions: tuple[str, ...] = QUESTIONS
    seed: int = 0
    _secret: bytes = field(default_factory=lambda: secrets.token_bytes(32), init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        good = [each.strip() and each.isprintable() and self.questions.count(each) == 1 for each in self.questions]
        if not good or not all(good):
            got = repr(next((each for each, fine in zip(self.questions, good, strict=True) if not fine), "none"))
            raise BadInput("questions must be lines of text that differ", got, "ask each one once")
        for question in self.questions:
            check_cell("a question", question)
        check_writable(self.answers)
        if self.answers.exists():
            with open_locked(self.answers):
                pass  # the file can be written
        self._check(self.all_answers())

    def all_answers(self) -> list[Answer]:
        """Reads all answers so far.

        Raises:
            BadInput: The CSV file was damaged after it was opened.
        """
        return read_answers(self.answers) if self.answers.exists() else []

    def items(self, participant: str) -> list[Item]:
        """Returns all items of a participant, in the order in which they are shown."""
        shown = order_for(participant, self.pairs, self.seed)
        both = [(each, question) for each in shown for question in self.questions]
        return [Item(number, *one, self._token(participant, *one)) for number, one in enumerate(both)]

    def next_item(self, participant: Any) -> Item | None:
        """Returns the next item of a participant; None if they have answered everything.

        Raises:
            BadAnswer: The code is invalid.
            BadInput: The CSV was damaged in the meantime.
        """
        return self._next_item(normalise_code(participant), self.all_answers())

    def answer(self, participant: Any, token: Any, point: Any, seconds: Any) -> None:
        """Stores an answer at once.

        Args:
            participant: Code of the participant.
            token: Token of the `Item` that is answered.
            point: Answer from 1, the left clip is much better, to 7, the right clip is much better.
            seconds: Time that it took [s].

        Raises:
            BadAnswer: A value is invalid, or the item is not the next one.
            BadInput: The CSV was damaged in the meantime.
            BadOutput: The CSV cannot be written; it is unchanged.
        """
        code = normalise_code(participant)
        if isinstance(point, bool) or not isinstance(point, int) or not 1 <= point <= POINTS:
            raise BadAnswer("an answer must be on the scale", repr(point)[:60], f"choose from 1 to {POINTS}")
        timed = isinstance(seconds, int | float) and not isinstance(seconds, bool)
        if not timed or not 0 <= seconds < _LONGEST_ANSWER:
            raise BadAnswer("seconds must be a number of at least 0", repr(seconds)[:60], "load the page again")
        sent = token.encode(errors="replace") if isinstance(token, str) else b""
        item = next((item for item in self.items(code) if hmac.compare_digest(item.token.encode(), sent)), None)
        if item is None:
            raise BadAnswer("there is no such question in this study", repr(token)[:60], "load the page again")
        pair, a_left = item.shown.pair, item.shown.a_left

        def check_order(answers: Sequence[Answer]) -> None:
            self._check(answers)
            if self._next_item(code, answers) != item:
                got = f"number {item.number + 1}"
                raise BadAnswer(
                    "this question is not asked now; it may be answered already", got, "load the page again"
                )

        row = Answer(
            participant=code,
            pair=pair.name,
            question=item.question,
            a=str(pair.a),
            b=str(pair.b),
            left="A" if a_left else "B",
            preference=point if a_left else POINTS + 1 - point,
            seconds=round(float(seconds), 3),
            time=datetime.now(UTC).isoformat(timespec="seconds"),
            seed=self.seed,
            clips=pair.contents,
        )
        add_answer(self.answers, row, check_order)

    def _next_item(self, code: str, answers: Sequence[Answer]) -> Item | None:
        done = {answer.key for answer in answers}
        items = self.items(code)
        return next((item for item in items if (code, item.shown.pair.name, item.question) not in done), None)

    def _token(self, code: str, shown: ShownPair, question: str) -> str:
        what = [self.seed, code, shown.pair.name, shown.pair.contents, shown.a_left, question]
        return hmac.digest(self._secret, json.dumps(what).encode(), "sha256").hex()[:32]

    def _check(self, answers: Sequence[Answer]) -> None:
        """Refuses answers about other clips or questions, or with another seed."""
        clips = {pair.name: pair.contents for pair in self.pairs}
        for answer in answers:
            reason = None
            if clips.get(answer.pair) != answer.clips:
                reason = f"other clips for '{answer.pair}'"
            elif answer.question not in self.questions:
                reason = f"the question '{answer.question}'"
            elif answer.seed != self.seed:
                reason = f"seed {answer.seed}"
            if reason is not None:
                cure = "name another file, or the same clips, questions and seed"
                raise BadInput(f"{self.answers} holds answers of another study", reason, cure)
