"""Wavefront OBJ: a still, or one numbered file per frame."""

from pathlib import Path

import numpy as np

from hemline.arrays import Faces, Vertices
from hemline.files import atomic_writes

from .clip import Clip, ClipPart


def write_obj(path: Path, clip: Clip) -> tuple[Path, ...]:
    """Writes `NAME_0001.obj`, `NAME_0002.obj`, ... for `NAME.obj`, and `NAME_body_0001.obj`, ... for the body.

    A clip of one frame is written as `NAME.obj` itself. The order of vertices is kept; positions are rounded to 1 um.

    Returns:
        The files written.

    Raises:
        BadOutput: The path cannot be written.
    """
    digits = max(4, len(str(clip.frame_count)))
    numbers = [f"_{frame + 1:0{digits}d}" for frame in range(clip.frame_count)] if clip.frame_count > 1 else [""]
    names = [path.with_name(f"{path.stem}{part.suffix}{number}.obj") for part in clip.parts for number in numbers]
    with atomic_writes(names) as temporaries:
        queue = iter(temporaries)
        for part in clip.parts:
            tail = faces_text(part.faces)
            for vertices in part.vertices:
                next(queue).write_text(heading(part, clip) + vertices_text(vertices) + tail)
    return tuple(names)


def rest_obj(part: ClipPart, clip: Clip) -> str:
    """Returns the first frame of a part as OBJ text."""
    return heading(part, clip) + vertices_text(part.vertices[0]) + faces_text(part.faces)


def heading(part: ClipPart, clip: Clip) -> str:
    """Returns comments with the notices, and the name of the object."""
    lines = [f"# {line}" for notice in clip.notices for line in notice.splitlines()]
    return "\n".join(["# hemline: metres, y up", *lines, f"o {part.name.replace(' ', '_')}", ""])


def vertices_text(vertices: Vertices) -> str:
    """Returns one `v` line per vertex, rounded to 1 um."""
    return ("v %.6f %.6f %.6f\n" * len(vertices)) % tuple(np.asarray(vertices, np.float64).ravel().tolist())


def faces_text(faces: Faces) -> str:
    """Returns one `f` line per triangle, counted from 1."""
    return ("f %d %d %d\n" * len(faces)) % tuple((np.asarray(faces) + 1).ravel().tolist())
