"""USD: one binary stage with garment and body as meshes whose points are sampled in time."""

# pxr is compiled and has no types
# pyright: reportAttributeAccessIssue=false

from pathlib import Path

import numpy as np

from hemline.errors import MissingExtra
from hemline.files import written_whole
from hemline.pictures import linear
from hemline.version import VERSION

from .clip import Clip, Part


def write_usd(path: Path, clip: Clip) -> tuple[Path, ...]:
    """Write a stage: y up, one unit a metre, one time code a frame from 0, time codes a second = the clip's fps.

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
        _add_mesh(stage, part)
    with written_whole(path) as temporary:
        layer.Export(str(temporary))
    return (path,)


def _add_mesh(stage, part: Part) -> None:
    from pxr import Gf, Tf, UsdGeom, Vt

    mesh = UsdGeom.Mesh.Define(stage, f"/clip/{Tf.MakeValidIdentifier(part.name)}")
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    mesh.CreateDoubleSidedAttr(True)
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(part.faces), 3, np.int32)))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(np.ascontiguousarray(part.faces, np.int32).ravel()))
    mesh.CreateDisplayColorAttr([Gf.Vec3f(*linear(part.colour).tolist())])
    points, extent = mesh.CreatePointsAttr(), mesh.CreateExtentAttr()
    for frame, vertices in enumerate(part.vertices):
        solid = np.ascontiguousarray(vertices, np.float32)
        points.Set(Vt.Vec3fArray.FromNumpy(solid), frame)
        extent.Set(Vt.Vec3fArray.FromNumpy(np.stack([solid.min(axis=0), solid.max(axis=0)])), frame)
