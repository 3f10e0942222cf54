"""The folder in which a fit keeps what it would lose by a kill, until it is done."""

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from hemline.errors import BadInput, BadOutput
from hemline.files import read_metadata

CHECKPOINT_KINDS = ("frames", "training")
"""Kinds of files that fits keep, see `docs/format.md`."""


@contextmanager
def checkpoint_folder(wanted: Path | None) -> Iterator[Path]:
    """A folder whose checkpoints stay if the work is broken off, and go when it is done.

    Files that no fit keeps stay, and with them the folder. Mapped arrays (`.npy`), which may be gigabytes and are made
    anew each time, go in any case.

    Args:
        wanted: The folder, made where it is missing; None: one among the temporary files.

    Raises:
        BadOutput: It cannot be made.
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
        kept = [each for each in wanted.glob("**/*.safetensors") if _is_kept(each)] if done else []
        damaged = [*wanted.glob("**/*.safetensors.damaged*")] if done else []
        for file in (*wanted.glob("*.npy"), *kept, *damaged):
            with suppress(OSError):
                file.unlink()
        for folder in sorted((each for each in wanted.glob("**") if each.is_dir()), reverse=True):
            with suppress(OSError):
                folder.rmdir()


def _is_kept(path: Path) -> bool:
    for kind in CHECKPOINT_KINDS:
        with suppress(BadInput):
            read_metadata(path, kind)
            return True
    return False
