"""Point caches beside an OBJ of the first frame: what PC2 and MDD have in common."""

from collections.abc import Callable
from pathlib import Path

from hemline.files import written_together

from .clip import Clip, ClipPart
from .obj import rest_obj


def write_caches(path: Path, clip: Clip, content: Callable[[ClipPart, float], bytes]) -> tuple[Path, ...]:
    """Write a cache and an OBJ of its first frame for each part: `NAME.pc2`, `NAME.obj`, `NAME_body.pc2`, ...

    A cache holds positions only; the OBJ has the triangles that they belong to, with the same vertex ids.

    Returns:
        The files written.

    Raises:
        BadOutput: The path cannot be written.
    """
    stems = [f"{path.stem}{part.suffix}" for part in clip.parts]
    caches = [path.with_name(stem + path.suffix) for stem in stems]
    meshes = [path.with_name(stem + ".obj") for stem in stems]
    with written_together([*caches, *meshes]) as temporaries:
        for part, cache, mesh in zip(clip.parts, temporaries, temporaries[len(stems) :], strict=False):
            cache.write_bytes(content(part, clip.fps))
            mesh.write_text(rest_obj(part, clip))
    return tuple(name for pair in zip(caches, meshes, strict=True) for name in pair)
