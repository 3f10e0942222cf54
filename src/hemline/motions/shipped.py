"""Short clips that ship with the package."""

import difflib
import functools
from pathlib import Path

from hemline.errors import BadMotion

from .motion import Motion
from .store import read_many

SHIPPED = Path(__file__).parents[1] / "models" / "excerpts.safetensors"
"""File of the clips, made by `python -m hemline.models.make.excerpts FOLDER`; `excerpts.NOTICE.md` has their terms."""


@functools.cache
def _excerpts() -> dict[str, Motion]:
    return read_many(SHIPPED)


def names() -> tuple[str, ...]:
    """Returns the names of the shipped clips."""
    return tuple(_excerpts())


def load(name: str) -> Motion:
    """Returns a shipped clip.

    Raises:
        BadMotion: No clip has that name.
    """
    if name not in names():
        near = difflib.get_close_matches(name, names(), n=1, cutoff=0.0)[0]
        cure = f"the nearest name is '{near}'; or name a .bvh, .npz or .safetensors file"
        raise BadMotion("no motion of that name ships", f"'{name}'", cure)
    return _excerpts()[name]
