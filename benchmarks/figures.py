"""Writes docs/figures.md from benchmarks/figures.txt: one figure a row, one number a cell.

`python -m benchmarks.figures` writes the page; `--check` only says whether it is up to date. A figure is changed in
figures.txt, after the command of its table was run again.
"""

import argparse
import sys
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).parents[1]
SOURCE, PAGE = ROOT / "benchmarks" / "figures.txt", ROOT / "docs" / "figures.md"
MACHINES = {"X": "Xeon", "E": "EPYC"}
"""Machines by their letter in figures.txt: an Intel Xeon (Sapphire Rapids) and an AMD EPYC, two cores each."""
HEAD = """# Goals and figures

Each table names the command that measures its figures again; records of single runs are kept in `benchmarks/results`.
Goals that were not reached stand beside what was measured. "Xeon" is an Intel Xeon (Sapphire Rapids), "EPYC" an AMD
EPYC, both with two cores and Python 3.11. Terms are in the [glossary](glossary.md). Figures of [export](export.md),
[pages](page.md), [the viewer](view.md), [layers](layers.md) and [garments](wardrobe_figures.md) are on their pages.
"""

COLUMNS = ("quantity", "case", "goal", "measured", "machine")


@dataclass
class Table:
    """Figures that one command measures."""

    title: str
    command: str
    rows: list[tuple[str, str, str, str, str]] = field(default_factory=list)
    """Quantity, case, goal, measured value, machine."""


def read_tables(text: str) -> list[Table]:
    """Reads the tables of figures.txt.

    Raises:
        ValueError: A line has not five columns, stands before any table, or names an unknown machine.
    """
    tables: list[Table] = []
    for number, line in enumerate(text.splitlines(), 1):
        if not line.strip() or line.startswith("#"):
            continue
        if line.startswith("="):
            title, _, command = line[1:].partition("|")
            tables.append(Table(title.strip(), command.strip()))
            continue
        cells = [cell.strip() for cell in line.split("|")]
        if len(cells) != 5 or not tables or cells[4] not in MACHINES:
            raise ValueError(f"{SOURCE.name}, line {number}: expected quantity | case | goal | measured | X or E")
        tables[-1].rows.append((cells[0], cells[1], cells[2], cells[3], MACHINES[cells[4]]))
    return tables


def page(tables: list[Table]) -> str:
    """Returns the Markdown of docs/figures.md."""
    parts = [HEAD]
    for table in tables:
        machines = {row[4] for row in table.rows}
        shared = f" on the {machines.pop()}" if len(machines) == 1 else ""
        lines = [f"## {table.title}", "", f"Measured{shared} by {table.command}.", ""]
        width = 4 if shared else 5
        lines += [f"| {' | '.join(COLUMNS[:width])} |", "|---" * width + "|"]
        lines += [f"| {' | '.join(row[:width])} |".replace("|  |", "| |").replace("|  |", "| |") for row in table.rows]
        parts.append("\n".join(lines) + "\n")
    return "\n".join(parts)


def main() -> None:
    """Writes or checks the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="Exit with status 1 if the page is out of date.")
    options = parser.parse_args()
    text = page(read_tables(SOURCE.read_text()))
    if options.check:
        sys.exit(PAGE.read_text() != text)
    PAGE.write_text(text)


if __name__ == "__main__":
    main()
