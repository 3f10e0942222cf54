"""`hemline bench NAME`."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from hemline.cli.progress import bars
from hemline.errors import BadInput

from .evaluate import table


@dataclass(frozen=True)
class BenchOptions:
    """Options of `hemline bench`."""

    name: Annotated[str | None, tyro.conf.Positional] = None
    """Benchmark to run; --list prints the names. It is required unless --list or --all is given."""
    list: bool = False
    """List the benchmarks and run none."""
    all: bool = False
    """Run all benchmarks."""
    record: Path | None = None
    """Folder whose NAME.jsonl gets the result as an additional line. By default nothing is recorded."""
    json: bool = False
    """Print one JSON object instead of a table: the result of the benchmark, or with --all those of all by name."""


def run(options: BenchOptions) -> int:
    """Runs the benchmarks and prints their figures."""
    from hemline.bench.benchmarks import BENCHMARKS, run_benchmark
    from hemline.files import check_folder

    if options.list:
        texts = {name: (benchmark.__doc__ or "").splitlines()[0] for name, benchmark in BENCHMARKS.items()}
        print(json.dumps(texts) if options.json else "\n".join(f"{name:<18}{text}" for name, text in texts.items()))
        return 0
    if options.record is not None:
        check_folder(options.record)
    names = list(BENCHMARKS) if options.all else [str(options.name)]
    for name in names:
        if name not in BENCHMARKS:
            raise BadInput("no such benchmark", name, f"use one of {', '.join(BENCHMARKS)}")
    rows = {}
    with bars() as display:
        task = display.add_task("benchmarks", total=len(names))
        for name in names:
            display.update(task, description=name, completed=len(rows))
            rows[name] = run_benchmark(name)
            if not options.json:
                print(table(rows[name]), flush=True)
            if options.record is not None:
                _record(options.record / f"{name}.jsonl", rows[name])
    if options.json:
        print(json.dumps(rows if options.all else rows[names[0]]))
    return 0


def _record(file: Path, row: dict[str, Any]) -> None:
    """Appends a line to a file, which is created if it is missing.

    Raises:
        BadOutput: The file cannot be written.
    """
    from hemline.files import atomic_write

    file.parent.mkdir(parents=True, exist_ok=True)
    before = file.read_bytes() if file.exists() else b""
    with atomic_write(file) as temporary:
        temporary.write_bytes(before + json.dumps(row).encode() + b"\n")
