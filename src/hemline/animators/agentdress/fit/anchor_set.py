"""The anchors of a dataset: settled garments in chosen poses on bodies of several shapes."""

from collections import Counter
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hemline.animators.agentdress.binding import Binding
from hemline.animators.agentdress.config import AgentDressConfig
from hemline.animators.agentdress.shape_model import ShapeModel, pad_betas
from hemline.arrays import Float, Int
from hemline.bodies.body import Body, ShapedBody
from hemline.datasets import Dataset
from hemline.datasets.joint_sensitivity import derivatives_by_joint
from hemline.datasets.take import Take
from hemline.errors import BadDataset
from hemline.motions.motion import Pose

from .rest_model import extend_to_all_betas
from .settled_garments import SettledGarments

DRAPE_COMMAND = "hemline drape GARMENT --anchors 150 --motion FILE..."


@dataclass(frozen=True)
class AnchorSet:
    """Anchors, whose garment came to rest on every shape; and single poses, settled on the mean shape and some others.

    Attributes:
        rotations: Poses of the anchors.
        betas: Shapes of the anchors, the mean one first; as many betas as the longest has.
        rest: Shape model of the garment in the rest pose, which once skinned is closest to all anchors of a shape [m].
        offsets: Offsets of the garment of each anchor on each shape from the skinned `rest`, in rotated vertex
            frames [m].
        single_rotations: The single poses.
        single_offsets: Offsets in the single poses, on the mean shape [m].
        other_poses: Pose index of each garment on a further body shape, ascending; anchors come before single poses.
        other_betas: Shape of each of these bodies, with all betas.
        other_offsets: Offsets of these garments [m].
        sensitivity: Motion of each vertex per rotation of a joint [m/rad]: in total, and relative to the skin under it.
        binding: Skin weights of the garment, from the T-pose on the mean shape.
        body: The body that the garment was made on.
        groups: Group number of each pose, anchors first. Leave-one-out errors leave out the poses of a group together.
    """

    rotations: Float[np.ndarray, "anchors joints 4"]
    betas: Float[np.ndarray, "shapes betas"]
    rest: ShapeModel
    offsets: Float[np.ndarray, "anchors shapes verts 3"]
    single_rotations: Float[np.ndarray, "singles joints 4"]
    single_offsets: Float[np.ndarray, "singles verts 3"]
    other_poses: Int[np.ndarray, " others"]
    other_betas: Float[np.ndarray, "others all_betas"]
    other_offsets: Float[np.ndarray, "others verts 3"]
    sensitivity: tuple[Float[np.ndarray, "verts joints 3"], Float[np.ndarray, "verts joints 3"]]
    binding: Binding
    body: Body
    groups: Int[np.ndarray, " poses"]

    @classmethod
    def of(cls, dataset: Dataset, config: AgentDressConfig | None = None) -> "AnchorSet":
        """Reads the anchors of a dataset.

        If the garment was settled on the mean body alone, all poses are anchors, and on other bodies the garment at
        rest follows the skin.

        Args:
            dataset: A dataset made by `hemline drape`.
            config: Options of the shape model.

        Raises:
            BadDataset: The dataset holds no T-pose with derivatives, or fewer than two anchors on all shapes.
        """
        body, options = dataset.body, config or AgentDressConfig()
        upright, by_pose = _takes(dataset)
        first = upright[0]
        binding = Binding.of(first.vertices[0], dataset.garment.faces, body.shaped(first.betas).posed(first.motion[0]))
        shapes = _shapes_of_anchors(list(by_pose.values()))
        complete = [takes for takes in by_pose.values() if all(shape in takes for shape in shapes)]
        if len(complete) < 2 or not shapes or shapes[0]:
            raise BadDataset(
                "fewer than two anchors on all shapes", len(complete), "run 'hemline drape --anchors' to its end"
            )
        partial = [
            takes for takes in by_pose.values() if shapes[0] in takes and not all(shape in takes for shape in shapes)
        ]
        betas = _pad_rows(shapes)
        settled = [
            SettledGarments.of(body.shaped(shape), [dataset.take(takes[shape]) for takes in complete])
            for shape in shapes
        ]
        single = SettledGarments.of(body.shaped(), [dataset.take(takes[shapes[0]]) for takes in partial])
        rests = np.array([each.fit_rest(binding) for each in settled])
        rest = extend_to_all_betas(_rest_model(rests, betas, options), body, binding.nearest, dataset.garment.faces)
        others = [
            (pose, shape, name)
            for pose, takes in enumerate([*complete, *partial])
            for shape, name in takes.items()
            if shape != shapes[0] and (pose >= len(complete) or shape not in shapes)
        ]
        other_betas = pad_betas(_pad_rows([shape for _, shape, _ in others]), len(body.shapedirs))
        other_offsets = [
            SettledGarments.of(body.shaped(shape), [dataset.take(name)]).offsets(binding, at_rest.reshape(-1, 3))[0]
            for (_, shape, name), at_rest in zip(others, rest.at(other_betas), strict=True)
        ]
        return cls(
            rotations=settled[0].rotations,
            betas=betas,
            rest=rest,
            offsets=_offsets(binding, settled, rest.at(betas)),
            single_rotations=single.rotations,
            single_offsets=single.offsets(binding, rest.at(betas[:1])[0].reshape(-1, 3)),
            other_poses=np.array([pose for pose, _, _ in others], int),
            other_betas=other_betas,
            other_offsets=np.array(other_offsets, np.float32).reshape(-1, *first.vertices[0].shape),
            sensitivity=_sensitivity(upright, body, binding),
            binding=binding,
            body=body,
            groups=np.arange(len(complete) + len(partial)),
        )

    def changes(
        self,
    ) -> tuple[Int[np.ndarray, " samples"], Float[np.ndarray, "samples betas"], Float[np.ndarray, "samples rows"]]:
        """Returns pose, betas and change from the mean shape [m] of each garment on a body of another shape."""
        count, shapes = self.offsets.shape[:2]
        mean = np.concatenate([self.offsets[:, 0], self.single_offsets])
        poses = np.concatenate([np.repeat(np.arange(count), shapes - 1), self.other_poses])
        known = max(self.betas.shape[1], self.other_betas.shape[1] if len(self.other_betas) else 0)
        spread = np.tile(pad_betas(self.betas[1:], known), (count, 1))
        betas = np.concatenate([spread, pad_betas(self.other_betas, known)])
        offsets = np.concatenate([self.offsets[:, 1:].reshape(-1, *mean.shape[1:]), self.other_offsets])
        order = np.argsort(poses, kind="stable")
        changes = (offsets[order] - mean[poses[order]]).reshape(len(order), -1)
        return poses[order], betas[order], changes.astype(np.float64)

    def subset(self, anchors: Int[np.ndarray, " some"], singles: Int[np.ndarray, " some_singles"]) -> "AnchorSet":
        """Returns a subset of the anchors and of the single poses."""
        kept = np.concatenate([anchors, len(self.rotations) + singles]).astype(int)
        new_index = np.full(len(self.rotations) + len(self.single_rotations), -1)
        new_index[kept] = np.arange(len(kept))
        others = np.flatnonzero(new_index[self.other_poses] >= 0)
        others = others[np.argsort(new_index[self.other_poses[others]], kind="stable")]
        return replace(
            self,
            rotations=self.rotations[anchors],
            offsets=self.offsets[anchors],
            single_rotations=self.single_rotations[singles],
            single_offsets=self.single_offsets[singles],
            other_poses=new_index[self.other_poses[others]],
            other_betas=self.other_betas[others],
            other_offsets=self.other_offsets[others],
            groups=self.groups[kept],
        )


