"""Reports progress on stderr: as bars on a terminal, or as lines for logs and other programs."""

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from .progress_lines import LogLines, ProgressLines


def is_followed_by_program() -> bool:
    """Whether a program called hemline, and reads its progress."""
    return os.environ.get("HEMLINE_PROGRESS") == "lines"


@contextmanager
def bars() -> Iterator[Any]:
    """Yields a rich progress display on stderr; if stderr is no terminal, lines with the time left now and then.

    With `HEMLINE_PROGRESS=lines` in the environment it prints lines `progress: STAGE DONE/TOTAL` instead, for programs
    that call hemline, such as the Blender extension.
    """
    if is_followed_by_program() or not sys.stderr.isatty():
        yield ProgressLines() if is_followed_by_program() else LogLines()
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(file=sys.stderr)) as progress:
        yield progress


@contextmanager
def stages() -> Iterator[Callable[[str, int, int], None]]:
    """Yields a callback that draws one bar per stage, called with the stage, the steps done and the total steps."""
    with bars() as display:
        tasks: dict[str, Any] = {}

        def report(stage: str, done: int, total: int) -> None:
            if stage not in tasks:
                tasks[stage] = display.add_task(stage, total=total)
            display.update(tasks[stage], completed=done, total=total)

        yield report


@contextmanager
def try_on_progress() -> Iterator[Callable[[int, int], None]]:
    """Yields a callback that draws one bar while garments are tried on, called with steps done and total steps."""
    with bars() as display:
        task = display.add_task("try on", total=None, visible=False)
        yield lambda done, total: display.update(task, completed=done, total=total, visible=True)


@contextmanager
def total(unit: str) -> Iterator[Callable[[str, int, int], None]]:
    """Yields a callback that draws one bar for all pieces of work, called with a piece, steps done and total steps."""
    with bars() as display:
        task, steps = display.add_task(unit, total=None), {}

        def report(piece: str, done: int, of: int) -> None:
            steps[piece] = done, of
            finished = sum(count == goal for count, goal in steps.values())
            display.update(
                task,
                description=f"{finished} of {len(steps)} takes, {unit}",
                completed=sum(count for count, _ in steps.values()),
                total=sum(goal for _, goal in steps.values()),
            )

        yield report


@contextmanager
def steps(count: int) -> Iterator[Callable[[str], None]]:
    """Yields a callback that draws one bar for a number of steps, called with words when each begins."""
    with bars() as display:
        task, begun = display.add_task("", total=count), 0

        def begin(words: str) -> None:
            nonlocal begun
            display.update(task, description=words, completed=begun)
            begun += 1

        yield begin


def note(text: str) -> None:
    """Prints a line on stderr."""
    print(text, file=sys.stderr, flush=True)
