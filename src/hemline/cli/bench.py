"""`hemline bench NAME`."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from hemline.errors import BadInput

from .evaluate import table


@dataclass(frozen=True)
class Arguments:
    """Time what ships, on this machine."""

    name: Annotated[str | None, tyro.conf.Positional] = None
    """Which benchmark; see --list."""
    list: bool = False
    """Name them all."""
    all: bool = False
    """Run them all."""
    record: Path | None = None
    """A folder: add a line to NAME.jsonl in it."""
    json: bool = False
    """Print one JSON object a benchmark."""


def run(arguments: Arguments) -> int:
    """Time and print."""
    from hemline.bench.benchmarks import BENCHMARKS, run_benchmark
    from hemline.files import check_folder

    if arguments.list:
        for name, benchmark in BENCHMARKS.items():
            print(f"{name:<18}{(benchmark.__doc__ or '').splitlines()[0]}")
        return 0
    if arguments.record is not None:
        check_folder(arguments.record)
    names = list(BENCHMARKS) if arguments.all else [str(arguments.name)]
    for name in names:
        if name not in BENCHMARKS:
            raise BadInput("no such benchmark", name, f"use one of {', '.join(BENCHMARKS)}")
    for name in names:
        row = run_benchmark(name)
        print(json.dumps(row) if arguments.json else table(row))
        if arguments.record is not None:
            _record(arguments.record / f"{name}.jsonl", row)
    return 0


def _record(file: Path, row: dict[str, Any]) -> None:
    """Add a line to a file, which is made if it is missing.

    Raises:
        BadOutput: It cannot be written.
    """
    from hemline.files import written_whole

    file.parent.mkdir(parents=True, exist_ok=True)
    before = file.read_bytes() if file.exists() else b""
    with written_whole(file) as temporary:
        temporary.write_bytes(before + json.dumps(row).encode() + b"\n")
