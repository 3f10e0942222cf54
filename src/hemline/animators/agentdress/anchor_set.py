"""The anchors of a dataset: in which poses, on which shapes, and how the garment lies there."""

from dataclasses import dataclass

import numpy as np

from hemline import bodies
from hemline.arrays import Float
from hemline.bodies.body import ShapedBody
from hemline.datasets import Dataset
from hemline.datasets.joint_sensitivity import derivatives_by_joint
from hemline.errors import BadDataset
from hemline.motions.motion import Pose

from .binding import Binding

COMMAND = "hemline drape GARMENT --anchors 150 --motion FILE..."


@dataclass(frozen=True)
class AnchorSet:
    """Anchors whose garment came to rest on every shape, and poses in which it did on the mean one alone.

    Attributes:
        rotations: Of the anchors' poses.
        betas: The shapes, the mean one first.
        unposed: The garment of each anchor on each shape, taken back to the rest pose by its binding [m].
        single_rotations: Poses of the mean shape alone.
        single: The garment there [m].
        sensitivity: How far each vertex moves when a joint turns [m/rad]: of all of its way; and less what the skin
            under it does.
        binding: Of the garment, from the T-pose on the mean shape.
    """

    rotations: Float[np.ndarray, "anchors joints 4"]
    betas: Float[np.ndarray, "shapes betas"]
    unposed: Float[np.ndarray, "anchors shapes verts 3"]
    single_rotations: Float[np.ndarray, "singles joints 4"]
    single: Float[np.ndarray, "singles verts 3"]
    sensitivity: tuple[Float[np.ndarray, "verts joints 3"], Float[np.ndarray, "verts joints 3"]]

    binding: Binding

    @classmethod
    def of(cls, dataset: Dataset) -> "AnchorSet":
        """Read the anchors of a dataset.

        Raises:
            BadDataset: It holds no T-pose with derivatives, or fewer than two anchors on all shapes.
        """
        body = bodies.load(dataset.garment.body_name)
        by_pose: dict[str, dict[tuple[float, ...], str]] = {}
        poses: dict[str, Pose] = {}
        upright = []
        for row in dataset.anchors():
            take = dataset.take(row)
            if "turn.0.0" in take.derivatives:
                upright.append(take)
            else:
                pose = take.motion[0]
                poses[pose.hash] = pose
                by_pose.setdefault(pose.hash, {})[row.betas] = row.name
        upright.sort(key=lambda take: float(np.abs(take.betas).max(initial=0)))
        if not upright:
            raise BadDataset("no anchor in the T-pose with derivatives", dataset.folder, f"run '{COMMAND}'")
        first = body.shaped(upright[0].betas).posed(upright[0].motion[0])
        binding = Binding.of(upright[0].vertices[0], dataset.garment.faces, first)
        whole, beside = [], []
        for take in upright:
            moved = derivatives_by_joint(take)
            whole.append(np.linalg.norm(moved, axis=3))
            skinned = _skinned(body.shaped(take.betas), take.motion[0], binding)
            beside.append(np.linalg.norm(moved - skinned, axis=3))
        shapes = sorted({betas for found in by_pose.values() for betas in found}, key=lambda each: (any(each), each))
        full = [key for key in by_pose if len(by_pose[key]) == len(shapes)]
        if len(full) < 2 or any(shapes[0]):
            raise BadDataset(
                "fewer than two anchors on all shapes", len(full), "run 'hemline drape --anchors' to its end"
            )
        shaped = [body.shaped(np.asarray(betas, np.float32)) for betas in shapes]

        def unposed(key: str, number: int) -> np.ndarray:
            take = dataset.take(by_pose[key][shapes[number]])
            transforms = shaped[number].posed(take.motion[0]).transforms
            return binding.unposed(transforms, take.vertices[0]).astype(np.float32)

        alone = [key for key in by_pose if key not in set(full) and shapes[0] in by_pose[key]]
        single = [unposed(key, 0) for key in alone]
        return cls(
            np.array([poses[key].rotations for key in full], np.float64),
            np.array(shapes, np.float64),
            np.array([[unposed(key, number) for number in range(len(shapes))] for key in full], np.float32),
            np.array([poses[key].rotations for key in alone], np.float64).reshape(-1, *poses[full[0]].rotations.shape),
            np.array(single, np.float32).reshape(-1, len(binding.nearest), 3),
            (np.mean(whole, axis=0).transpose(2, 0, 1), np.mean(beside, axis=0).transpose(2, 0, 1)),
            binding,
        )


def _skinned(shaped: ShapedBody, pose: Pose, binding: Binding) -> Float[np.ndarray, "joints 3 verts 3"]:
    """How the skin under each vertex moves when a joint turns [m/rad]."""
    from hemline.bodies.velocities import turning

    posed, joints = shaped.posed(pose), len(pose.rotations)
    return np.stack([[turning(posed, joint, axis)[binding.nearest] for axis in np.eye(3)] for joint in range(joints)])
