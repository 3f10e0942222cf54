"""Compiled kernels on disk: one file for each function, types and processor, whole or absent.

It takes the place of numba's own cache, which keeps an index beside the code: there a file that was cut off ends every
later process, a full disk ends the process that compiled, and two processes that write at once leave an index that
points at the wrong code (numba issue 10434). Here each compiled version has a file of its own, named by all that it
depends on. A file that is damaged counts as absent and is written again; where a file cannot be written, that is said
once and the kernel runs all the same.
"""

import hashlib
import pickle
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from numba.core.compiler import CompileResult
from numba.core.serialize import dumps

from hemline.errors import BadOutput, HemlineWarning
from hemline.files.atomic import written_whole

from .folder import VARIABLE, kernel_folder, may_be_read
from .sources import source_hash

_MAGIC = b"hemline kernel 1\n"
_DIGEST = hashlib.sha256().digest_size
_unkept: set[Path] = set()


class KernelCache:
    """The compiled versions of one function, as numba's dispatcher asks for them.

    Args:
        function: The function as it was written.
        options: Options of the compiler.
    """

    def __init__(self, function: Callable[..., Any], options: Mapping[str, Any]):
        self._function = function
        self._options = sorted((name, _in_order(value)) for name, value in options.items())
        self._file = Path(function.__code__.co_filename)

    @property
    def cache_path(self) -> str | None:
        """The folder of these files, or None if nothing is kept."""
        folder = self._folder()
        return None if folder is None else str(folder)

    def load_overload(self, signature: Any, target: Any) -> CompileResult | None:
        """The compiled version for these types, or None if it is absent or damaged."""
        target.refresh()
        path, key = self._place(signature, target.codegen())
        if path is None:
            return None
        content = _read(path, key)
        if content is None:
            return None
        try:
            return CompileResult._rebuild(target, *pickle.loads(content))
        except Exception:  # whatever a file of another build makes numba raise, it can be compiled anew
            return None

    def save_overload(self, signature: Any, compiled: CompileResult) -> None:
        """Keep the compiled version for these types; where that is impossible, it is said once."""
        if compiled.lifted or compiled.library.has_dynamic_globals:
            return
        path, key = self._place(signature, compiled.codegen)
        if path is None:
            return
        content = dumps(compiled._reduce())
        try:
            path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            path.unlink(missing_ok=True)  # what is there is damaged or another user's
            with written_whole(path) as temporary:
                temporary.write_bytes(_MAGIC + hashlib.sha256(key + content).digest() + key + content)
        except (OSError, BadOutput) as reason:
            _say_unkept(path.parent.parent, reason)

    def enable(self) -> None:
        """Do nothing: the cache is always on."""

    def disable(self) -> None:
        """Do nothing: the cache is always on."""

    def flush(self) -> None:
        """Do nothing: what is kept stays valid as long as the source is the same."""

    def _folder(self) -> Path | None:
        folder = kernel_folder().path
        return None if folder is None else folder / f"{self._file.stem}-{source_hash(self._file)}"

    def _place(self, signature: Any, codegen: Any) -> tuple[Path | None, bytes]:
        """The file of a compiled version, and the key that it must carry."""
        folder = self._folder()
        code = self._function.__code__
        key = repr((code.co_qualname, code.co_firstlineno, self._options, signature, codegen.magic_tuple())).encode()
        name = f"{self._function.__name__}-{hashlib.sha256(key).hexdigest()[:24]}.kernel"
        return (None if folder is None else folder / name), hashlib.sha256(key).digest()


def _in_order(value: Any) -> str:
    """The text of an option, the same in every process."""
    return repr(sorted(value)) if isinstance(value, set) else repr(value)


def _read(path: Path, key: bytes) -> bytes | None:
    """What a file holds after its head; None if it is absent, damaged, of another key, or another user's."""
    try:
        with path.open("rb") as stream:
            if not may_be_read(stream.fileno(), kernel_folder()):
                return None
            content = stream.read()
    except OSError:
        return None
    head, rest = content[: len(_MAGIC) + _DIGEST], content[len(_MAGIC) + _DIGEST :]
    if head != _MAGIC + hashlib.sha256(rest).digest() or not rest.startswith(key):
        return None
    return rest[len(key) :]


def _say_unkept(folder: Path, reason: Exception) -> None:
    """Warn that compiled versions cannot be kept, once a process for each folder."""
    if folder in _unkept:
        return
    _unkept.add(folder)
    cure = f"make room there, or let {VARIABLE} name another folder; until then kernels are compiled in each process"
    warnings.warn(HemlineWarning(f"compiled kernels cannot be kept in {folder}", reason, cure), stacklevel=2)
