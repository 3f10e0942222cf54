"""`hemline compare A B --blind`."""

import json
import threading
import webbrowser
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

import tyro

from hemline.cli.progress import note


@dataclass(frozen=True)
class CompareOptions:
    """Options of `hemline compare`."""

    clips: Annotated[tuple[Path, ...], tyro.conf.Positional] = ()
    """Clips A and B of one motion (.webp, .gif, .webm or .mp4), or two folders with clips of the same names.
    Several pairs can be given one after the other."""
    blind: bool = False
    """Run a blind study: names are hidden, order and sides are random, and questions are asked.
    Without it, the names are shown and nothing is asked."""
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"])] = Path("answers.csv")
    """CSV file of answers. Each answer is written at once, and a study is continued if the file exists."""
    questions: tuple[str, ...] = ()
    """Questions to ask about each pair. Defaults to the three questions of the AgentDress study."""
    seed: int = 0
    """Seed of the random order and sides."""
    port: int = 0
    """Port of the page on this machine. With 0 a free port is chosen."""
    browser: bool = True
    """Open the page in the browser."""
    summary: Path | None = None
    """CSV file of answers whose statistics are printed instead of showing a page. By default a page is shown."""
    json: bool = False
    """Print the statistics of --summary as one JSON object."""


def run(options: CompareOptions) -> int:
    """Serves the page until Ctrl-C, or prints statistics."""
    from hemline.errors import BadInput
    from hemline.study import QUESTIONS, Study, Viewer, pairs_of

    if options.summary is not None:
        if options.clips:
            raise BadInput("--summary takes no clips", options.clips[0], "leave out one of them")
        return _print_statistics(options.summary, as_json=options.json)
    if options.json:
        raise BadInput("--json is for statistics", "no --summary", "add --summary answers.csv")
    if options.questions and not options.blind:
        raise BadInput("--questions are asked in a blind comparison only", "no --blind", "add --blind")
    pairs = pairs_of(options.clips)
    study = pairs
    if options.blind:
        study = Study(pairs, options.output, questions=options.questions or QUESTIONS, seed=options.seed)
    with Viewer(study, port=options.port, report=lambda line: note(f"hemline: {line}")) as viewer:
        print(viewer.url, flush=True)
        note("Ctrl-C ends it" + (f"; answers are kept in {options.output}" if options.blind else ""))
        if options.browser:
            address = viewer.door.one_time_address()
            threading.Thread(
                target=webbrowser.open, args=(address,), daemon=True
            ).start()  # some browsers block until they are closed
        try:
            viewer.serve_forever()
        except KeyboardInterrupt:
            note("ended")
    return 0


def _print_statistics(path: Path, *, as_json: bool) -> int:
    from hemline.study import read_answers, summarise

    answers = read_answers(path)
    rows = summarise(answers)
    a, b = (sorted({getattr(answer, side) for answer in answers}) for side in ("a", "b"))
    if as_json:
        print(json.dumps({"answers": str(path), "a": a, "b": b, "rows": [asdict(row) for row in rows]}))
        return 0
    print(f"A: {_first_of(a)}\nB: {_first_of(b)}\n1: A is much better, 4: no preference, 7: B is much better\n")
    for question in dict.fromkeys(row.question for row in rows):
        question_rows = [row for row in rows if row.question == question]
        width = max(len(row.pair or "all pairs") for row in question_rows)
        print(f"{question}\n  {'':<{width}}    n    1   2   3   4   5   6   7    mean     SD  t-test against 4")
        for row in question_rows:
            counts = " ".join(f"{count:3d}" for count in row.counts)
            print(
                f"  {row.pair or 'all pairs':<{width}}  {row.participants:3d}  {counts}    {row.mean:4.2f}"
                f" {_t_test(row)}"
            )
    return 0


def _first_of(paths: list[str]) -> str:
    more = f" and {len(paths) - 1} more" if len(paths) > 1 else ""
    return paths[0] + more


def _t_test(row) -> str:
    """Formats deviation and t-test of a row as in the AgentDress paper."""
    deviation = "     -" if row.deviation is None else f"{row.deviation:6.3f}"
    if row.t is None:
        return f"{deviation}  -"
    chance = "p < 0.001" if row.p < 0.001 else f"p = {row.p:.3f}"
    return f"{deviation}  t({row.freedom}) = {row.t:.3f}, {chance}"
