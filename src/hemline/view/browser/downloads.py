"""Downloads of the page: stored frames, written by the exporters."""

import tempfile
from pathlib import Path

from hemline import export
from hemline.playback import record
from hemline.view.stage.stage import Stage

ENDINGS = ("glb", "webp")
"""Formats that the page offers; each is a single file."""


def clip_of(stage: Stage) -> export.Clip:
    """Returns the stored frames of a stage, in their order, as a clip.

    Args:
        stage: The stage.
    """
    garment = stage.source.garment
    return record(
        (stage.stored_frame(index) for index in stage.stored_frames),
        garment_name=garment.name,
        garment_faces=garment.faces,
        motion=stage.source.motion,
        fps=stage.fps,
    )


def file_of(clip: export.Clip, ending: str) -> bytes:
    """Returns the bytes of a file.

    Args:
        clip: The frames.
        ending: One of `ENDINGS`.
    """
    with tempfile.TemporaryDirectory() as folder:
        (path,) = export.write(Path(folder) / f"clip.{ending}", clip)
        return path.read_bytes()
