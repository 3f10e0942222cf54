"""Pages of experiments: recorded rows, and Markdown made from them with one number per table cell.

An experiment records its measurements with `record`, as JSON lines in benchmarks/results, and builds a `Page` from such
rows, so that every page can be written again without a new run. Verdicts are computed from figures, never written by
hand.
"""

import argparse
import json
import math
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Self

from hemline.bench.machine import commit, machine

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / "benchmarks" / "results"
WIDTH = 120

Row = dict[str, Any]
Cell = float | int | str | None


COMMON_OPTIONS = {"seed": "random seed", "jobs": "number of processes"}


def parse_options(doc: str | None, *positional: str, **options: Any) -> argparse.Namespace:
    """Parses the command line of an experiment.

    Args:
        doc: Docstring of the experiment, which `--help` prints.
        positional: Names of positional arguments; "clips..." takes one or several. All are paths, except "model",
            "models..." and "clips...".
        options: Default of each option and its help, or its default alone for `COMMON_OPTIONS`. A list takes any number
            of words; a type instead of a default makes the option necessary.
    """
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in positional:
        kind = str if name.startswith(("model", "clips")) else Path
        parser.add_argument(name.removesuffix("..."), type=kind, nargs="+" if name.endswith("...") else None)
    for name, option in options.items():
        default, text = option if isinstance(option, tuple) else (option, COMMON_OPTIONS[name])
        if isinstance(default, list):
            parser.add_argument(f"--{name}", nargs="*", default=default, help=text)
        elif isinstance(default, type):
            parser.add_argument(f"--{name}", type=default, required=True, help=text)
        else:
            parser.add_argument(f"--{name}", type=type(default), default=default, help=f"{text}; default: {default}")
    return parser.parse_args()


def record(name: str, *rows: Row, threads: int = 1) -> list[Row]:
    """Appends rows to benchmarks/results/NAME.jsonl and returns them as they will be read.

    Args:
        name: Name of the results file, without its ending.
        rows: Measurements; machine, number of threads and commit are added.
        threads: Number of threads of the measurement.
    """
    origin = {"machine": machine(), "threads": threads, "commit": commit()}
    lines = [json.dumps(row | origin) for row in rows]
    with (RESULTS / f"{name}.jsonl").open("a") as stream:
        stream.writelines(f"{line}\n" for line in lines)
    return [json.loads(line) for line in lines]


def read_rows(name: str, **values: Any) -> list[Row]:
    """Reads the rows of a results file whose entries have the given values."""
    path = RESULTS / f"{name}.jsonl"
    lines = path.read_text().splitlines() if path.exists() else []
    return [row for row in map(json.loads, lines) if values.items() <= row.items()]


def last_row(name: str, **values: Any) -> Row:
    """Reads the last row of a results file whose entries have the given values.

    Raises:
        LookupError: There is no such row.
    """
    rows = read_rows(name, **values)
    if not rows:
        raise LookupError(f"{name}.jsonl has no row with {values}")
    return rows[-1]


def latest_rows(name: str, key: str) -> list[Row]:
    """Reads the rows of the last commit in a results file, the last one for each value of an entry."""
    rows = read_rows(name, commit=last_row(name)["commit"])
    return list({row[key]: row for row in rows}.values())


def origin_of(row: Row, command: str) -> str:
    """Returns a sentence with the command, commit, machine and number of threads of a row."""
    threads = row.get("threads", 1)
    count = "one thread" if threads == 1 else f"{threads} threads"
    return f"Written by `{command}` at commit {row['commit']}, on {row['machine']}, {count}."


def verdict(value: float, *, at_most: float = math.inf, at_least: float = -math.inf) -> str:
    """Returns whether a value reaches a goal, in words."""
    return "reached" if at_least <= value <= at_most else "not reached"


def join_numbers(numbers: Iterable[float], spec: str = "g") -> str:
    """Returns numbers separated by commas, such as the betas of a body."""
    return ", ".join(format(number, spec) for number in numbers)


def mean_of(rows: Sequence[Row], name: str) -> float:
    """Returns the mean of an entry over rows."""
    return math.fsum(row[name] for row in rows) / len(rows)


class Page:
    """A Markdown page that is built from top to bottom.

    Args:
        title: Its heading.
    """

    def __init__(self, title: str):
        self.blocks = [f"# {title}"]

    def section(self, title: str) -> Self:
        """Adds a heading of the second level."""
        self.blocks.append(f"## {title}")
        return self

    def text(self, *sentences: str) -> Self:
        """Adds a paragraph; line breaks within the sentences do not count."""
        words = " ".join(" ".join(sentences).split())
        self.blocks.append(textwrap.fill(words, WIDTH, break_long_words=False, break_on_hyphens=False))
        return self

    def table(self, columns: Mapping[str, str], rows: Iterable[Sequence[Cell]]) -> Self:
        """Adds a table.

        Args:
            columns: Headings, each with the format of its numbers, such as ".1f"; "" for a column of words.
            rows: Cells. None and NaN leave a cell empty.

        Raises:
            TypeError: A column of numbers holds words, such as two numbers in one cell.
            ValueError: A row has more or fewer cells than there are columns.
        """
        lines = [_line(columns), "|" + "---|" * len(columns)]
        for row in rows:
            lines.append(_line(_cell(cell, spec) for cell, spec in zip(row, columns.values(), strict=True)))
        self.blocks.append("\n".join(lines))
        return self

    def picture(self, caption: str, path: str) -> Self:
        """Adds a picture, with its path relative to the page."""
        self.blocks.append(f"![{caption}]({path})")
        return self

    def render(self) -> str:
        """Returns the page as Markdown."""
        return "\n\n".join(self.blocks) + "\n"

    def write(self, path: Path) -> str:
        """Writes the page and returns its text."""
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(self.render())
        return self.render()


def _line(cells: Iterable[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _cell(cell: Cell, spec: str) -> str:
    if cell is None or (isinstance(cell, float) and math.isnan(cell)):
        return ""
    if spec and isinstance(cell, str):
        raise TypeError(f"a column of numbers holds {cell!r}")
    return format(cell, spec)
