"""A skinned mesh in a USD stage: UsdSkel."""

# pxr is compiled and has no types
# pyright: reportAttributeAccessIssue=false

import numpy as np

from hemline.export.clip import ClipPart, ClipSkeleton

from .usd_mesh import add_mesh, bounds_of


def add_skinned(stage, part: ClipPart, skeleton: ClipSkeleton) -> None:
    """Adds a mesh that follows its skeleton, with its bounds in each frame.

    Joints are bound at rest, without rotation; only roots move relative to their parents.
    """
    from pxr import Gf, Tf, UsdSkel, Vt

    top = f"/clip/{Tf.MakeValidIdentifier(part.name)}"
    root = UsdSkel.Root.Define(stage, top)
    extent = root.CreateExtentAttr()
    for frame, vertices in enumerate(part.vertices):
        extent.Set(bounds_of(vertices), frame)
    joints = Vt.TokenArray(_paths(skeleton))
    bones = UsdSkel.Skeleton.Define(stage, f"{top}/skeleton")
    bones.CreateJointsAttr(joints)
    bones.CreateBindTransformsAttr(_shifts(skeleton.joints))
    bones.CreateRestTransformsAttr(_shifts(skeleton.rest_places))
    _animate(stage, f"{top}/skeleton/animation", bones, joints, skeleton)
    mesh = add_mesh(stage, f"{top}/mesh", part)
    rest = np.ascontiguousarray(skeleton.vertices, np.float32)
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(rest))
    mesh.CreateExtentAttr(bounds_of(rest))
    binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
    binding.CreateSkeletonRel().SetTargets([bones.GetPath()])
    binding.CreateGeomBindTransformAttr(Gf.Matrix4d(1.0))
    influences = skeleton.weights.shape[1]
    indices = np.ascontiguousarray(skeleton.weight_indices, np.int32).ravel()
    binding.CreateJointIndicesPrimvar(False, influences).Set(Vt.IntArray.FromNumpy(indices))
    weights = np.ascontiguousarray(skeleton.weights, np.float32).ravel()
    binding.CreateJointWeightsPrimvar(False, influences).Set(Vt.FloatArray.FromNumpy(weights))


def _animate(stage, path: str, bones, joints, skeleton: ClipSkeleton) -> None:
    from pxr import UsdSkel, Vt
    from scipy.spatial.transform import Rotation

    animation = UsdSkel.Animation.Define(stage, path)
    animation.CreateJointsAttr(joints)
    count = len(skeleton.joints)
    animation.CreateScalesAttr(Vt.Vec3hArray.FromNumpy(np.ones((count, 3), np.float16)))
    moved, turned = animation.CreateTranslationsAttr(), animation.CreateRotationsAttr()
    turns, paths = skeleton.turns, skeleton.root_paths
    places = skeleton.rest_places.copy()
    for frame, local in enumerate(turns):
        for root, root_path in paths.items():
            places[root] = root_path[frame]
        moved.Set(Vt.Vec3fArray.FromNumpy(places.astype(np.float32)), frame)
        turned.Set(Vt.QuatfArray.FromNumpy(Rotation.from_matrix(local).as_quat().astype(np.float32)), frame)  # xyzw
    binding = UsdSkel.BindingAPI.Apply(bones.GetPrim())
    binding.CreateAnimationSourceRel().SetTargets([animation.GetPath()])


def _paths(skeleton: ClipSkeleton) -> list[str]:
    """Returns the path of each joint: the names of its ancestors and its own."""
    from pxr import Tf

    names = skeleton.names or tuple(f"joint_{joint}" for joint in range(len(skeleton.joints)))
    paths: list[str] = []
    for name, parent in zip(names, np.asarray(skeleton.parents).tolist(), strict=True):
        own = Tf.MakeValidIdentifier(name)
        paths.append(own if parent < 0 else f"{paths[parent]}/{own}")
    return paths


def _shifts(places: np.ndarray):
    """Returns translation matrices in the row convention of USD."""
    from pxr import Vt

    matrices = np.tile(np.eye(4), (len(places), 1, 1))
    matrices[:, 3, :3] = places
    return Vt.Matrix4dArray.FromNumpy(matrices)
