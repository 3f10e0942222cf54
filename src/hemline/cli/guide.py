"""What each verb says before its work, and the command to try after it."""

import os
import shlex
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .progress import is_followed_by_program, note


@dataclass(frozen=True)
class Guide:
    """Words of a verb, each made from its options."""

    doing: Callable[[Any], str]
    """What the verb is going to do."""
    then: Callable[[Any], str | None]
    """The command to try next; None if there is none, or if only the verb itself knows it."""


def _all(words: Iterable[object]) -> str:
    return shlex.join(str(word) for word in words)


def _one(word: object) -> str:
    return shlex.quote(str(word))


def _next_of_animate(options: Any) -> str:
    if options.model is None or options.garment is not None:
        return f"hemline make {_one(options.garment)} -o {Path(str(options.garment)).stem}.safetensors"
    return f"hemline evaluate {_one(options.model)} -m {_one(options.motion)}"


def _next_of_drape(options: Any) -> str:
    if options.anchors or options.tour or options.poses_of is not None:
        return f"hemline fit {_one(options.output)} -o {_one(options.output.with_suffix('.safetensors'))}"
    return f"hemline drape {_one(options.garment)} --anchors 4 --poses 40 -m walk run -o {_one(options.output)}-posed"


def _next_of_page(options: Any) -> str | None:
    if options.output.suffix == ".html":
        return None
    return f"python -m http.server --directory {_one(options.output)}"


def _next_of_compare(options: Any) -> str | None:
    if options.summary is not None:
        return None
    if options.blind:
        return f"hemline compare --summary {_one(options.output)}"
    return f"hemline compare {_all(options.clips)} --blind"


GUIDES: dict[str, Guide] = {
    "make": Guide(
        lambda o: (
            f"making a model of {o.garment} in {o.minutes:g} minutes with {o.jobs} processes: "
            "try it on, simulate two seconds, choose data, fit, compare methods on a clip, write a report"
        ),
        lambda o: f"hemline animate {_one(o.output)} -m dance -o dance.glb",
    ),
    "body": Guide(
        lambda o: f"converting {o.character} to a body",
        lambda o: f"hemline animate live --garment skirt --body {_one(o.output)} -m walk -o walk.glb",
    ),
    "generate": Guide(
        lambda o: f"making a garment of the kind {o.kind}",
        lambda o: f"hemline animate --garment {_one(o.output)} -m dance -o dance.glb",
    ),
    "tryon": Guide(
        lambda o: f"trying on {o.garment}",
        lambda o: f"hemline make {_one(o.output)} -o model.safetensors",
    ),
    "simulate": Guide(
        lambda o: f"simulating {_all([o.garment, *o.over])} on {_all(o.motion)}",
        lambda o: f"hemline fit {_one(o.output)} -o {_one(o.output.with_suffix('.safetensors'))}",
    ),
    "drape": Guide(lambda o: f"settling {o.garment}", _next_of_drape),
    "fit": Guide(
        lambda o: f"fitting a model to {_all(o.dataset)}",
        lambda o: f"hemline evaluate {_one(o.output)} -m dance",
    ),
    "animate": Guide(
        lambda o: f"playing {_all(each for each in (o.model, o.garment, *o.over) if each)} on {o.motion}",
        _next_of_animate,
    ),
    "export": Guide(
        lambda o: f"writing take {o.take} of {o.dataset}",
        lambda o: f"hemline fit {_one(o.dataset)} -o {_one(o.dataset.with_suffix('.safetensors'))}",
    ),
    "character": Guide(
        lambda o: f"dressing a character with {o.model}",
        lambda o: f"hemline page {_one(o.model)} -o page.html",
    ),
    # what a file is turns out while it is read, so that the verb names the next command
    "explain": Guide(lambda o: f"reading {o.file}", lambda o: None),
    "evaluate": Guide(
        lambda o: f"measuring {_all(each for each in (o.model, o.garment, *o.over) if each)} on {o.motion}",
        lambda o: f"hemline view {_one(o.model)}",
    ),
    "view": Guide(
        lambda o: f"opening a page that plays {_all(o.models) or 'the shipped models'}",
        lambda o: f"hemline page {_all(o.models) or 'cape tshirt-light'} -o page.html",
    ),
    "page": Guide(lambda o: f"writing a page that plays {_all(o.models)}", _next_of_page),
    "compare": Guide(
        lambda o: f"counting the answers in {o.summary}" if o.summary else "opening a page with clips side by side",
        _next_of_compare,
    ),
    "demo": Guide(
        lambda o: (
            "playing a cape, a T-shirt on three bodies and a dress"
            if not o.from_nothing
            else "simulating, fitting, playing and measuring a light cape"
        ),
        lambda o: "hemline view",
    ),
    "bench": Guide(
        lambda o: "timing this machine" if not o.list else "listing the benchmarks",
        lambda o: "hemline bench --list" if not o.list else "hemline bench cape",
    ),
    "warmup": Guide(lambda o: "compiling all kernels", lambda o: "hemline demo"),
}
"""The words of each verb."""


def say_beginning(verb: str, options: Any) -> None:
    """Prints on stderr what a verb is going to do."""
    if not _is_silent():
        note(f"{verb}: {GUIDES[verb].doing(options)}")


def say_end(verb: str, options: Any) -> None:
    """Prints on stderr the command to try after a verb that succeeded, unless its output is for a program."""
    command = GUIDES[verb].then(options)
    if command is not None and not getattr(options, "json", False):
        say_next(command)


def say_next(command: str) -> None:
    """Prints on stderr the command to try next."""
    if not _is_silent():
        note(f"next: {command}")


def _is_silent() -> bool:
    """Whether nobody reads these words: a program follows this one, or another process of a training prints them."""
    return is_followed_by_program() or os.environ.get("RANK", "0") != "0"
