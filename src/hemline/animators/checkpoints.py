"""The folder in which a fit keeps its checkpoints until it is done."""

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from hemline.errors import BadInput, BadOutput
from hemline.files import read_metadata

CHECKPOINT_KINDS = ("frames", "training")
"""Kinds of checkpoint files, see `docs/format.md`."""


@contextmanager
def checkpoint_folder(wanted: Path | None) -> Iterator[Path]:
    """Opens a folder whose checkpoints remain if the work is interrupted and are deleted when it is done.

    Files that are no checkpoints remain, and the folder with them. Mapped arrays (`.npy`), which may be gigabytes and
    are made anew each time, are deleted in any case.

    Args:
        wanted: The folder, which is made if it is missing; None uses a temporary one.

    Raises:
        BadOutput: The folder cannot be made.
    """
    if wanted is None:
        with tempfile.TemporaryDirectory(prefix="hemline-fit-") as folder:
            yield Path(folder)
        return
    try:
        wanted.mkdir(parents=True, exist_ok=True)
    except OSError as reason:
        cure = "name a model in a folder that can be written"
        raise BadOutput(f"cannot make {wanted}", reason.strerror or reason, cure) from reason
    done = False
    try:
        yield wanted
        done = True
    finally:
        checkpoints = [each for each in wanted.glob("**/*.safetensors") if _is_checkpoint(each)] if done else []
        damaged = [*wanted.glob("**/*.safetensors.damaged*")] if done else []
        for file in (*wanted.glob("*.npy"), *checkpoints, *damaged):
            with suppress(OSError):
                file.unlink()
        for folder in sorted((each for each in wanted.glob("**") if each.is_dir()), reverse=True):
            with suppress(OSError):
                folder.rmdir()


def _is_checkpoint(path: Path) -> bool:
    for kind in CHECKPOINT_KINDS:
        with suppress(BadInput):
            read_metadata(path, kind)
            return True
    return False
