"""The anchors of a dataset: in which poses, on which shapes, and how the garment lies there."""

from dataclasses import dataclass, replace

import numpy as np

from hemline import bodies
from hemline.arrays import Float, Int
from hemline.bodies.body import Body, ShapedBody
from hemline.datasets import Dataset
from hemline.datasets.joint_sensitivity import derivatives_by_joint
from hemline.datasets.take import Take
from hemline.errors import BadDataset
from hemline.motions.motion import JOINT_COUNT, Pose

from .binding import Binding
from .config import AgentDressConfig
from .shape_model import ShapeModel

COMMAND = "hemline drape GARMENT --anchors 150 --motion FILE..."


@dataclass(frozen=True)
class AnchorSet:
    """Anchors whose garment came to rest on every shape, and poses in which it did on the mean one alone.

    Attributes:
        rotations: Of the anchors' poses.
        betas: The shapes, the mean one first; as many betas as any of them has.
        rest: The garment in the rest pose, by shape: of each, what skinning carries nearest to all its anchors [m].
        offsets: How far the garment of each anchor on each shape is from `rest`, carried along, in the turned frames of
            its binding [m].
        single_rotations: Poses of the mean shape alone.
        single_offsets: The same there [m].
        sensitivity: How far each vertex moves when a joint turns [m/rad]: of all of its way; and less what the skin
            under it does.
        binding: Of the garment, from the T-pose on the mean shape.
    """

    rotations: Float[np.ndarray, "anchors joints 4"]
    betas: Float[np.ndarray, "shapes betas"]
    rest: ShapeModel
    offsets: Float[np.ndarray, "anchors shapes verts 3"]
    single_rotations: Float[np.ndarray, "singles joints 4"]
    single_offsets: Float[np.ndarray, "singles verts 3"]
    sensitivity: tuple[Float[np.ndarray, "verts joints 3"], Float[np.ndarray, "verts joints 3"]]
    binding: Binding

    @classmethod
    def of(cls, dataset: Dataset, config: AgentDressConfig | None = None) -> "AnchorSet":
        """Read the anchors of a dataset.

        Args:
            dataset: What `hemline drape --anchors` made.
            config: Options of the shape model.

        Raises:
            BadDataset: It holds no T-pose with derivatives, or fewer than two anchors on all shapes.
        """
        body, options = bodies.load(dataset.garment.body_name), config or AgentDressConfig()
        upright, by_pose = _takes(dataset)
        first = upright[0]
        binding = Binding.of(first.vertices[0], dataset.garment.faces, body.shaped(first.betas).posed(first.motion[0]))
        shapes = sorted({betas for found in by_pose.values() for betas in found}, key=lambda each: (any(each), each))
        whole = [found for found in by_pose.values() if len(found) == len(shapes)]
        if len(whole) < 2 or any(shapes[0]):
            raise BadDataset(
                "fewer than two anchors on all shapes", len(whole), "run 'hemline drape --anchors' to its end"
            )
        alone = [found[shapes[0]] for found in by_pose.values() if len(found) < len(shapes) and shapes[0] in found]
        betas = np.array(shapes, np.float64)
        betas = betas[:, : int(np.flatnonzero(betas.any(axis=0)).max(initial=0)) + 1]
        shaped = [body.shaped(each) for each in betas.astype(np.float32)]
        settled = [
            _Settled.of(each, [dataset.take(found[shape]) for found in whole])
            for each, shape in zip(shaped, shapes, strict=True)
        ]
        single = _Settled.of(shaped[0], [dataset.take(name) for name in alone])
        rest = ShapeModel.fitted(
            np.array([binding.carried(each.transforms, each.worn).ravel() for each in settled]),
            betas,
            components=options.shape_components,
            ridge=options.shape_ridge,
        )
        rests = rest.at(betas).reshape(len(betas), -1, 3)
        offsets = [each.offsets(binding, at) for each, at in zip(settled, rests, strict=True)]
        return cls(
            rotations=settled[0].rotations,
            betas=betas,
            rest=rest,
            offsets=np.stack(offsets, axis=1),
            single_rotations=single.rotations,
            single_offsets=single.offsets(binding, rests[0]),
            sensitivity=_sensitivity(upright, body, binding),
            binding=binding,
        )

    def only(self, anchors: Int[np.ndarray, " some"], singles: Int[np.ndarray, " some_singles"]) -> "AnchorSet":
        """Some of the anchors, and some of the poses beside them: what fewer would tell."""
        return replace(
            self,
            rotations=self.rotations[anchors],
            offsets=self.offsets[anchors],
            single_rotations=self.single_rotations[singles],
            single_offsets=self.single_offsets[singles],
        )


