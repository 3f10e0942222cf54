"""`hemline view [MODEL or DATASET ...] [-m CLIP ...]`."""

import threading
import webbrowser
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from .progress import note

if TYPE_CHECKING:
    from hemline.animators import Animator
    from hemline.view import Shelf


@dataclass(frozen=True)
class Arguments:
    """Play garments live on a local page: scrub, other bodies, wind, drag the body, colours, downloads."""

    models: Annotated[tuple[str, ...], tyro.conf.Positional] = ()
    """Model files, names of shipped models, folders of takes; left out: all shipped models."""
    motion: Annotated[tuple[str, ...], tyro.conf.arg(aliases=["-m"])] = ()
    """Clips (BVH, AMASS), or names of shipped excerpts; left out: all excerpts."""
    garment: str | None = None
    """The garment to wear, by name or a file, for a model that takes any; left out: cape and skirt."""
    over: tuple[str, ...] = ()
    """What each model wears over its garment: garments, for a model that takes any; else models."""
    body: str | None = None
    """The body, by name or a file, for a model that takes any garment; left out: anny24."""
    betas: tuple[float, ...] = ()
    """Shape of the body at the start."""
    port: int = 8080
    """Where the page listens on this machine; 0: a port that is free."""
    browser: bool = True
    """Open the page in the browser."""


def run(arguments: Arguments) -> int:
    """Serve the page until Ctrl-C."""
    from dataclasses import replace

    from hemline.view import Page

    shelf = shelf_of(arguments)
    choice = replace(shelf.first(), betas=arguments.betas)
    with Page(shelf, choice, port=arguments.port, report=lambda line: note(f"hemline: {line}")) as page:
        try:
            note("Ctrl-C ends it")
            print(page.url, flush=True)
            if arguments.browser:
                address = page.door.address_for_once()
                threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()  # some wait for its end
            page.serve_forever()
        except KeyboardInterrupt:
            note("ended")
    return 0


def shelf_of(arguments: Arguments) -> "Shelf":
    """What is named, or else what ships, for the page to choose from."""
    from hemline import animators, datasets, motions
    from hemline.view import Shelf

    folders = [word for word in arguments.models if Path(word).is_dir()]
    named = [word for word in arguments.models if word not in folders]
    models: dict[str, Callable[[], Animator]] = {}
    for word in named or ([] if folders else animators.shipped_models()):
        model = animators.load(word)
        if isinstance(model, animators.Wearable):
            for garment in (arguments.garment,) if arguments.garment else ("cape", "skirt"):
                models[f"{word}: {garment}"] = partial(_worn, word, garment, arguments)
        else:
            models[word] = partial(_worn, word, None, arguments) if arguments.over else partial(animators.load, word)
    clips = {word: partial(motions.open_motion, word) for word in arguments.motion or motions.names()}
    for word in arguments.motion:
        clips[word]()
    return Shelf(models, clips, tuple(datasets.open_dataset(folder) for folder in folders))


def _worn(word: str, garment: str | None, arguments: Arguments) -> "Animator":
    from .model import open_model

    return open_model(word, garment, arguments.body, arguments.betas, over=arguments.over)[0]
