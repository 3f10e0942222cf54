"""Reports progress on stderr: as bars on a terminal, or as lines for other programs."""

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def bars() -> Iterator[Any]:
    """Yields a rich progress display on stderr, which draws nothing if stderr is not a terminal.

    With `HEMLINE_PROGRESS=lines` in the environment it prints lines `progress: STAGE DONE/TOTAL` instead, for programs
    that call hemline, such as the Blender add-on.
    """
    if os.environ.get("HEMLINE_PROGRESS") == "lines":
        yield _ProgressLines()
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    visible = sys.stderr.isatty()
    progress = Progress(*columns, console=Console(file=sys.stderr), disable=not visible)
    if not visible:  # rich before 14.3 prints an empty line when a disabled display starts and stops
        yield progress
        return
    with progress:
        yield progress


class _ProgressLines:
    """Progress display that prints lines, at most one per percent."""

    def __init__(self) -> None:
        self._tasks: list[list[Any]] = []  # stage, steps done, total steps and last printed percent of each task

    def add_task(self, description: str, total: int | None = None, visible: bool = True) -> int:
        """Adds a task and returns its number."""
        self._tasks.append([description, 0, total, -1])
        return len(self._tasks) - 1

    def advance(self, task: int) -> None:
        """Counts one more step of a task."""
        self.update(task, completed=self._tasks[task][1] + 1)

    def update(self, task: int, completed: int, total: int | None = None, visible: bool = True) -> None:
        """Sets the number of steps done, and prints a line if the percentage changed."""
        stage, _, before, printed = self._tasks[task]
        total = before if total is None else total
        percent = 100 * completed // total if total else 0
        self._tasks[task] = [stage, completed, total, percent]
        if total and percent != printed:
            note(f"progress: {stage} {completed}/{total}")


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
def status() -> Iterator[Callable[[str], None]]:
    """Yields a callback that shows a line of text on a terminal until the next one; elsewhere it prints nothing."""
    from rich.console import Console

    console = Console(file=sys.stderr)
    if not console.is_terminal:
        yield lambda text: None
        return
    with console.status("") as display:
        yield display.update


def note(text: str) -> None:
    """Prints a line on stderr."""
    print(text, file=sys.stderr, flush=True)
