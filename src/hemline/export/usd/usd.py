"""USD: a binary stage with garment and body as point caches, or as skinned meshes."""

# pxr is compiled and has no types
# pyright: reportAttributeAccessIssue=false

from pathlib import Path

import numpy as np

from hemline.errors import MissingExtra
from hemline.export.clip import Clip, ClipPart
from hemline.files import atomic_write
from hemline.version import VERSION

from .usd_mesh import add_mesh, bounds_of
from .usd_skin import add_skinned


def write_usd(path: Path, clip: Clip) -> tuple[Path, ...]:
    """Writes a stage: y up, in metres, one time code per frame from 0, at the frame rate of the clip.

    Meshes are point caches. If the clip has a skin, the garment, and a body with a skeleton, are skinned meshes
    (UsdSkel) instead.

    Raises:
        MissingExtra: usd-core is not installed.
        BadOutput: The path cannot be written.
    """
    try:
        from pxr import Usd, UsdGeom
    except ImportError as reason:
        raise MissingExtra("pxr", "usd", f"writing {path.name}") from reason
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    stage.SetTimeCodesPerSecond(clip.fps)
    stage.SetFramesPerSecond(clip.fps)
    stage.SetStartTimeCode(0)
    stage.SetEndTimeCode(clip.frame_count - 1)
    root = UsdGeom.Xform.Define(stage, "/clip")
    stage.SetDefaultPrim(root.GetPrim())
    layer = stage.GetRootLayer()
    layer.documentation = f"hemline {VERSION}"
    layer.customLayerData = {"notices": "\n".join(clip.notices)}
    for part in clip.parts:
        if clip.skin is not None and part.skeleton is not None:
            add_skinned(stage, part, part.skeleton)
        else:
            _add_points(stage, part)
    with atomic_write(path) as temporary:
        _export(layer, temporary)
    return (path,)


def _export(layer, path: Path) -> None:
    """Writes a layer; an error of USD, such as a full disk, becomes an `OSError`, as for other writers."""
    from pxr import Tf

    try:
        whole = layer.Export(str(path))
    except Tf.ErrorException as error:
        raise OSError(error.args[0].commentary) from error
    if not whole:
        raise OSError("USD could not write the stage")


def _add_points(stage, part: ClipPart) -> None:
    from pxr import Tf, Vt

    mesh = add_mesh(stage, f"/clip/{Tf.MakeValidIdentifier(part.name)}", part)
    points, extent = mesh.CreatePointsAttr(), mesh.CreateExtentAttr()
    for frame, vertices in enumerate(part.vertices):
        points.Set(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(vertices, np.float32)), frame)
        extent.Set(bounds_of(vertices), frame)
