"""Packs of kernels that were compiled in advance, from the package `hemline-kernels`.

A pack holds the files of `cache` for one version of Python and numba on one platform. Its kernels run on every
processor that has the instructions of `TARGET`. A kernel whose source, or whose numba, differs from that of the pack is
compiled as if there were no pack, and so are all kernels on another processor.

Where `TARGET` runs, kernels that are compiled here are compiled for it, too (`aim_numba`). So a garment plays to the
same bits with a pack and without one, and on old and new processors: kernels that may reorder sums give others for
vectors of another length.

Like compiled kernels on disk, packs are run as they are: a pack has the same trust as the code beside it.
"""

import hashlib
import json
import lzma
import mmap
import os
import platform
import sys
from collections.abc import Mapping
from contextlib import suppress
from functools import cache, cached_property
from importlib.util import find_spec
from itertools import accumulate
from pathlib import Path
from typing import Any, NamedTuple

import llvmlite
import numba
import numba.core.config
from llvmlite import binding

from hemline.errors import BadOutput
from hemline.files.atomic import atomic_write

from .folder import KernelFolder, kernel_folder, may_be_read

_config: Any = numba.core.config
PACKAGE = "hemline_kernels"
"""Name of the package that holds the packs."""
VARIABLE = "HEMLINE_KERNEL_PACK"
"""The environment variable that names another pack, or is "none" to use no pack."""
_MAGIC = b"hemline kernel pack 1\n"
_LARGEST_HEADER = 1 << 20


class Target(NamedTuple):
    """What kernels are compiled for, in the order in which numba names it."""

    triple: str
    processor: str
    features: str

    def runs_here(self) -> bool:
        """Tells whether this machine can run kernels for the target."""
        # the triple of macOS ends in a version
        if not binding.get_process_triple().startswith(self.triple):
            return False
        here = binding.get_host_cpu_features()
        return all(here.get(name[1:], False) for name in self.features.split(",") if name not in ("", "+64bit"))


_X86_64_V3 = (
    "+64bit,+avx,+avx2,+bmi,+bmi2,+cmov,+crc32,+cx16,+cx8,+f16c,+fma,+fxsr,+lzcnt,+mmx,+movbe,+popcnt,+sahf,+sse,"
    "+sse2,+sse3,+sse4.1,+sse4.2,+ssse3,+xsave"
)
"""Instructions of x86-64 processors since about 2015 (level 3 of the x86-64 psABI)."""
_TARGETS = {
    ("linux", "x86_64"): Target("x86_64-unknown-linux-gnu", "x86-64-v3", _X86_64_V3),
    ("win32", "amd64"): Target("x86_64-pc-windows-msvc", "x86-64-v3", _X86_64_V3),
    ("darwin", "arm64"): Target("arm64-apple-darwin", "apple-m1", ""),
}
"""What packs are made for, by system and machine; every Apple silicon runs what is compiled for the first of them."""
TARGET = _TARGETS.get((sys.platform, platform.machine().lower()), _TARGETS["linux", "x86_64"])
"""The target of this system; on a system without one, that of Linux, which does not run there."""


def aim_numba() -> None:
    """Has numba compile for `TARGET` in this process, where the machine runs it.

    It does nothing if NUMBA_CPU_NAME or NUMBA_CPU_FEATURES is set. If numba has compiled something before, its target
    stays, and packs are not used.
    """
    if _config.CPU_NAME is None and _config.CPU_FEATURES is None and TARGET.runs_here():
        _config.CPU_NAME, _config.CPU_FEATURES = TARGET.processor, TARGET.features


