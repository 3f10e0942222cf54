"""The anchors of a dataset: in which poses, on which shapes, and how the garment lies there."""

from collections import Counter
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hemline import bodies
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

COMMAND = "hemline drape GARMENT --anchors 150 --motion FILE..."


@dataclass(frozen=True)
class AnchorSet:
    """Anchors whose garment came to rest on every shape, and poses in which it did on the mean one and on some others.

    Attributes:
        rotations: Of the anchors' poses.
        betas: The shapes, the mean one first; as many betas as any of them has.
        rest: The garment in the rest pose, by shape: of each, what skinning carries nearest to all its anchors [m].
        offsets: How far the garment of each anchor on each shape is from `rest`, carried along, in the turned frames of
            its binding [m].
        single_rotations: The other poses.
        single_offsets: The same there, on the mean shape [m].
        other_poses: Garments on bodies of other shapes: of each the number of its pose, the anchors first, rising.
        other_betas: Their shapes: all betas of the body.
        other_offsets: The same of each of them [m].
        sensitivity: How far each vertex moves when a joint turns [m/rad]: of all of its way; and less what the skin
            under it does.
        binding: Of the garment, from the T-pose on the mean shape.
        together: A number for each pose, the anchors first. Neighbours that share one tell of each other, and are left
            out together where a fit is judged by what it misses of them.
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
    groups: Int[np.ndarray, " poses"]

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
        shapes = _shapes_of_anchors(list(by_pose.values()))
        whole = [found for found in by_pose.values() if all(shape in found for shape in shapes)]
        if len(whole) < 2 or not shapes or shapes[0]:
            raise BadDataset(
                "fewer than two anchors on all shapes", len(whole), "run 'hemline drape --anchors' to its end"
            )
        fewer = [
            found for found in by_pose.values() if shapes[0] in found and not all(each in found for each in shapes)
        ]
        betas = _pad_rows(shapes)
        settled = [SettledGarments.of(body.shaped(shape), [dataset.take(found[shape]) for found in whole]) for shape in shapes]
        single = SettledGarments.of(body.shaped(), [dataset.take(found[shapes[0]]) for found in fewer])
        carried = np.array([each.fit_rest(binding) for each in settled])
        fitted = ShapeModel.fit(carried, betas, components=options.shape_components, ridge=options.shape_ridge)
        rest = extend_to_all_betas(fitted, body, binding.nearest, dataset.garment.faces)
        others = [
            (pose, shape, name)
            for pose, found in enumerate([*whole, *fewer])
            for shape, name in found.items()
            if shape != shapes[0] and (pose >= len(whole) or shape not in shapes)
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
            together=np.arange(len(whole) + len(fewer)),
        )

    def changes(
        self,
    ) -> tuple[Int[np.ndarray, " samples"], Float[np.ndarray, "samples betas"], Float[np.ndarray, "samples rows"]]:
        """Of each garment on a body of another shape than the mean one: its pose, its betas, and what they add [m]."""
        count, shapes = self.offsets.shape[:2]
        mean = np.concatenate([self.offsets[:, 0], self.single_offsets])
        poses = np.concatenate([np.repeat(np.arange(count), shapes - 1), self.other_poses])
        known = max(self.betas.shape[1], self.other_betas.shape[1] if len(self.other_betas) else 0)
        spread = np.tile(pad_betas(self.betas[1:], known), (count, 1))
        betas = np.concatenate([spread, pad_betas(self.other_betas, known)])
        worn = np.concatenate([self.offsets[:, 1:].reshape(-1, *mean.shape[1:]), self.other_offsets])
        order = np.argsort(poses, kind="stable")
        added = (worn[order] - mean[poses[order]]).reshape(len(order), -1)
        return poses[order], betas[order], added.astype(np.float64)

    def subset(self, anchors: Int[np.ndarray, " some"], singles: Int[np.ndarray, " some_singles"]) -> "AnchorSet":
        """Some of the anchors, and some of the poses beside them: what fewer would tell."""
        kept = np.concatenate([anchors, len(self.rotations) + singles]).astype(int)
        now = np.full(len(self.rotations) + len(self.single_rotations), -1)
        now[kept] = np.arange(len(kept))
        others = np.flatnonzero(now[self.other_poses] >= 0)
        others = others[np.argsort(now[self.other_poses[others]], kind="stable")]
        return replace(
            self,
            rotations=self.rotations[anchors],
            offsets=self.offsets[anchors],
            single_rotations=self.single_rotations[singles],
            single_offsets=self.single_offsets[singles],
            other_poses=now[self.other_poses[others]],
            other_betas=self.other_betas[others],
            other_offsets=self.other_offsets[others],
            together=self.groups[kept],
        )


def _offsets(
    binding: Binding, settled: list[SettledGarments], rests: Float[np.ndarray, "shapes rows"]
) -> Float[np.ndarray, "anchors shapes verts 3"]:
    found = [each.offsets(binding, rest.reshape(-1, 3)) for each, rest in zip(settled, rests, strict=True)]
    return np.stack(found, axis=1)


def _shapes_of_anchors(poses: Sequence[Collection[tuple[float, ...]]]) -> list[tuple[float, ...]]:
    """The shapes on which anchors were settled, the mean one first: those that make the largest full table of poses.

    Random bodies are in one pose each, or in a few where `hemline drape` was run again with more; poses that were given
    up are settled on some of the shapes.

    Args:
        poses: The shapes on which the garment came to rest in each pose.
    """
    often = Counter(shape for shapes in poses for shape in shapes)
    best: tuple[int, set[tuple[float, ...]]] = 0, set()
    for least in sorted({count for count in often.values() if count > 1}):
        shapes = {shape for shape, count in often.items() if count >= least}
        size = len(shapes) * sum(shapes <= set(found) for found in poses)
        best = max(best, (size, shapes), key=lambda each: each[0])
    return sorted(best[1], key=lambda each: (any(each), each))


def _trim_zeros(betas: Iterable[float]) -> tuple[float, ...]:
    """Without zeros at the end."""
    return tuple(float(beta) for beta in np.trim_zeros(np.asarray(list(betas), np.float32), "b"))


def _pad_rows(shapes: list[tuple[float, ...]]) -> Float[np.ndarray, "shapes betas"]:
    """As many betas of each as the longest has."""
    count = max([1, *(len(shape) for shape in shapes)])
    return np.array([[*shape, *[0.0] * (count - len(shape))] for shape in shapes]).reshape(-1, count)


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
            by_pose.setdefault(take.motion[0].hash, {})[_trim_zeros(row.betas)] = row.name
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
        skinned = _skin_derivatives(body.shaped(take.betas), take.motion[0], binding)
        beside.append(np.linalg.norm(moved - skinned, axis=3))
    return np.mean(whole, axis=0).transpose(2, 0, 1), np.mean(beside, axis=0).transpose(2, 0, 1)


def _skin_derivatives(shaped: ShapedBody, pose: Pose, binding: Binding) -> Float[np.ndarray, "joints 3 verts 3"]:
    """How the skin under each vertex moves when a joint turns [m/rad]."""
    from hemline.bodies.velocities import turning

    posed, joints = shaped.posed(pose), len(pose.rotations)
    return np.stack([[turning(posed, joint, axis)[binding.nearest] for axis in np.eye(3)] for joint in range(joints)])
