"""Turns tyro's error message into one line in plain words.

tyro prints a usage error as text in a box and offers no other form of it. This file strips the box and the colours, and
finds the fault by regular expressions over tyro's English sentences. A new version of tyro may word them otherwise; the
last line of `usage_error` then passes tyro's text on, and `tests/cli/test_cli_errors.py` fails.
"""

import re
from collections.abc import Sequence
from dataclasses import fields
from difflib import get_close_matches

from hemline.errors import BadInput

_KINDS = {"FLOAT": "a number", "INT": "a whole number", "PATH": "a path", "STR": "text"}


def usage_error(schema: type, verb: str, words: Sequence[str], box: str) -> BadInput:
    """Returns the error for words that are no valid options of a verb.

    Args:
        schema: The dataclass of the verb's options.
        verb: Name of the verb.
        words: The words after the verb.
        box: The text that tyro printed, box and colours included.
    """
    text = re.sub(r"\x1b\[[0-9;]*m", "", box)
    lines = [re.sub(r"[─│╭╮╰╯]+", " ", line).rstrip() for line in text.splitlines()]
    message = " ".join(line.strip() for line in lines if line.strip())
    given, cure = " ".join(words)[:200] or "no arguments", f"see 'hemline {verb} --help'"
    flags = [f"--{field.name.replace('_', '-')}" for field in fields(schema)]
    if match := re.search(r"Error parsing (--[\w-]+)", message):
        flag = match[1]
        kind = re.search(rf"{flag} (?:\{{None\}}\|)?(\[?\w+|\{{[^}}]+\}})", message.split("helptext:")[-1])
        return BadInput(f"{verb}: {flag} must be {_kind(kind[1] if kind else '')}", _value(flag, words), cure)
    if match := re.search(r"Missing value for argument '(?:-\w/)?(--[\w-]+)'. Expected (\d+)", message):
        count = "a value" if match[2] == "1" else f"{match[2]} values"
        return BadInput(f"{verb}: {match[1]} needs {count}", _value(match[1], words), cure)
    if match := re.search(r"Unrecognized options: (\S+)", message):
        near = get_close_matches(match[1], flags, 1, 0.6)
        return BadInput(f"{verb} has no '{match[1]}'", given, f"did you mean '{near[0]}'; {cure}" if near else cure)
    if "Missing from" in message:
        part = message.split("Missing from")[1]
        missing = [flag for flag in flags if re.search(rf"{flag}\b", part)]
        positional = [] if re.search(r": +-", part) else [fields(schema)[0].name.upper()]
        return BadInput(f"{verb} needs {' and '.join([*positional, *missing])}", given, cure)
    return BadInput(f"{verb}: {message}"[:300], given, cure)


def _kind(metavar: str) -> str:
    """Names what an option takes, given tyro's placeholder for its value."""
    if metavar.startswith("{"):
        return "one of " + ", ".join(metavar.strip("{}").split(","))
    if metavar.startswith("["):
        return "a list of " + {"FLOAT": "numbers", "INT": "whole numbers"}.get(metavar[1:], "words")
    return _KINDS.get(metavar, "something else")


def _value(flag: str, words: Sequence[str]) -> str:
    """Returns the words between an option and the next one."""
    if flag not in words:
        return " ".join(words)[:200]
    after = list(words)[list(words).index(flag) + 1 :]
    end = next((place for place, word in enumerate(after) if re.match(r"-[-a-zA-Z]", word)), len(after))
    return " ".join(after[:end])[:100] or "nothing"
