"""Selects the verb, and turns errors into one line and an exit status."""

import contextlib
import importlib
import io
import logging
import os
import sys
import warnings
from collections.abc import Iterator, Sequence

from hemline.errors import BadCluster, BadInput, HemlineError, HemlineWarning, SimulationFailed

from .guide import say_beginning, say_end
from .usage_error import usage_error

VERBS = {
    "make": "make a model of any garment mesh: try on, choose a method by measurement, fit, check, report",
    "body": "convert a rigged character (GLB, VRM, FBX) or an SMPL file to a body that wears garments",
    "generate": "make a top, dress, skirt, trousers or jumpsuit from its measures",
    "tryon": "put a garment made for another body onto this one, or report why it cannot be worn",
    "simulate": "simulate a garment on motion clips into a dataset of takes",
    "drape": "settle a garment at rest on bodies of many shapes into a dataset",
    "fit": "train an animator on a dataset into one model file",
    "animate": "play a model on a motion into a file for Blender, Unity or the web",
    "export": "write one simulated take in any format that animate knows",
    "character": "write a dressed body as VRM, whose garment the engine simulates",
    "explain": "say in five lines what was understood of a clip, a garment or a character, and draw it",
    "evaluate": "measure a model on a motion: milliseconds, millimetres, vertices inside the body",
    "view": "play models live on a local page, with other bodies, wind, dragging and colours",
    "page": "write models to a page that needs no server: one .html file, or a folder for a web host",
    "compare": "show clips side by side on a local page, collect blind answers, print statistics",
    "demo": "play the shipped models into files, a picture and a report",
    "bench": "time the shipped models and the simulator on this machine",
    "warmup": "compile all kernels now, so that nothing is compiled later",
}
DONE, FAILED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs one command.

    Args:
        arguments: The words after `hemline`; None takes them from `sys.argv`.

    Returns:
        The exit status: 0 success, 1 a figure or a take failed, 2 bad input, 130 interrupted.
    """
    words = list(sys.argv[1:] if arguments is None else arguments)
    try:
        with _one_line_warnings(), _compiling_is_said():
            return _run(words)
    except SimulationFailed as error:
        return _print_error(str(error), FAILED)
    except BadCluster as error:
        # all processes of a distributed training raise the same error: the first one prints it
        return _print_error(str(error), BAD_INPUT) if os.environ.get("RANK", "0") == "0" else BAD_INPUT
    except HemlineError as error:
        return _print_error(str(error), BAD_INPUT)
    except KeyboardInterrupt:
        return _print_error("interrupted; what was finished is kept", INTERRUPTED)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return DONE


def _run(words: list[str]) -> int:
    if not words or words[0] in ("-h", "--help", "help"):
        print(_overview())
        return DONE
    if words[0] in ("-V", "--version"):
        from hemline.version import VERSION

        print(f"hemline {VERSION}")
        return DONE
    verb, rest = words[0], words[1:]
    if verb not in VERBS:
        from difflib import get_close_matches

        near = get_close_matches(verb, VERBS, 1)
        raise BadInput("no such verb", verb, f"did you mean '{near[0]}'?" if near else f"use one of {', '.join(VERBS)}")
    module = importlib.import_module(f"hemline.cli.verbs.{verb}")
    options = _parse(options_class(verb, rest), verb, rest)
    say_beginning(verb, options)
    status = module.run(options)
    if status == DONE:
        say_end(verb, options)
    return status


def options_class(verb: str, words: Sequence[str] = ()) -> type:
    """Returns the dataclass of a verb's options.

    Args:
        verb: A key of `VERBS`.
        words: The words after the verb; those of `fit` and `generate` decide which options there are.

    Raises:
        BadInput: The words name an animator that is not installed.
    """
    module = importlib.import_module(f"hemline.cli.verbs.{verb}")
    return module.schema(words) if hasattr(module, "schema") else getattr(module, f"{verb.capitalize()}Options")


def _parse(schema: type, verb: str, words: list[str]):
    """Parses the options, and raises tyro's boxed error message as a one-line error."""
    import tyro

    errors = io.StringIO()
    try:
        with contextlib.redirect_stderr(errors):
            summary = f"{VERBS[verb][0].upper()}{VERBS[verb][1:]}."
            return tyro.cli(schema, prog=f"hemline {verb}", description=summary, args=words)
    except SystemExit as stop:
        if stop.code in (0, None):
            raise
        raise usage_error(schema, verb, words, errors.getvalue()) from None


@contextlib.contextmanager
def _one_line_warnings() -> Iterator[None]:
    """Prints warnings of hemline on stderr, each once; other warnings are handled as before."""
    with warnings.catch_warnings():
        warnings.simplefilter("default", HemlineWarning)
        default_show = warnings.showwarning

        def show(message, category, *where) -> None:
            if issubclass(category, HemlineWarning):
                print(f"hemline: warning: {message}", file=sys.stderr, flush=True)
            else:
                default_show(message, category, *where)

        warnings.showwarning = show
        yield


@contextlib.contextmanager
def _compiling_is_said() -> Iterator[None]:
    """Prints on stderr that kernels are compiled, which hemline logs."""
    log, handler = logging.getLogger("hemline.compiled"), logging.StreamHandler(sys.stderr)
    handler.setFormatter(logging.Formatter("hemline: %(message)s"))
    before = log.level
    log.addHandler(handler)
    log.setLevel(logging.INFO)
    try:
        yield
    finally:
        log.removeHandler(handler)
        log.setLevel(before)


def _overview() -> str:
    rows = "\n".join(f"  {verb:<10}{summary}" for verb, summary in VERBS.items())
    more = "'hemline VERB --help' prints the options of a verb, --version the version."
    return f"usage: hemline VERB ...\n\n{rows}\n\n{more}"


def _print_error(text: str, status: int) -> int:
    rank = os.environ.get("RANK", "0")  # set by torchrun
    print(f"hemline: {text}" if rank == "0" else f"hemline: process {rank}: {text}", file=sys.stderr)
    return status
