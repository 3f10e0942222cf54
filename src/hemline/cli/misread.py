"""What the parser of flags draws as a box, as one line in plain words."""

import re
from collections.abc import Sequence
from dataclasses import fields
from difflib import get_close_matches

from hemline.errors import BadInput

_KINDS = {"FLOAT": "a number", "INT": "a whole number", "PATH": "a path", "STR": "text"}


def misread(schema: type, verb: str, words: Sequence[str], drawn: str) -> BadInput:
    """The error for words that are no arguments of a verb.

    Args:
        schema: The verb's dataclass of arguments.
        verb: Its name.
        words: What was asked for.
        drawn: What tyro printed.
    """
    text = re.sub(r"\x1b\[[0-9;]*m", "", drawn)
    lines = [re.sub(r"[─│╭╮╰╯]+", " ", line).rstrip() for line in text.splitlines()]
    said = " ".join(line.strip() for line in lines if line.strip())
    asked, cure = " ".join(words)[:200] or "no arguments", f"see 'hemline {verb} --help'"
    known = [f"--{field.name.replace('_', '-')}" for field in fields(schema)]
    if found := re.search(r"Error parsing (--[\w-]+)", said):
        flag = found[1]
        kind = re.search(rf"{flag} (?:\{{None\}}\|)?(\[?\w+|\{{[^}}]+\}})", said.split("helptext:")[-1])
        return BadInput(f"{verb}: {flag} must be {_kind(kind[1] if kind else '')}", _given(flag, words), cure)
    if found := re.search(r"Missing value for argument '(?:-\w/)?(--[\w-]+)'. Expected (\d+)", said):
        count = "a value" if found[2] == "1" else f"{found[2]} values"
        return BadInput(f"{verb}: {found[1]} needs {count}", _given(found[1], words), cure)
    if found := re.search(r"Unrecognized options: (\S+)", said):
        near = get_close_matches(found[1], known, 1, 0.6)
        return BadInput(f"{verb} has no '{found[1]}'", asked, f"did you mean '{near[0]}'; {cure}" if near else cure)
    if "Missing from" in said:
        part = said.split("Missing from")[1]
        missing = [flag for flag in known if re.search(rf"{flag}\b", part)]
        first = [] if re.search(r": +-", part) else [fields(schema)[0].name.upper()]
        return BadInput(f"{verb} needs {' and '.join([*first, *missing])}", asked, cure)
    return BadInput(f"{verb}: {said}"[:300], asked, cure)


def _kind(drawn: str) -> str:
    """What a flag takes, out of the name of its kind."""
    if drawn.startswith("{"):
        return "one of " + ", ".join(drawn.strip("{}").split(","))
    if drawn.startswith("["):
        return "a list of " + {"FLOAT": "numbers", "INT": "whole numbers"}.get(drawn[1:], "words")
    return _KINDS.get(drawn, "something else")


def _given(flag: str, words: Sequence[str]) -> str:
    """What was given for a flag: the words up to the next one."""
    if flag not in words:
        return " ".join(words)[:200]
    after = list(words)[list(words).index(flag) + 1 :]
    end = next((place for place, word in enumerate(after) if re.match(r"-[-a-zA-Z]", word)), len(after))
    return " ".join(after[:end])[:100] or "nothing"