class Pack:
    """The kernels of a pack file.

    Args:
        path: The file.
        header: Its header, see `write_pack`.
        start: Place in the file at which the compressed kernels begin.
    """

    def __init__(self, path: Path, header: Mapping[str, Any], start: int):
        self.path, self._header, self._start = path, header, start
        self.target = Target(*header["target"])

    def read(self, name: str) -> bytes | None:
        """Returns the file of a compiled kernel by its name in the cache; None if the pack has none or is damaged."""
        place = self._places.get(name)
        return None if place is None else bytes(self._content[place])

    @cached_property
    def _places(self) -> dict[str, slice]:
        ends = list(accumulate((size for _, size in self._header["files"]), initial=0))
        return {name: slice(*ends[index : index + 2]) for index, (name, _) in enumerate(self._header["files"])}

    @cached_property
    def _content(self) -> "mmap.mmap | bytes":
        """All files one after another.

        They are unpacked when the first one is needed, and kept in the cache folder for the next process if possible.
        """
        folder = kernel_folder()
        kept = None if folder.path is None else folder.path / f"{self._header['sha256']}.kernels"
        if kept is not None:
            content = _mapped(kept, folder)
            if content is not None:
                return content
        content = self._unpack()
        if kept is not None and content:
            with suppress(OSError, BadOutput), atomic_write(kept) as temporary:
                temporary.write_bytes(content)
        return content

    def _unpack(self) -> bytes:
        """Returns the decompressed files; nothing if the pack is damaged."""
        try:
            with self.path.open("rb") as stream:
                stream.seek(self._start)
                content = lzma.decompress(stream.read())
        except (OSError, lzma.LZMAError):
            return b""
        return content if hashlib.sha256(content).hexdigest() == self._header["sha256"] else b""


def _mapped(file: Path, folder: KernelFolder) -> mmap.mmap | None:
    """Returns the content of a file of the cache folder; None if there is none, or another user wrote it."""
    try:
        with file.open("rb") as stream:
            if not may_be_read(stream.fileno(), folder):
                return None
            return mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ)
    except (OSError, ValueError):
        return None


@cache
def shipped_pack() -> Pack | None:
    """Returns the pack that this Python, numba and machine can use; None if there is none."""
    path = _pack_path()
    pack = None if path is None else open_pack(path)
    return pack if pack is not None and pack.target.runs_here() else None


def open_pack(path: Path) -> Pack | None:
    """Opens a pack; returns None if it cannot be read, or was made by another Python, numba or llvmlite."""
    try:
        with path.open("rb") as stream:
            if stream.readline(len(_MAGIC)) != _MAGIC:
                return None
            header = json.loads(stream.readline(_LARGEST_HEADER))
            if header["versions"] != _versions():
                return None
            return Pack(path, header, stream.tell())
    except (OSError, ValueError, KeyError, TypeError):
        return None


def write_pack(path: Path, folder: Path, target: Target) -> int:
    """Packs all compiled kernels of a folder; returns their number.

    The file has a line that says what it is, a header of one line of JSON, and the files one after another, compressed
    by xz. The header holds the versions of Python, numba and llvmlite, the target, the names and sizes of the files,
    and the SHA-256 of their contents.

    Args:
        path: The pack to write.
        folder: Folder of compiled kernels, as `cache` keeps them.
        target: What they were compiled for.

    Raises:
        BadOutput: The pack cannot be written.
    """
    files = sorted(folder.glob("*/*.kernel"))
    contents = [file.read_bytes() for file in files]
    whole = b"".join(contents)
    header = {
        "versions": _versions(),
        "target": list(target),
        "files": [[f"{file.parent.name}/{file.name}", len(each)] for file, each in zip(files, contents, strict=True)],
        "sha256": hashlib.sha256(whole).hexdigest(),
    }
    with atomic_write(path) as temporary:
        temporary.write_bytes(_MAGIC + json.dumps(header).encode() + b"\n" + lzma.compress(whole, preset=9))
    return len(files)


def pack_name() -> str:
    """Returns the file name of the pack for this Python and platform."""
    return f"cp{sys.version_info[0]}{sys.version_info[1]}-{sys.platform}-{platform.machine().lower()}.pack"


def _pack_path() -> Path | None:
    named = os.environ.get(VARIABLE)
    if named:
        return None if named == "none" else Path(named)
    spec = find_spec(PACKAGE)
    if spec is None or not spec.submodule_search_locations:
        return None
    return Path(next(iter(spec.submodule_search_locations))) / pack_name()


def _versions() -> dict[str, str]:
    python = f"{sys.version_info[0]}.{sys.version_info[1]}"
    return {"python": python, "numba": numba.__version__, "llvmlite": llvmlite.__version__}
