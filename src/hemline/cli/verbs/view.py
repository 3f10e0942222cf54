"""`hemline view [MODEL or DATASET ...] [-m CLIP ...]`."""

import threading
import webbrowser
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from hemline.cli.clip import Up
from hemline.cli.progress import note

if TYPE_CHECKING:
    from hemline.animators import Animator
    from hemline.view import Catalog


@dataclass(frozen=True)
class ViewOptions:
    """Options of `hemline view`."""

    models: Annotated[tuple[str, ...], tyro.conf.Positional] = ()
    """Models to choose from: files, names of shipped models, or dataset folders. Defaults to all shipped models."""
    motion: Annotated[tuple[str, ...], tyro.conf.arg(aliases=["-m"])] = ()
    """Clips to choose from: BVH, FBX, GLB or SMPL .npz files, or names of excerpts. Defaults to all excerpts."""
    up: Up | None = None
    """Axis that is up in the files of clips, such as z, or -y as in a camera's coordinates (--up=-y).
    By default it is found from the body: up is where the head is."""
    garment: str | None = None
    """Garment to dress, by name or file, for models that play any garment. Defaults to a choice of cape and skirt."""
    over: tuple[str, ...] = ()
    """Layers over the garment of each model, from the inside out.
    They are garments for a model that plays any garment, otherwise models with garments of their own.
    By default there are none."""
    body: str | None = None
    """Body, by name or file, for models that play any garment. Defaults to anny24."""
    betas: tuple[float, ...] = ()
    """Shape coefficients of the body, about -3 to 3 each. Missing coefficients are 0, which is the mean shape.
    The page can change them."""
    port: int = 8080
    """Port of the page on this machine. With 0 a free port is chosen."""
    browser: bool = True
    """Open the page in the browser."""


def run(options: ViewOptions) -> int:
    """Serves the page until Ctrl-C."""
    from dataclasses import replace

    from hemline.view import Page

    catalog = open_catalog(options)
    choice = replace(catalog.first(), betas=options.betas)
    with Page(catalog, choice, port=options.port, report=lambda line: note(f"hemline: {line}")) as page:
        try:
            note("Ctrl-C ends it")
            print(page.url, flush=True)
            if options.browser:
                address = page.door.one_time_address()
                # in a thread, as some browsers block until they are closed
                threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()
            page.serve_forever()
        except KeyboardInterrupt:
            note("ended")
    return 0


def open_catalog(options: ViewOptions) -> "Catalog":
    """Returns the models and clips that the page offers: the given ones, or those that ship with hemline."""
    from hemline import animators, datasets, motions
    from hemline.view import Catalog

    folders = [word for word in options.models if Path(word).is_dir()]
    named = [word for word in options.models if word not in folders]
    models: dict[str, Callable[[], Animator]] = {}
    for word in named or ([] if folders else animators.shipped_models()):
        model = animators.load(word)
        if isinstance(model, animators.Wearable):
            for garment in (options.garment,) if options.garment else ("cape", "skirt"):
                models[f"{word}: {garment}"] = partial(_open_dressed, word, garment, options)
        elif options.over:
            models[word] = partial(_open_dressed, word, None, options)
        else:
            models[word] = partial(animators.load, word)
    clips = {word: partial(motions.open_motion, word, up=options.up) for word in options.motion or motions.names()}
    for word in options.motion:
        clips[word]()
    return Catalog(models, clips, tuple(datasets.open_dataset(folder) for folder in folders))


def _open_dressed(word: str, garment: str | None, options: ViewOptions) -> "Animator":
    from hemline.cli.model import open_model

    return open_model(word, garment, options.body, options.betas, over=options.over)[0]
