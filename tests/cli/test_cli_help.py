"""The help text of every option of every verb can be read alone: a sentence or a noun phrase, with a full stop."""

import ast
import inspect
import itertools
import textwrap
from dataclasses import dataclass, fields, is_dataclass
from typing import get_type_hints

import pytest

from hemline.animators.registry import OURS
from hemline.cli.main import VERBS, options_class
from tests.promises.words import ELLIPTIC

WORDS = {
    **{verb: [] for verb in VERBS if verb not in ("fit", "generate")},
    **{f"fit --animator {name}": ["--animator", name] for name in OURS},
    "generate": ["skirt"],
}
"""Words after the verb that select its options, by verb and words."""


@dataclass(frozen=True)
class Option:
    """An option as the help lists it."""

    name: str
    text: str
    """The help text, with the line breaks of the source."""


def options_in(options: type) -> list[Option]:
    """Returns the options of a class and of the options that it nests."""
    texts = {}
    for base in reversed(options.__mro__):
        if is_dataclass(base):
            texts |= docstrings(base)
    found, types = [], get_type_hints(options)
    for field in fields(options):
        nested = types[field.name]
        if is_dataclass(nested):
            found += options_in(nested)
        elif field.init:
            found.append(Option(field.name, texts.get(field.name, "")))
    return found


def docstrings(options: type) -> dict[str, str]:
    """Returns the docstring of each field that a class defines itself; of a class made at run time there are none."""
    try:
        tree = ast.parse(textwrap.dedent(inspect.getsource(options)))
    except (OSError, TypeError):
        return {}
    body = tree.body[0].body
    texts = {}
    for field, text in itertools.pairwise(body):
        if isinstance(field, ast.AnnAssign) and isinstance(text, ast.Expr) and isinstance(text.value, ast.Constant):
            texts[field.target.id] = inspect.cleandoc(text.value.value)
    return texts


def all_options() -> list[tuple[str, Option]]:
    """Returns the options of all verbs with the verb that shows them."""
    return [
        (words, option)
        for words, arguments in WORDS.items()
        for option in options_in(options_class(words.split()[0], arguments))
    ]


def test_every_verb_and_animator_has_options_to_read():
    verbs = {words for words, _ in all_options()}
    assert verbs == set(WORDS)
    names = {option.name for words, option in all_options() if words == "fit --animator ropes"}
    assert {"dataset", "animator", "chains", "checkpoint_epochs"} <= names


@pytest.mark.parametrize(("words", "option"), all_options(), ids=lambda each: getattr(each, "name", each))
def test_help_texts_can_be_read_alone(words, option):
    assert option.text, "an option without a help text"
    assert option.text[0].isupper() and option.text.endswith("."), option.text
    assert not ELLIPTIC.match(option.text), f"the text begins in the middle of a thought: {option.text}"
    assert len(option.text.split()) >= 3, f"too short to say what the option does: {option.text}"
    for line in option.text.splitlines():
        assert line.endswith("."), f"the help keeps the line break after '{line}': break the text after a sentence"


def test_the_summaries_of_verbs_are_imperative_phrases():
    for verb, summary in VERBS.items():
        assert summary[0].islower() and not summary.endswith("."), f"{verb}: {summary}"
        assert not ELLIPTIC.match(summary.capitalize()), f"{verb}: {summary}"
