"""Progress on stderr: bars for people; for other programs, lines."""

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def bars() -> Iterator[Any]:
    """A rich progress display on stderr; nothing is drawn where stderr is no terminal.

    With `HEMLINE_PROGRESS=lines` in the environment, lines `progress: STAGE DONE/TOTAL` in its place, for programs that
    call hemline (the add-on for Blender does).
    """
    if os.environ.get("HEMLINE_PROGRESS") == "lines":
        yield _Lines()
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    shown = sys.stderr.isatty()
    progress = Progress(*columns, console=Console(file=sys.stderr), disable=not shown)
    if not shown:  # begun and ended, rich before 14.3 writes an empty line even so
        yield progress
        return
    with progress:
        yield progress


class _Lines:
    """What `bars` gives, as lines; one a percent at most."""

    def __init__(self) -> None:
        self._tasks: list[list[Any]] = []  # of each: stage, done, total, the last percent that was told

    def add_task(self, description: str, total: int | None = None, visible: bool = True) -> int:
        """A stage; its number."""
        self._tasks.append([description, 0, total, -1])
        return len(self._tasks) - 1

    def advance(self, task: int) -> None:
        """One step is done."""
        self.update(task, completed=self._tasks[task][1] + 1)

    def update(self, task: int, completed: int, total: int | None = None, visible: bool = True) -> None:
        """So many steps are done; tell it where the percent is another one."""
        stage, _, before, told = self._tasks[task]
        total = before if total is None else total
        percent = 100 * completed // total if total else 0
        self._tasks[task] = [stage, completed, total, percent]
        if total and percent != told:
            note(f"progress: {stage} {completed}/{total}")


@contextmanager
def stages() -> Iterator[Callable[[str, int, int], None]]:
    """A bar for each stage of some work: called with the stage, what is done and what there is in all."""
    with bars() as display:
        tasks: dict[str, Any] = {}

        def report(stage: str, done: int, total: int) -> None:
            if stage not in tasks:
                tasks[stage] = display.add_task(stage, total=total)
            display.update(tasks[stage], completed=done, total=total)

        yield report


@contextmanager
def total(what: str) -> Iterator[Callable[[str, int, int], None]]:
    """One bar for all pieces of some work, wherever they are worked on: called with a piece, its steps done and all."""
    with bars() as display:
        task, steps = display.add_task(what, total=None), {}

        def report(piece: str, done: int, of: int) -> None:
            steps[piece] = done, of
            ended = sum(one == all_of for one, all_of in steps.values())
            display.update(
                task,
                description=f"{ended} of {len(steps)} takes, {what}",
                completed=sum(one for one, _ in steps.values()),
                total=sum(all_of for _, all_of in steps.values()),
            )

        yield report


def note(text: str) -> None:
    """Say something on stderr."""
    print(text, file=sys.stderr, flush=True)