@dataclass(frozen=True)
class _Settled:
    """Settled garments on one body: rotations and skin transforms of the poses, and what is worn there [m]."""

    rotations: Float[np.ndarray, "poses joints 4"]
    transforms: Float[np.ndarray, "poses joints 3 4"]
    worn: Float[np.ndarray, "poses verts 3"]

    @classmethod
    def of(cls, shaped: ShapedBody, takes: list[Take]) -> "_Settled":
        poses: list[Pose] = [take.motion[0] for take in takes]
        return cls(
            np.array([pose.rotations for pose in poses], np.float64).reshape(-1, JOINT_COUNT, 4),
            np.array([shaped.posed(pose).transforms for pose in poses], np.float64).reshape(-1, JOINT_COUNT, 3, 4),
            np.array([take.vertices[0] for take in takes], np.float64),
        )

    def offsets(self, binding: Binding, rest: Float[np.ndarray, "verts 3"]) -> Float[np.ndarray, "poses verts 3"]:
        found = [binding.offsets(t, rest, worn) for t, worn in zip(self.transforms, self.worn, strict=True)]
        return np.array(found, np.float32).reshape(-1, *rest.shape)


def _takes(dataset: Dataset) -> tuple[list[Take], dict[str, dict[tuple[float, ...], str]]]:
    """The T-poses with derivatives, the mean shape first; and names of the others, by pose and shape."""
    by_pose: dict[str, dict[tuple[float, ...], str]] = {}
    upright = []
    for row in dataset.anchors():
        take = dataset.take(row)
        if "turn.0.0" in take.derivatives:
            if is_t_pose(take.motion[0]):
                upright.append(take)
        else:
            by_pose.setdefault(take.motion[0].hash, {})[row.betas] = row.name
    if not upright:
        raise BadDataset("no anchor in the T-pose with derivatives", dataset.folder, f"run '{COMMAND}'")
    return sorted(upright, key=lambda take: float(np.abs(take.betas).max(initial=0))), by_pose


def is_t_pose(pose: Pose) -> bool:
    """Whether no joint is turned."""
    return bool((np.abs(pose.rotations[:, 0]) > 1 - 1e-6).all())


def _sensitivity(upright: list[Take], body: Body, binding: Binding) -> tuple[np.ndarray, np.ndarray]:
    whole, beside = [], []
    for take in upright:
        moved = derivatives_by_joint(take)
        whole.append(np.linalg.norm(moved, axis=3))
        skinned = _skinned(body.shaped(take.betas), take.motion[0], binding)
        beside.append(np.linalg.norm(moved - skinned, axis=3))
    return np.mean(whole, axis=0).transpose(2, 0, 1), np.mean(beside, axis=0).transpose(2, 0, 1)


def _skinned(shaped: ShapedBody, pose: Pose, binding: Binding) -> Float[np.ndarray, "joints 3 verts 3"]:
    """How the skin under each vertex moves when a joint turns [m/rad]."""
    from hemline.bodies.velocities import turning

    posed, joints = shaped.posed(pose), len(pose.rotations)
    return np.stack([[turning(posed, joint, axis)[binding.nearest] for axis in np.eye(3)] for joint in range(joints)])
