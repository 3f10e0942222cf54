"""`hemline page MODEL ... -o page.html`."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from .progress import note


@dataclass(frozen=True)
class Arguments:
    """Write a page that plays models with no server: it opens from a file or any web host, on a phone too."""

    models: Annotated[tuple[str, ...], tyro.conf.Positional]
    """Model files, or names of shipped models, of rope chains or close-fitting garments."""
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"])]
    """One file that ends in .html, or a folder for a static web host; what else lies in the folder stays."""
    motion: Annotated[tuple[str, ...], tyro.conf.arg(aliases=["-m", "--clips"])] = ("walk", "dance")
    """Clips (BVH, AMASS), or names of shipped excerpts."""
    betas: tuple[float, ...] = ()
    """Shape of the body. Close-fitting garments have sliders for others on the page."""
    title: str | None = None
    """Of the page; left out: the names of the models."""
    most_mb: float | None = None
    """Refuse to write more than this [MB]."""
    json: bool = False
    """Print one JSON object: files, bytes."""


def run(arguments: Arguments) -> int:
    """Gather what the page plays, write it, say what it holds."""
    from hemline import animators, motions, web
    from hemline.errors import BadInput

    from .model import body_of

    web.check_page(arguments.output)
    if not arguments.models:
        raise BadInput("page needs MODEL", "none", f"shipped: {', '.join(animators.shipped_models())}")
    models = {Path(name).stem: animators.load(name) for name in arguments.models}
    clips = {Path(name).stem: motions.open_motion(name) for name in arguments.motion}
    body = body_of(next(iter(models.values())), None, arguments.betas)
    contents = web.page_contents(models, clips, body)
    title = arguments.title or ", ".join(models)
    paths = web.write_page(arguments.output, contents, title=title, most_mb=arguments.most_mb)
    size = sum(path.stat().st_size for path in paths)
    if arguments.json:
        print(json.dumps({"files": [str(path) for path in paths], "bytes": size}))
        return 0
    note(f"models: {len(models)}, clips: {len(clips)}, {size / 1e6:.1f} MB")
    page = arguments.output if len(paths) == 1 else arguments.output / "index.html"
    print(page)
    return 0
