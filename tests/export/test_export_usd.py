"""USD, read back with usd-core."""

# pxr is compiled and has no types
# pyright: reportAttributeAccessIssue=false

import sys

import numpy as np
import pytest

from hemline.errors import MissingExtra
from hemline.export import skin_clip, write


def test_points_at_time_codes(tmp_path, full_clip):
    pxr = pytest.importorskip("pxr", reason="usd-core is not installed: pip install 'hemline[usd]'")
    from pxr import Usd, UsdGeom

    assert write(tmp_path / "a.usdc", full_clip) == (tmp_path / "a.usdc",)
    stage = Usd.Stage.Open(str(tmp_path / "a.usdc"))
    assert UsdGeom.GetStageUpAxis(stage) == "Y"
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode(), stage.GetTimeCodesPerSecond()) == (0, 6, 24)
    assert stage.GetDefaultPrim().GetPath() == "/clip"
    assert "NSF EIA-0196217" in stage.GetRootLayer().customLayerData["notices"]
    for name, part in zip(("red_cape", "body"), full_clip.parts, strict=True):
        mesh = UsdGeom.Mesh(stage.GetPrimAtPath(f"/clip/{name}"))
        np.testing.assert_array_equal(np.array(mesh.GetFaceVertexIndicesAttr().Get()).reshape(-1, 3), part.faces)
        assert set(mesh.GetFaceVertexCountsAttr().Get()) == {3}
        for frame, vertices in enumerate(part.vertices):
            np.testing.assert_array_equal(np.array(mesh.GetPointsAttr().Get(frame)), vertices)
            low, high = np.array(mesh.GetExtentAttr().Get(frame))
            np.testing.assert_array_equal([low, high], [vertices.min(axis=0), vertices.max(axis=0)])
    assert pxr is not None
    assert (tmp_path / "a.usdc").read_bytes()[:8] == b"PXR-USDC"


def test_without_usd_core_the_extra_is_named_and_nothing_is_written(tmp_path, cloth_clip, monkeypatch):
    monkeypatch.setitem(sys.modules, "pxr", None)  # what Python does where a library is absent
    with pytest.raises(MissingExtra, match=r"writing a.usdc needs pxr; .*pip install 'hemline\[usd\]'"):
        write(tmp_path / "a.usdc", cloth_clip)
    assert not list(tmp_path.iterdir())


def baked(stage, name, frame_count):
    """Points of a skinned mesh as UsdSkel itself skins them."""
    from pxr import UsdGeom, UsdSkel

    root = UsdSkel.Root(stage.GetPrimAtPath(f"/clip/{name}"))
    assert UsdSkel.BakeSkinning(root)
    points = UsdGeom.Mesh(stage.GetPrimAtPath(f"/clip/{name}/mesh")).GetPointsAttr()
    return np.stack([np.array(points.Get(frame)) for frame in range(frame_count)])


def test_a_skinned_clip_is_skinned_by_usd_itself(tmp_path, full_clip):
    pytest.importorskip("pxr", reason="usd-core is not installed: pip install 'hemline[usd]'")
    from pxr import Usd, UsdValidation

    clip = skin_clip(full_clip, 8)
    stage = Usd.Stage.Open(str(write(tmp_path / "a.usdc", clip)[0]))
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    assert len(validators) > 10
    found = UsdValidation.ValidationContext(validators).Validate(stage)
    assert [error.GetErrorAsString() for error in found] == []
    np.testing.assert_allclose(baked(stage, "body", 7), clip.body_vertices, atol=1e-5)
    apart = 1000 * np.linalg.norm(baked(stage, "red_cape", 7) - clip.vertices, axis=2)
    assert apart.mean() == pytest.approx(clip.skin.mean_error_mm, abs=0.02)
    assert apart.max() == pytest.approx(clip.skin.max_error_mm, abs=0.05)
