"""USD: one binary stage with garment and body as point caches, or as skinned meshes."""

# pxr is compiled and has no types
# pyright: reportAttributeAccessIssue=false

from pathlib import Path

import numpy as np

from hemline.errors import MissingExtra
from hemline.export.clip import Clip, ClipPart
from hemline.files import written_whole
from hemline.version import VERSION

from .usd_mesh import add_mesh, bounds_of
from .usd_skin import add_skinned


def write_usd(path: Path, clip: Clip) -> tuple[Path, ...]:
    """Write a stage: y up, one unit a metre, one time code a frame from 0, time codes a second = the clip's fps.

    A mesh is a point cache. Where the clip has a skin, the garment, and the body whose skeleton is known, are skinned
    meshes instead (UsdSkel).

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
    with written_whole(path) as temporary:
        _export(layer, temporary)
    return (path,)


def _export(layer, path: Path) -> None:
    """Write a layer; what USD says of a full disk is an `OSError`, as it is of any other writer."""
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