def _offsets(
    binding: Binding, settled: list[SettledGarments], rests: Float[np.ndarray, "shapes rows"]
) -> Float[np.ndarray, "anchors shapes verts 3"]:
    offsets = [each.offsets(binding, rest.reshape(-1, 3)) for each, rest in zip(settled, rests, strict=True)]
    return np.stack(offsets, axis=1)


def _rest_model(
    rests: Float[np.ndarray, "shapes rows"], betas: Float[np.ndarray, "shapes betas"], options: AgentDressConfig
) -> ShapeModel:
    """Returns the shape model of the garment at rest for the betas of the anchors, for none if there is one shape."""
    if len(rests) == 1:
        return ShapeModel(rests[0], np.zeros((0, rests.shape[1])), 1.0)
    return ShapeModel.fit(rests, betas, components=options.shape_components, ridge=options.shape_ridge)


def _shapes_of_anchors(poses: Sequence[Collection[tuple[float, ...]]]) -> list[tuple[float, ...]]:
    """Returns the shapes of the anchors, the mean one first: those that give the largest complete table of poses.

    Bodies besides the mean one count, since a table of the mean shape alone has no effect of shapes. If there is no
    other shape, it is the mean one alone.

    Random bodies occur in one pose each, or in a few after several runs of `hemline drape`. Poses in which the garment
    did not always come to rest occur on some of the shapes.

    Args:
        poses: Shapes on which the garment came to rest, for each pose.
    """
    counts = Counter(shape for shapes in poses for shape in shapes)
    if set(counts) == {()}:
        return [()]
    best: tuple[int, set[tuple[float, ...]]] = 0, set()
    for least in sorted({count for count in counts.values() if count > 1}):
        shapes = {shape for shape, count in counts.items() if count >= least}
        size = (len(shapes) - 1) * sum(shapes <= set(of_pose) for of_pose in poses)
        best = max(best, (size, shapes), key=lambda each: each[0])
    return sorted(best[1], key=lambda each: (any(each), each))


