"""Compiled kernels on disk: one file for each function, types and processor, complete or absent.

Kernels of a `pack` come first; what it lacks is compiled here and kept.

It replaces numba's own cache, which keeps an index beside the code. With that cache a truncated file crashes every
later process, a full disk crashes the process that compiles, and two processes that write at once leave an index that
points at the wrong code (numba issue 10434). Here each compiled version has its own file, named by everything it
depends on. A damaged file counts as absent and is written again. If a file cannot be written, a warning is shown once,
and the kernel runs all the same.
"""

import hashlib
import logging
import pickle
import warnings
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

from numba.core.compiler import CompileResult
from numba.core.serialize import dumps

from hemline.errors import BadOutput, HemlineWarning
from hemline.files.atomic import atomic_write

from .folder import VARIABLE, kernel_folder, may_be_read
from .pack import shipped_pack
from .sources import source_hash

_MAGIC = b"hemline kernel 1\n"
_DIGEST = hashlib.sha256().digest_size
_log = logging.getLogger("hemline.compiled")
_warned_folders: set[Path] = set()


class KernelCache:
    """The compiled versions of one function, as numba's dispatcher asks for them.

    Args:
        function: The Python function.
        options: Options of the compiler.
    """

    def __init__(self, function: Callable[..., Any], options: Mapping[str, Any]):
        self._function = function
        self._options = sorted((name, _in_order(value)) for name, value in options.items())
        self._file = Path(function.__code__.co_filename)

    @property
    def cache_path(self) -> str | None:
        """The folder of these files, or None if nothing is cached."""
        folder = kernel_folder().path
        return None if folder is None else str(folder / self._folder_name)

    def load_overload(self, signature: Any, target: Any) -> CompileResult | None:
        """Returns the compiled version for these types, or None if it is absent or damaged."""
        target.refresh()
        content = self._read(signature, target.codegen().magic_tuple())
        if content is None:
            _say_that_it_compiles()
            return None
        try:
            return CompileResult._rebuild(target, *pickle.loads(content))
        except Exception:  # a file of another build may raise anything in numba; the function is compiled again
            return None

    def _read(self, signature: Any, processor: tuple[str, ...]) -> bytes | None:
        """Returns the compiled version for these types and this processor, from the pack or else from the folder."""
        name, key = self._name(signature, processor)
        pack = shipped_pack()
        if pack is not None and pack.target == processor:
            content = _checked(pack.read(name) or b"", key)
            if content is not None:
                return content
        folder = kernel_folder().path
        return None if folder is None else _read(folder / name, key)

    def save_overload(self, signature: Any, compiled: CompileResult) -> None:
        """Writes the compiled version for these types; warns once if that is impossible."""
        if compiled.lifted or compiled.library.has_dynamic_globals:
            return
        name, key = self._name(signature, compiled.codegen.magic_tuple())
        folder = kernel_folder().path
        if folder is None:
            return
        path = folder / name
        content = dumps(compiled._reduce())
        try:
            path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            path.unlink(missing_ok=True)  # an existing file is damaged or belongs to another user
            with atomic_write(path) as temporary:
                temporary.write_bytes(_MAGIC + hashlib.sha256(key + content).digest() + key + content)
        except (OSError, BadOutput) as reason:
            _warn_unwritable(path.parent.parent, reason)

    def enable(self) -> None:
        """Do nothing: the cache is always on."""

    def disable(self) -> None:
        """Do nothing: the cache is always on."""

    def flush(self) -> None:
        """Do nothing: cached files stay valid as long as the source is the same."""

    def _name(self, signature: Any, processor: tuple[str, ...]) -> tuple[str, bytes]:
        """Returns the name of the file of a compiled version in the cache, and the key that it must contain."""
        code = self._function.__code__
        key = repr((code.co_qualname, code.co_firstlineno, self._options, signature, processor)).encode()
        name = f"{self._function.__name__}-{hashlib.sha256(key).hexdigest()[:24]}.kernel"
        return f"{self._folder_name}/{name}", hashlib.sha256(key).digest()

    @property
    def _folder_name(self) -> str:
        return f"{self._file.stem}-{source_hash(self._file)}"


@cache
def _say_that_it_compiles() -> None:
    """Logs, once in a process, that kernels are compiled because no pack fits."""
    if shipped_pack() is None:
        _log.info("compiling for this processor; this happens once, and takes about a minute for playback")


def _in_order(value: Any) -> str:
    """Returns the text of an option, which is the same in every process."""
    return repr(sorted(value)) if isinstance(value, set) else repr(value)


def _read(path: Path, key: bytes) -> bytes | None:
    """Returns the content of a file after its head; None if it is absent, damaged, or of another key or user."""
    try:
        with path.open("rb") as stream:
            if not may_be_read(stream.fileno(), kernel_folder()):
                return None
            content = stream.read()
    except OSError:
        return None
    return _checked(content, key)


def _checked(content: bytes, key: bytes) -> bytes | None:
    """Returns the content of a file after its head; None if it is damaged or of another key."""
    head, rest = content[: len(_MAGIC) + _DIGEST], content[len(_MAGIC) + _DIGEST :]
    if head != _MAGIC + hashlib.sha256(rest).digest() or not rest.startswith(key):
        return None
    return rest[len(key) :]


def _warn_unwritable(folder: Path, reason: Exception) -> None:
    """Warns that compiled versions cannot be kept, once in a process for each folder."""
    if folder in _warned_folders:
        return
    _warned_folders.add(folder)
    cure = f"make room there, or let {VARIABLE} name another folder; until then kernels are compiled in each process"
    warnings.warn(HemlineWarning(f"compiled kernels cannot be kept in {folder}", reason, cure), stacklevel=2)
