"""Arrays of an SMPL file in numpy's npz format, read member by member and never larger than the file says."""

import io
import math
import zipfile
from collections.abc import Iterable
from typing import IO

import numpy as np

from .smpl_stand_ins import Refused

_BYTES_MAX = 2**30
_MEMBERS_MAX = 10_000
_HEADER_MAX = 10_000


def zipped_arrays(content: bytes, names: Iterable[str]) -> dict[str, np.ndarray]:
    """Those of the named arrays that an npz file holds; other members are not opened.

    Args:
        content: The whole file.
        names: Keys to look for.

    Raises:
        Refused: The file is damaged, or a member holds objects (a pickle) or claims more than it has.
    """
    if content.count(b"PK\x01\x02") > _MEMBERS_MAX:
        raise Refused("a zip archive of far more members than a body has")
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            members = {each.filename: each for each in archive.infolist()}
            wanted = [name for name in names if f"{name}.npy" in members]
            if sum(members[f"{name}.npy"].file_size for name in wanted) > _BYTES_MAX:
                raise Refused(f"arrays of more than {_BYTES_MAX} bytes")
            return {name: _member(archive, members[f"{name}.npy"], name) for name in wanted}
    except Refused:
        raise
    except Exception as reason:  # zipfile, zlib and lzma raise whatever a damaged archive provokes
        raise Refused(f"a damaged npz ({reason})") from reason


def _member(archive: zipfile.ZipFile, member: zipfile.ZipInfo, name: str) -> np.ndarray:
    """One array; nothing is made before its claimed size is compared with the member's."""
    with archive.open(member) as stream:
        shape, by_columns, dtype = _header(stream)
        if dtype.hasobject or dtype.kind not in "fiub":
            raise Refused(f"'{name}': an array of {'pickled objects' if dtype.hasobject else dtype}")
        size = math.prod(shape) * dtype.itemsize
        if size > member.file_size or min(shape, default=0) < 0:
            raise Refused(f"'{name}': an array that claims shape {shape} in {member.file_size} bytes")
        content = stream.read(size)
        if len(content) != size or stream.read(1):
            raise Refused(f"'{name}': an array of shape {shape} with {len(content)} bytes or more")
    return np.frombuffer(content, dtype).reshape(shape, order="F" if by_columns else "C")


def _header(stream: IO[bytes]) -> tuple[tuple[int, ...], bool, np.dtype]:
    """Shape, whether by columns, and type."""
    version = np.lib.format.read_magic(stream)
    if version == (1, 0):
        return np.lib.format.read_array_header_1_0(stream, max_header_size=_HEADER_MAX)
    if version == (2, 0):
        return np.lib.format.read_array_header_2_0(stream, max_header_size=_HEADER_MAX)
    raise Refused(f"an array of format {version}")
