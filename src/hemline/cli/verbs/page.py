"""`hemline page MODEL ... -o page.html`."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from hemline.cli.clip import Up
from hemline.cli.progress import note


@dataclass(frozen=True)
class PageOptions:
    """Options of `hemline page`."""

    models: Annotated[tuple[str, ...], tyro.conf.Positional]
    """Models to show: files, or names of shipped models, of rope chains or close-fitting garments."""
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"])]
    """File to write (.html), or a folder for a static web host. Other files in the folder are kept."""
    motion: Annotated[tuple[str, ...], tyro.conf.arg(aliases=["-m", "--clips"])] = ("walk", "dance")
    """Clips to play: BVH, FBX, GLB or SMPL .npz files, or names of shipped excerpts."""
    up: Up | None = None
    """Axis that is up in the files of clips, such as z, or -y as in a camera's coordinates (--up=-y).
    By default it is found from the body: up is where the head is."""
    betas: tuple[float, ...] = ()
    """Shape coefficients of the body, about -3 to 3 each. Missing coefficients are 0, which is the mean shape.
    Models of close-fitting garments have sliders for other shapes on the page."""
    title: str | None = None
    """Title of the page. Defaults to the names of the models."""
    most_mb: float | None = None
    """Maximum size of the page, above which nothing is written [MB]. By default there is no limit."""
    json: bool = False
    """Print one JSON object with the files and their size [bytes]."""


def run(options: PageOptions) -> int:
    """Collects models and clips, writes the page, and reports its contents."""
    from hemline import animators, motions, web
    from hemline.cli.model import body_of
    from hemline.errors import BadInput

    web.check_page(options.output)
    if not options.models:
        raise BadInput("page needs MODEL", "none", f"shipped: {', '.join(animators.shipped_models())}")
    models = {Path(name).stem: animators.load(name) for name in options.models}
    clips = {Path(name).stem: motions.open_motion(name, up=options.up) for name in options.motion}
    body = body_of(next(iter(models.values())), None, options.betas)
    contents = web.page_contents(models, clips, body)
    title = options.title or ", ".join(models)
    paths = web.write_page(options.output, contents, title=title, most_mb=options.most_mb)
    size = sum(path.stat().st_size for path in paths)
    if options.json:
        print(json.dumps({"files": [str(path) for path in paths], "bytes": size}))
        return 0
    note(f"models: {len(models)}, clips: {len(clips)}, {size / 1e6:.1f} MB")
    page = options.output if len(paths) == 1 else options.output / "index.html"
    print(page)
    return 0
