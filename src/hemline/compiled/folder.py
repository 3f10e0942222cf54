"""The folder in which compiled kernels are kept, and who may write there.

Files in this folder run with the rights of the user who starts hemline. Therefore a folder that hemline selects itself
belongs to that user, and nobody else can write to it. A folder that the user names is used as it is, with a warning if
others can write to it.
"""

import atexit
import os
import shutil
import stat
import tempfile
import warnings
from functools import cache
from pathlib import Path
from typing import NamedTuple

from hemline.errors import HemlineWarning

VARIABLE = "HEMLINE_CACHE_DIR"
"""The environment variable that names another folder."""
_OTHERS_MAY_WRITE = stat.S_IWGRP | stat.S_IWOTH
_ROOT = 0


class KernelFolder(NamedTuple):
    """A folder of compiled kernels."""

    path: Path | None
    """The folder, or None if none can be written; then kernels are compiled in each process."""
    shared: bool
    """Whether files of other users are read as well, because the user named the folder."""


def cache_folder() -> Path | None:
    """Returns the folder in which compiled kernels are kept, or None if none can be written.

    It is the folder that HEMLINE_CACHE_DIR names, else `hemline` in the user's cache, else a folder among the temporary
    files that only this user can write.
    """
    return kernel_folder().path


@cache
def kernel_folder() -> KernelFolder:
    """Returns the folder of `cache_folder`, and whether it is shared with others; determined once in a process."""
    if named := os.environ.get(VARIABLE):
        folder = _folder_from_variable(Path(named))
        if folder is not None:
            return KernelFolder(folder, shared=True)
    for folder in _candidates():
        if _is_private(folder):
            return KernelFolder(folder, shared=False)
    return KernelFolder(_temporary(), shared=False)


def may_be_read(file: int, folder: KernelFolder) -> bool:
    """Tells whether an open file (a descriptor) may be run; in a private folder, this user or root must own it."""
    return folder.shared or not hasattr(os, "geteuid") or os.fstat(file).st_uid in (os.geteuid(), _ROOT)


def _folder_from_variable(folder: Path) -> Path | None:
    """Returns the folder that the user named, created if missing; None with a warning if that is impossible."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        found = folder.stat()
    except OSError as reason:
        cure = f"name a folder that exists or can be made; until then {VARIABLE} is ignored"
        warnings.warn(HemlineWarning(f"{VARIABLE} cannot be used", f"{folder}: {reason.strerror}", cure), stacklevel=2)
        return None
    if hasattr(os, "geteuid"):
        writers = []
        if found.st_uid not in (os.geteuid(), _ROOT):
            writers.append(f"user {found.st_uid}, who owns it")
        if found.st_mode & stat.S_IWGRP:
            writers.append("its group")
        if found.st_mode & stat.S_IWOTH:
            writers.append("every user")
        if writers:
            what = f"others can write to {folder}, and whoever writes there runs code as you"
            cure = f"take the right to write from them, or let {VARIABLE} name a folder of your own"
            warnings.warn(HemlineWarning(what, f"writable by {' and '.join(writers)}", cure), stacklevel=2)
    return folder


def _candidates() -> list[Path]:
    """Returns the folders to try in turn if the user named none."""
    found = []
    try:
        user = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
        found.append((user / "hemline").resolve())
    except (OSError, RuntimeError):  # no home, or links in a circle
        pass
    if hasattr(os, "geteuid"):
        found.append(Path(tempfile.gettempdir()) / f"hemline-{os.geteuid()}")
    return found


def _is_private(folder: Path) -> bool:
    """Creates a folder if it is missing; tells whether it is this user's own, no link, and writable by nobody else."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        found = folder.lstat()
        if not stat.S_ISDIR(found.st_mode):
            return False
        if hasattr(os, "geteuid"):
            if found.st_uid != os.geteuid():
                return False
            if found.st_mode & _OTHERS_MAY_WRITE:
                folder.chmod(0o700)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def _temporary() -> Path | None:
    """Creates a folder for this process alone, removed at its end; None if there is no room even for that."""
    cure = f"let {VARIABLE} name a folder of your own that can be written"
    try:
        folder = Path(tempfile.mkdtemp(prefix="hemline-"))
    except OSError as reason:
        warnings.warn(HemlineWarning("compiled kernels cannot be kept", reason.strerror or reason, cure), stacklevel=2)
        return None
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    what = "compiled kernels are kept until this process ends"
    warnings.warn(HemlineWarning(what, "no folder that this user alone can write", cure), stacklevel=2)
    return folder
