"""The one door to numba: `kernel` compiles, and caches on disk where that is safe.

Numba's cache does not notice that a function in *another* module changed, and it raises at import when neither the
package's folder nor the user's cache can be written. So the cache folder of each kernel file is chosen here: its name
carries a hash of that file and of all kernel files that it imports, and where nothing can be written a temporary
folder serves. Kernels live in files named `*kernels.py`, whose stems differ, and import `kernel` from here; nothing
else imports numba.
"""

import functools
import hashlib
import os
import re
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
import numba.core.config
import numba.extending
from numba import types
from numba.core import cgutils

_PACKAGE = Path(__file__).parent
_config: Any = numba.core.config
_IMPORT = re.compile(r"^\s*(?:from|import)\s[^#\n]*", re.MULTILINE)
_KERNEL_MODULE = re.compile(r"\w*kernels\b")


@functools.cache
def kernel_files() -> dict[str, Path]:
    """All files of the package that hold compiled code, by stem."""
    return {file.stem: file for file in sorted(_PACKAGE.rglob("*kernels.py"))}


@functools.cache
def cache_folder() -> Path:
    """Where compiled kernels are kept: HEMLINE_CACHE_DIR, else the user's cache, else a temporary folder."""
    asked = os.environ.get("HEMLINE_CACHE_DIR")
    user = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "hemline"
    folder = Path(asked) if asked else user
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except OSError:
        return Path(tempfile.gettempdir()) / f"hemline-{os.getuid() if hasattr(os, 'getuid') else 0}"


@functools.cache
def source_hash(file: Path) -> str:
    """Hash of a kernel file and of all kernel files that it imports, directly or not."""
    found, queue = {file}, [file]
    while queue:
        imports = " ".join(_IMPORT.findall(queue.pop().read_text()))
        named = {kernel_files()[stem] for stem in _KERNEL_MODULE.findall(imports) if stem in kernel_files()}
        queue += sorted(named - found)
        found |= named
    digest = hashlib.sha256(f"{sys.version_info[:3]} {numba.__version__}".encode())
    for each in sorted(found):
        digest.update(each.read_bytes())
    return digest.hexdigest()[:16]


def kernel(function: Callable[..., Any] | None = None, **options: Any) -> Any:
    """Decorator: compile a function over plain arrays with numba, cached on disk.

    Division by zero gives inf or nan as NumPy does. Pass `parallel=True`, `fastmath=True`, `inline="always"` and the
    like as options. The function must be free of objects: arrays and scalars in, then out.
    """
    if function is None:
        return functools.partial(kernel, **options)
    file = Path(function.__code__.co_filename)
    _config.CACHE_DIR = str(cache_folder() / f"{file.stem}-{source_hash(file)}")
    return numba.njit(**({"cache": True, "error_model": "numpy", "nogil": True} | options))(function)


intrinsic: Any = numba.extending.intrinsic


def threads() -> int:
    """Threads that kernels may use now."""
    return numba.get_num_threads()


def use_threads(count: int | None) -> None:
    """Let kernels use so many threads, at most as many as there are; None: all."""
    most = _config.NUMBA_NUM_THREADS
    numba.set_num_threads(most if count is None else min(count, most))


prange = numba.prange

__all__ = [
    "cache_folder",
    "cgutils",
    "intrinsic",
    "kernel",
    "kernel_files",
    "prange",
    "source_hash",
    "threads",
    "types",
    "use_threads",
]
