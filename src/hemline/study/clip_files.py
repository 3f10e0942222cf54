"""Checks of clip files before a browser plays them: kind, size and length."""

import io
from pathlib import Path

from hemline.errors import BadInput

KINDS = {".webp": "image/webp", ".gif": "image/gif", ".webm": "video/webm", ".mp4": "video/mp4"}
"""Endings of files that browsers can play, and their media types."""
_MAGIC = {".webm": (0, b"\x1a\x45\xdf\xa3"), ".mp4": (4, b"ftyp")}
_AGAIN = "make the clip again, as with 'hemline animate MODEL -m MOTION -o clip.webp'"


def measure_clip(path: Path, content: bytes) -> dict[str, object]:
    """Returns size [pixels], length [s] and repeats of an animated picture; an empty result for a video.

    Browsers measure videos themselves.

    Args:
        path: Name of the file, whose ending is its kind.
        content: Bytes of the file.

    Raises:
        BadInput: No browser plays this ending, the bytes do not match it, or a picture has a single frame.
    """
    kind = path.suffix.lower()
    if kind not in KINDS:
        raise BadInput(f"{path} is no clip that a browser plays ({', '.join(KINDS)})", f"'{kind}'", _AGAIN)
    if kind not in _MAGIC:
        return _picture(path, content)
    at, magic = _MAGIC[kind]
    if content[at : at + len(magic)] != magic:
        raise BadInput(f"{path} is no {kind} video", f"{len(content)} other bytes", _AGAIN)
    return {}


def _picture(path: Path, content: bytes) -> dict[str, object]:
    from PIL import Image, ImageSequence

    kind = path.suffix[1:].upper()
    try:
        with Image.open(io.BytesIO(content), formats=[kind]) as picture:
            milliseconds = [_duration_ms(frame) for frame in ImageSequence.Iterator(picture)]
            repeats = "endless" if picture.info.get("loop") == 0 else str(picture.info.get("loop", "none"))
            size = f"{picture.size[0]} x {picture.size[1]} pixels"
    except Exception as reason:  # Pillow raises many kinds on damaged files
        raise BadInput(f"{path} is no {kind} that can be read", f"{len(content)} bytes", _AGAIN) from reason
    if len(milliseconds) < 2:
        raise BadInput(f"{path} must move", "a single picture", _AGAIN)
    return {"size": size, "length": f"{sum(milliseconds) / 1e3:.3f} s", "number of repeats": repeats}


def _duration_ms(frame) -> float:
    frame.load()
    return float(frame.info.get("duration", 0))
