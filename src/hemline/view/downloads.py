"""What is seen, as files: frames that are kept, through the exporters."""

import tempfile
from pathlib import Path

from hemline import export
from hemline.playback import record

from .stage import Stage

ENDINGS = ("glb", "webp")
"""Kinds of files that the page offers, each of which is one file."""


def clip_of(stage: Stage) -> export.Clip:
    """The frames that a stage keeps, in their order, finished.

    Args:
        stage: What is played.
    """
    garment = stage.source.garment
    return record(
        (stage.kept(index) for index in stage.known),
        garment_name=garment.name,
        garment_faces=garment.faces,
        motion=stage.source.motion,
        fps=stage.fps,
    )


def file_of(clip: export.Clip, ending: str) -> bytes:
    """The bytes of a file.

    Args:
        clip: Frames.
        ending: One of `ENDINGS`.
    """
    with tempfile.TemporaryDirectory() as folder:
        (path,) = export.write(Path(folder) / f"clip.{ending}", clip)
        return path.read_bytes()
