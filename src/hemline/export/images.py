"""Pictures of a clip: a still PNG, or an animated WebP."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from hemline.pictures import AUTO, ShadedSurface, clearest_view, frame_clip, render, write_png, write_webp
from hemline.pictures.render import Picture

from .clip import Clip

VIEW_SAMPLES = 5
"""Number of frames that are examined to choose a view."""


def write_still(path: Path, clip: Clip, *, view: str, size: tuple[int, int]) -> tuple[Path, ...]:
    """Writes the middle frame of a clip as PNG.

    Raises:
        BadInput: The view is unknown.
        BadOutput: The path cannot be written.
    """
    middle = clip.frame_count // 2
    write_png(path, next(render_frames(clip, view=view, size=size, frames=range(middle, middle + 1))))
    return (path,)


def write_moving(path: Path, clip: Clip, *, view: str, size: tuple[int, int]) -> tuple[Path, ...]:
    """Writes all frames as an endless WebP whose camera follows the body.

    Raises:
        BadInput: The view is unknown.
        BadOutput: The path cannot be written.
    """
    write_webp(path, list(render_frames(clip, view=view, size=size, frames=range(clip.frame_count))), clip.fps)
    return (path,)


def render_frames(clip: Clip, *, view: str, size: tuple[int, int], frames: range) -> Iterator[Picture]:
    """Renders frames of a clip, on a ground at its lowest vertex.

    Args:
        clip: The clip.
        view: One of `hemline.pictures.VIEWS_DEG`, or `"auto"` for the view that shows most of the garment.
        size: Width and height [pixels].
        frames: Numbers of the frames.
    """
    everything = np.concatenate([part.vertices for part in clip.parts], axis=1)
    view = _clearest(clip) if view == AUTO else view
    cameras = frame_clip(everything, view, size=size, fps=clip.fps)
    ground = float(everything[..., 1].min())
    for frame in frames:
        surfaces = [
            ShadedSurface(part.vertices[frame], part.faces, part.colour, sheen=0.0 if part.suffix else 0.08)
            for part in clip.parts
        ]
        yield render(surfaces, cameras[frame], size, ground=ground)


def _clearest(clip: Clip) -> str:
    frames = np.unique(np.linspace(0, clip.frame_count - 1, VIEW_SAMPLES).round().astype(int))
    garment, *others = clip.parts
    return clearest_view(
        [
            ([(garment.vertices[frame], garment.faces)], [(part.vertices[frame], part.faces) for part in others])
            for frame in frames
        ]
    )
