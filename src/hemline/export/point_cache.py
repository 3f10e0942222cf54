"""Point caches with an OBJ of the first frame, as used by PC2 and MDD."""

from collections.abc import Callable
from pathlib import Path

from hemline.files import atomic_writes

from .clip import Clip, ClipPart
from .obj import rest_obj


def write_caches(path: Path, clip: Clip, content: Callable[[ClipPart, float], bytes]) -> tuple[Path, ...]:
    """Writes a cache and an OBJ of its first frame for each part: `NAME.pc2`, `NAME.obj`, `NAME_body.pc2`, ...

    A cache stores only positions; the OBJ has the triangles, with the same vertex order.

    Returns:
        The files written.

    Raises:
        BadOutput: The path cannot be written.
    """
    stems = [f"{path.stem}{part.suffix}" for part in clip.parts]
    caches = [path.with_name(stem + path.suffix) for stem in stems]
    meshes = [path.with_name(stem + ".obj") for stem in stems]
    with atomic_writes([*caches, *meshes]) as temporaries:
        for part, cache, mesh in zip(clip.parts, temporaries, temporaries[len(stems) :], strict=False):
            cache.write_bytes(content(part, clip.fps))
            mesh.write_text(rest_obj(part, clip))
    return tuple(name for pair in zip(caches, meshes, strict=True) for name in pair)