def _trim_zeros(betas: Iterable[float]) -> tuple[float, ...]:
    """Returns the betas without trailing zeros."""
    return tuple(float(beta) for beta in np.trim_zeros(np.asarray(list(betas), np.float32), "b"))


def _pad_rows(shapes: list[tuple[float, ...]]) -> Float[np.ndarray, "shapes betas"]:
    """Pads all rows with zeros to the length of the longest."""
    count = max([1, *(len(shape) for shape in shapes)])
    return np.array([[*shape, *[0.0] * (count - len(shape))] for shape in shapes]).reshape(-1, count)


def _takes(dataset: Dataset) -> tuple[list[Take], dict[str, dict[tuple[float, ...], str]]]:
    """Returns the T-poses with derivatives, the mean shape first, and the names of other takes by pose and shape."""
    by_pose: dict[str, dict[tuple[float, ...], str]] = {}
    upright = []
    for row in dataset.anchors():
        take = dataset.take(row)
        if "turn.0.0" in take.derivatives:
            if is_t_pose(take.motion[0]):
                upright.append(take)
        else:
            by_pose.setdefault(take.motion[0].hash, {})[_trim_zeros(row.betas)] = row.name
    if not upright:
        raise BadDataset("no anchor in the T-pose with derivatives", dataset.folder, f"run '{DRAPE_COMMAND}'")
    return sorted(upright, key=lambda take: float(np.abs(take.betas).max(initial=0))), by_pose


def is_t_pose(pose: Pose) -> bool:
    """Whether no joint is rotated."""
    return bool((np.abs(pose.rotations[:, 0]) > 1 - 1e-6).all())


def _sensitivity(upright: list[Take], body: Body, binding: Binding) -> tuple[np.ndarray, np.ndarray]:
    total, relative = [], []
    for take in upright:
        cloth = derivatives_by_joint(take, body)
        total.append(np.linalg.norm(cloth, axis=3))
        skin = _skin_derivatives(body.shaped(take.betas), take.motion[0], binding)
        relative.append(np.linalg.norm(cloth - skin, axis=3))
    return np.mean(total, axis=0).transpose(2, 0, 1), np.mean(relative, axis=0).transpose(2, 0, 1)


def _skin_derivatives(shaped: ShapedBody, pose: Pose, binding: Binding) -> Float[np.ndarray, "joints 3 verts 3"]:
    """Returns the motion of the skin under each vertex per rotation of a joint [m/rad]."""
    from hemline.bodies.velocities import turning_velocity

    posed, joints = shaped.posed(pose), len(pose.rotations)
    return np.stack(
        [[turning_velocity(posed, joint, axis)[binding.nearest] for axis in np.eye(3)] for joint in range(joints)]
    )
