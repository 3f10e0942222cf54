"""Choose the verb, turn errors into one line and an exit status."""

import contextlib
import importlib
import io
import os
import sys
import warnings
from collections.abc import Iterator, Sequence

from hemline.errors import BadCluster, BadInput, HemlineError, HemlineWarning, SimulationFailed

from .misread import misread

VERBS = {
    "body": "a rigged character (GLB, VRM) that is not ours as a body for garments",
    "generate": "a top, dress, skirt, trousers or jumpsuit from its measures",
    "tryon": "a garment made on another body onto this one, or why it cannot be worn",
    "simulate": "a garment against clips, into a dataset of takes",
    "drape": "a garment at rest on bodies of many shapes, into a dataset",
    "fit": "an animator to a dataset, into one model file",
    "animate": "a model on a motion, into a file for Blender, Unity, the web",
    "export": "one simulated take, into any format that animate knows",
    "character": "a body in a garment as VRM: an engine swings the garment by itself",
    "evaluate": "a model on a motion: milliseconds, millimetres, vertices inside",
    "view": "a model live on a local page: scrub, other bodies, wind, drag, colours",
    "page": "models on a page that needs no server: one .html, or a folder for a web host",
    "compare": "clips side by side on a local page, blind; what people answer, and its statistics",
    "demo": "the shipped cape on a shipped run: a file, a picture, figures",
    "bench": "time the shipped models and the simulator on this machine",
    "warmup": "compile all kernels now, so that nothing compiles later",
}
DONE, FELL_SHORT, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command.

    Args:
        arguments: The words after `hemline`; None: those of this process.

    Returns:
        The exit status: 0 done, 1 a figure or a take fell short, 2 bad input, 130 interrupted.
    """
    words = list(sys.argv[1:] if arguments is None else arguments)
    try:
        with _warnings_in_a_line():
            return _run(words)
    except SimulationFailed as error:
        return _say(str(error), FELL_SHORT)
    except BadCluster as error:
        # of the processes of a training, all say the same
        return _say(str(error), BAD_INPUT) if os.environ.get("RANK", "0") == "0" else BAD_INPUT
    except HemlineError as error:
        return _say(str(error), BAD_INPUT)
    except KeyboardInterrupt:
        return _say("interrupted; what was finished is kept", INTERRUPTED)
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
    module = importlib.import_module(f"hemline.cli.{verb}")
    schema = module.schema(rest) if hasattr(module, "schema") else module.Arguments
    return module.run(_parsed(schema, verb, rest))


def _parsed(schema: type, verb: str, words: list[str]):
    """Parse the flags; what tyro draws as a box becomes one line."""
    import tyro

    errors = io.StringIO()
    try:
        with contextlib.redirect_stderr(errors):
            return tyro.cli(schema, prog=f"hemline {verb}", description=VERBS[verb], args=words)
    except SystemExit as stop:
        if stop.code in (0, None):
            raise
        raise misread(schema, verb, words, errors.getvalue()) from None


@contextlib.contextmanager
def _warnings_in_a_line() -> Iterator[None]:
    """Our own warnings are said on stderr, each once; those of others go where they went."""
    with warnings.catch_warnings():
        warnings.simplefilter("default", HemlineWarning)
        others = warnings.showwarning

        def show(message, category, *where) -> None:
            if issubclass(category, HemlineWarning):
                print(f"hemline: warning: {message}", file=sys.stderr, flush=True)
            else:
                others(message, category, *where)

        warnings.showwarning = show
        yield


def _overview() -> str:
    rows = "\n".join(f"  {verb:<10}{what}" for verb, what in VERBS.items())
    more = "'hemline VERB --help' tells the flags of a verb; --version tells the version."
    return f"usage: hemline VERB ...\n\n{rows}\n\n{more}"


def _say(text: str, status: int) -> int:
    rank = os.environ.get("RANK", "0")  # set by torchrun
    print(f"hemline: {text}" if rank == "0" else f"hemline: process {rank}: {text}", file=sys.stderr)
    return status
