"""Puts damaged takes aside: they are renamed and not deleted, since their bytes may matter to somebody."""

import itertools
import warnings
from pathlib import Path

from hemline.errors import BadDataset, BadInput, BadOutput, HemlineWarning


def put_aside(file: Path, reason: BadInput) -> Path:
    """Renames a damaged file to `NAME.damaged`, or `NAME.damaged2` and so on, with a warning.

    Args:
        file: The file.
        reason: The error that describes the damage.

    Returns:
        The new path.

    Raises:
        BadOutput: The file cannot be renamed.
    """
    names = itertools.chain([".damaged"], (f".damaged{number}" for number in itertools.count(2)))
    free = next(path for path in (file.with_name(file.name + name) for name in names) if not path.exists())
    try:
        file.rename(free)
    except FileNotFoundError:
        return free  # another process renamed it
    except OSError as error:
        cure = f"rename or delete {file}, and it is made again"
        raise BadOutput(f"cannot put the damaged {file} aside", error.strerror or error, cure) from error
    cure = f"it is kept as {free.name} and made again"
    warnings.warn(HemlineWarning(reason.what, reason.got, cure), stacklevel=2)
    return free


def unreadable(file: Path, reason: OSError) -> BadDataset:
    """Returns the error for a take that could not be read, with the reason of the operating system."""
    cure = "make it readable, or move it out of the dataset"
    return BadDataset(f"cannot read {file}", reason.strerror or reason, cure)
