"""Text of the page as HTML: whatever a name or an error contains, the browser shows it as text.

All text of the page goes through here. viser's Markdown is not used, since it reads the files that a text names and
runs parts of a text as a program.
"""

from collections.abc import Iterable, Sequence
from html import escape

from hemline.errors import HemlineError

LONGEST_ERROR = 600
"""Longest text of an error [characters]."""
_PLAIN = "padding:0 0.9em 0.7em;font-size:0.875em;line-height:1.5;overflow-wrap:anywhere"


def one_line(error: BaseException | None) -> str:
    """Returns an error as one printable line of at most 600 characters.

    Args:
        error: Any error; those of hemline already name a cure.
    """
    text = str(error) if isinstance(error, HemlineError) else f"something failed; got {type(error).__name__}: {error}"
    return "".join(letter if letter.isprintable() else " " for letter in text[:LONGEST_ERROR])


def lines(rows: Iterable[str], *, first_bold: bool = False, trouble: str = "") -> str:
    """Returns lines of text, one below the other.

    Args:
        rows: The lines, plain text.
        first_bold: Whether the first line is bold.
        trouble: An error, shown in red above the lines; empty: none.
    """
    safe = [escape(row) for row in rows]
    if first_bold and safe:
        safe[0] = f"<b>{safe[0]}</b>"
    wrong = f'<div role="alert" style="color:#c92a2a">{escape(trouble)}</div>' if trouble else ""
    return f'<div style="{_PLAIN}">{wrong}{"<br>".join(safe)}</div>'


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Returns a table; all columns but the first are numbers.

    Args:
        heads: Headings of the columns.
        rows: The cells, plain text.
    """
    body = "".join(_row("td", row) for row in rows)
    return f'<div style="{_PLAIN}"><table style="width:100%">{_row("th", heads)}{body}</table></div>'


def legend(rows: Iterable[tuple[tuple[int, int, int], str]], note: str = "") -> str:
    """Returns a legend of colours.

    Args:
        rows: Colours, sRGB from 0 to 255, each with its meaning as plain text.
        note: A text shown instead of the colours; empty: the colours are shown.
    """
    chips = escape(note) if note else "".join(_chip(*row) for row in rows)
    return f'<div style="padding:0 1em;font-size:0.85em">{chips}</div>'


def _row(tag: str, cells: Sequence[str]) -> str:
    sides = ("left", *["right"] * (len(cells) - 1))
    both = zip(sides, cells, strict=True)
    row = "".join(f'<{tag} style="text-align:{side}">{escape(cell)}</{tag}>' for side, cell in both)
    return f"<tr>{row}</tr>"


def _chip(colour: tuple[int, int, int], words: str) -> str:
    red, green, blue = (int(part) for part in colour)
    square = "display:inline-block;width:1em;height:1em;margin-right:0.5em;" + f"background:rgb({red}, {green}, {blue})"
    return f'<div><span style="{square}"></span>{escape(words)}</div>'
