"""What a fit keeps beside its model until it is done."""

from contextlib import suppress
from pathlib import Path

from hemline.errors import BadInput
from hemline.files import read_metadata

KINDS = ("frames", "training")
"""Kinds of files that fits keep, see `docs/format.md`."""


def clear_checkpoints(folder: Path) -> None:
    """Remove what a fit has kept in a folder, and the folder where nothing else is left in it.

    Files of other kinds stay, as does what cannot be read.

    Args:
        folder: The folder, there or not.
    """
    for path in sorted(folder.glob("**/*.safetensors")):
        if any(_is(path, kind) for kind in KINDS):
            path.unlink(missing_ok=True)
    for each in sorted((path for path in folder.glob("**") if path.is_dir()), reverse=True):
        with suppress(OSError):
            each.rmdir()


def _is(path: Path, kind: str) -> bool:
    try:
        read_metadata(path, kind)
    except BadInput:
        return False
    return True
