"""`hemline compare A B --blind`."""

import json
import threading
import webbrowser
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

import tyro

from .progress import note


@dataclass(frozen=True)
class Arguments:
    """Show clips side by side on a local page, and ask people which they prefer."""

    clips: Annotated[tuple[Path, ...], tyro.conf.Positional] = ()
    """A and B: two clips of one motion (.webp .gif .webm .mp4), or two folders of clips of like names; more in twos."""
    blind: bool = False
    """Ask people: no names, order and sides drawn for each. Without it, names are shown and nothing is asked."""
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"])] = Path("answers.csv")
    """The CSV of answers, each written at once; a study goes on where it was left."""
    questions: tuple[str, ...] = ()
    """What is asked about each pair; left out: the three questions of the AgentDress study."""
    seed: int = 0
    """Of the order and of the sides."""
    port: int = 0
    """Where the page listens on this machine; 0: a port that is free."""
    browser: bool = True
    """Open the page in the browser."""
    summary: Path | None = None
    """Instead, print the statistics of this CSV of answers."""
    json: bool = False
    """Print them as one JSON object."""


def run(arguments: Arguments) -> int:
    """Serve the page until Ctrl-C, or print statistics."""
    from hemline.errors import BadInput
    from hemline.study import QUESTIONS, Study, Viewer, pairs_of

    if arguments.summary is not None:
        if arguments.clips:
            raise BadInput("--summary takes no clips", arguments.clips[0], "leave out one of them")
        return _summarise(arguments.summary, as_json=arguments.json)
    if arguments.json:
        raise BadInput("--json is for statistics", "no --summary", "add --summary answers.csv")
    if arguments.questions and not arguments.blind:
        raise BadInput("--questions are asked in a blind comparison only", "no --blind", "add --blind")
    pairs = pairs_of(arguments.clips)
    asked = pairs
    if arguments.blind:
        asked = Study(pairs, arguments.output, questions=arguments.questions or QUESTIONS, seed=arguments.seed)
    with Viewer(asked, port=arguments.port, report=lambda line: note(f"hemline: {line}")) as viewer:
        print(viewer.url, flush=True)
        note("Ctrl-C ends it" + (f"; answers are kept in {arguments.output}" if arguments.blind else ""))
        if arguments.browser:
            address = viewer.door.address_for_once()
            threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()  # some wait for its end
        try:
            viewer.serve_forever()
        except KeyboardInterrupt:
            note("ended")
    return 0


def _summarise(path: Path, *, as_json: bool) -> int:
    from hemline.study import read_answers, summarised

    answers = read_answers(path)
    rows = summarised(answers)
    a, b = (sorted({getattr(answer, side) for answer in answers}) for side in ("a", "b"))
    if as_json:
        print(json.dumps({"answers": str(path), "a": a, "b": b, "rows": [asdict(row) for row in rows]}))
        return 0
    print(f"A: {_several(a)}\nB: {_several(b)}\n1: A is much better, 4: no preference, 7: B is much better\n")
    for question in dict.fromkeys(row.question for row in rows):
        mine = [row for row in rows if row.question == question]
        width = max(len(row.pair or "all pairs") for row in mine)
        print(f"{question}\n  {'':<{width}}    n    1   2   3   4   5   6   7    mean     SD  t-test against 4")
        for row in mine:
            counts = " ".join(f"{count:3d}" for count in row.counts)
            print(
                f"  {row.pair or 'all pairs':<{width}}  {row.participants:3d}  {counts}    {row.mean:4.2f} {_test(row)}"
            )
    return 0


def _several(paths: list[str]) -> str:
    more = f" and {len(paths) - 1} more" if len(paths) > 1 else ""
    return paths[0] + more


def _test(row) -> str:
    """Deviation and t-test of a row, as the paper writes them."""
    deviation = "     -" if row.deviation is None else f"{row.deviation:6.3f}"
    if row.t is None:
        return f"{deviation}  -"
    chance = "p < 0.001" if row.p < 0.001 else f"p = {row.p:.3f}"
    return f"{deviation}  t({row.freedom}) = {row.t:.3f}, {chance}"
