"""The system of the AgentDress paper as one model: its shape models, its pose model (SOR), its distances, its blend.

It is made of the functions of `synthesis.py`, and judged beside ours on every page of errors. What the paper leaves
open is chosen as follows, and stated on the page: joint angles are components of rotation vectors; the small number of
the blend weights is 1e-6 of the median distance; the stiffness of the rigging has the least leave-one-out error. For
betas beyond the four of the anchors, which the paper does not have, cloth moves with the skin under it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Self

import numpy as np

from hemline.animators.agentdress.shape_model import ShapeModel
from hemline.animators.agentdress.sor.rigging import Rigging, relative_transforms, skin_points
from hemline.arrays import Float, Int, Transforms
from hemline.bodies.body import Body, PosedBody, ShapedBody
from hemline.datasets import Dataset, Row
from hemline.datasets.joint_sensitivity import derivatives_by_joint, mean_sensitivity
from hemline.motions.motion import JOINT_COUNT, JOINT_NAMES, Pose
from hemline.motions.pose_clusters import without_heading
from papers.agentdress import synthesis

BETAS, COMPONENTS, RIDGE = 4, 5, 0.2
"""Number of betas of the anchors, of principal components, and the weight of the regularisation (section 3.2)."""

STIFFNESSES = (1e-4, 1e-2, 1.0)
"""Candidate stiffnesses of the skin weights of SOR."""

REGIONS = (
    ("spine1", "spine2", "spine3", "neck", "head", "left_collar", "right_collar", "pelvis"),
    ("left_shoulder",),
    ("right_shoulder",),
    ("left_elbow", "left_wrist", "left_hand"),
    ("right_elbow", "right_wrist", "right_hand"),
    ("left_hip", "left_knee", "left_ankle", "left_foot"),
    ("right_hip", "right_knee", "right_ankle", "right_foot"),
)
"""Bones of the seven regions (section 3.4, Fig. 4, where they are drawn and not listed)."""

T_POSE = np.tile([1.0, 0.0, 0.0, 0.0], (JOINT_COUNT, 1))


@dataclass(frozen=True, eq=False)
class PaperSystem:
    """The clothing of one garment for any body and pose, as in the paper.

    Attributes:
        body: The body.
        rotations: Poses of the anchors.
        shapes: Clothing shape model of each anchor.
        upright: Clothing shape model of the T-pose.
        sensitivity: Mean motion of each vertex by each joint angle in the T-pose [m/rad].
        rigging: The clothing pose model, SOR; one example for each anchor.
    """

    body: Body
    rotations: Float[np.ndarray, "anchors joints 4"]
    shapes: tuple[ShapeModel, ...]
    upright: ShapeModel
    sensitivity: Float[np.ndarray, "verts joints 3"]
    rigging: Rigging
    dressed: dict[tuple[bytes, bytes], "DressedAnchor"] = field(default_factory=dict, repr=False)
    """Anchors on bodies that were asked for before, by pose and betas. The paper, too, computes them once per body."""

    @classmethod
    def fit(cls, dataset: Dataset) -> Self:
        """Fits the system to the anchors of a dataset that were settled on all seventeen shapes, with derivatives.

        Args:
            dataset: A dataset made by `hemline drape --anchors --derivatives`.
        """
        drapes = _Drapes.read(dataset)
        body, shaped = dataset.body, dataset.body.shaped()
        takes = [dataset.take(row) for row in drapes.derivatives]
        poses = [take.motion[0] for take in takes]
        vertices = np.array([take.vertices[0] for take in takes], np.float64)
        own = [
            synthesis.bone_weights(shaped, synthesis.bind_to_skin(garment, shaped.posed(pose)))
            for garment, pose in zip(vertices, poses, strict=True)
        ]
        system = cls(
            body,
            np.array([pose.rotations for pose in poses], np.float64),
            tuple(_shape_model(dataset, rows) for rows in drapes.anchors),
            _shape_model(dataset, drapes.upright),
            mean_sensitivity([dataset.take(row) for row in drapes.upright], body),
            Rigging(np.zeros((0, JOINT_COUNT, 3, 4)), vertices, np.zeros((0, 0, 0))),
        )
        posed = [shaped.posed(pose) for pose in poses]

        def rigged(stiffness: float) -> Self:
            derivatives = (derivatives_by_joint(take, body) for take in takes)
            fitted = [
                Rigging.fit([each], garment[None], [target], start, stiffness)
                for each, garment, target, start in zip(posed, vertices, derivatives, own, strict=True)
            ]
            weights = np.concatenate([each.weights for each in fitted])
            transforms = np.concatenate([each.transforms for each in fitted])
            return replace(system, rigging=Rigging(transforms, vertices, weights))

        return min((rigged(each) for each in STIFFNESSES), key=lambda each: each.left_out_mm)

    @cached_property
    def left_out_mm(self) -> float:
        """Mean error of the pose model in the pose of each anchor, from the other anchors [m to mm]."""
        errors, mean = [], self.body.shaped()
        regions = self.regions_on(mean)
        for anchor, rotations in enumerate(self.rotations):
            others = self.subset(np.delete(np.arange(len(self.rotations)), anchor))
            pose = self._pose(rotations)
            away = others.pose_model(pose, others.weights(pose, regions)) - self.rigging.vertices[anchor]
            errors.append(1e3 * float(np.linalg.norm(away, axis=1).mean()))
        return float(np.mean(errors))

    def subset(self, some: Int[np.ndarray, " some"]) -> Self:
        """Returns the system with a subset of its anchors."""
        full = self.rigging
        rigging = Rigging(full.transforms[some], full.vertices[some], full.weights[some])
        shapes = tuple(self.shapes[anchor] for anchor in some)
        return replace(self, rotations=self.rotations[some], shapes=shapes, rigging=rigging)

    def drape(self, posed: PosedBody, posing: synthesis.Points | None = None) -> synthesis.Points:
        """Returns the garment on a body in a pose by Eq. 4, then Eq. 10 [m].

        Args:
            posed: The body in the pose, arms lifted as in the anchors.
            posing: The garment on the mean body in the pose [m], in the place of SOR; see section 4.4.
        """
        garment, near, weights = self.expand(posed, posing)
        initial = np.array([self.on_body(anchor, posed.shaped).clearances for anchor in near])
        return synthesis.restore_clearances(garment, initial, weights, posed)

    def expand(
        self, posed: PosedBody, posing: synthesis.Points | None = None
    ) -> tuple[synthesis.Points, Int[np.ndarray, " near"], Float[np.ndarray, "verts near"]]:
        """Returns the garment that Eq. 4 gives [m], the anchors that count, and their weights; see `drape`."""
        weights = self.weights(posed.pose, self.regions_on(posed.shaped))
        near = np.flatnonzero(weights.any(axis=0))
        shown = self.pose_model(posed.pose, weights) if posing is None else posing
        shaped = np.array([self.skinned(anchor, posed.shaped, posed.pose) for anchor in near])
        origins = np.array([self.skinned(anchor, self.body.shaped(), posed.pose) for anchor in near])
        return synthesis.blend_expansions(shown, shaped, origins, weights[:, near]), near, weights[:, near]

    def without_first_order(self, posed: PosedBody) -> synthesis.Points:
        """Returns the blend of skinned anchors of the mean body, the ablation of section 4.6 [m]."""
        weights = self.weights(posed.pose, self.regions_on(posed.shaped))
        near = np.flatnonzero(weights.any(axis=0))
        skinned = np.array([self.skinned(anchor, self.body.shaped(), posed.pose) for anchor in near])
        return np.einsum("va,avi->vi", weights[:, near], skinned)

    def skinned(self, anchor: int, shaped: ShapedBody, pose: Pose) -> synthesis.Points:
        """Returns the garment of an anchor on a body, skinned from the pose of the anchor into another pose [m]."""
        dressed = self.on_body(anchor, shaped)
        weights = synthesis.bone_weights(shaped, dressed.closest)
        return synthesis.skin_from_pose(dressed.garment, weights, dressed.transforms, shaped.posed(pose).transforms)

    def nearest(self, posed: PosedBody) -> synthesis.Points:
        """Returns the anchor with the largest weight, on a body, skinned into a pose [m]."""
        weights = self.weights(posed.pose, self.regions_on(posed.shaped))
        return self.skinned(int(weights.sum(axis=0).argmax()), posed.shaped, posed.pose)

    def on_body(self, anchor: int, shaped: ShapedBody) -> "DressedAnchor":
        """Returns an anchor on a body: the output of its shape model, and its binding information (section 3.4)."""
        rotations = self.rotations[anchor]
        key = rotations.tobytes(), shaped.betas.tobytes()
        if key not in self.dressed:
            posed = shaped.posed(self._pose(rotations))
            garment = self._shaped_garment(self.shapes[anchor], rotations, shaped)
            closest, heights = synthesis.bind_to_skin(garment, posed), synthesis.clearances(garment, posed)
            self.dressed[key] = DressedAnchor(garment, closest, heights, posed.transforms)
        return self.dressed[key]

    def _shaped_garment(
        self, model: ShapeModel, rotations: Float[np.ndarray, "joints 4"], shaped: ShapedBody
    ) -> synthesis.Points:
        pose = self._pose(rotations)
        posed, garment = shaped.posed(pose), model.at(shaped.betas[None])[0].reshape(-1, 3)
        if np.any(shaped.betas[BETAS:]):
            known = self.body.shaped(tuple(shaped.betas[:BETAS].tolist())).posed(pose)
            closest = synthesis.bind_to_skin(garment, known)
            garment = garment + (posed.vertices.astype(np.float64) - known.vertices)[closest]
        return synthesis.push_out_of_body(garment, posed)

    def pose_model(self, pose: Pose, weights: Float[np.ndarray, "verts anchors"]) -> synthesis.Points:
        """Returns the garment on the mean body in a pose by SOR [m]."""
        result, transforms = np.zeros_like(self.rigging.vertices[0]), self.body.shaped().posed(pose).transforms
        for anchor in np.flatnonzero(weights.any(axis=0)):
            relative = relative_transforms(transforms, self.rigging.transforms[anchor])
            skinned = skin_points(relative, self.rigging.weights[anchor], self.rigging.vertices[anchor])
            result += weights[:, anchor, None] * skinned
        return result

    def weights(self, pose: Pose, regions: Float[np.ndarray, "verts regions"]) -> Float[np.ndarray, "verts anchors"]:
        """Returns the weight of each anchor at each vertex in a pose, with the regions of a body (Eq. 7 and 8)."""
        influence = synthesis.joint_influence(regions, self.sensitivity)
        rotations = without_heading(pose.rotations[None].astype(np.float64))
        angles = synthesis.joint_angles(rotations, self.rotations)
        scale = np.median(synthesis.pose_distances(influence, self._angles_between_anchors), axis=1)
        blend = synthesis.blend_weights(synthesis.pose_distances(influence, angles), scale)
        return synthesis.vertex_weights(regions, blend)

    @cached_property
    def _angles_between_anchors(self) -> Float[np.ndarray, "pairs joints 3"]:
        angles = synthesis.joint_angles(self.rotations[:, None], self.rotations[None])
        return angles[~np.eye(len(angles), dtype=bool)]

    def _pose(self, rotations: Float[np.ndarray, "joints 4"]) -> Pose:
        """Returns a pose of an anchor at the place where garments were settled on bodies of all shapes."""
        return Pose(rotations, self.body.shaped().rest_pose.translation)

    def regions_on(self, shaped: ShapedBody) -> Float[np.ndarray, "verts regions"]:
        """Returns the weight of each region at each vertex, from the T-pose of a body."""
        garment = self._shaped_garment(self.upright, T_POSE, shaped)
        posed = shaped.posed(self._pose(T_POSE))
        bones = synthesis.bone_weights(shaped, synthesis.bind_to_skin(garment, posed))
        membership = np.array([[float(name in names) for names in REGIONS] for name in JOINT_NAMES])
        return bones @ membership


@dataclass(frozen=True)
class DressedAnchor:
    """The garment of an anchor on a body [m], its closest body vertices and clearances [m], and the skin transforms."""

    garment: synthesis.Points
    closest: Int[np.ndarray, " verts"]
    clearances: Float[np.ndarray, " verts"]
    transforms: Transforms


@dataclass(frozen=True)
class _Drapes:
    """Rows of a dataset: T-poses, anchors on all shapes (a list for each pose), and their takes with derivatives."""

    upright: list[Row]
    anchors: list[list[Row]]
    derivatives: list[Row]

    @classmethod
    def read(cls, dataset: Dataset) -> Self:
        by_pose: dict[str, dict[str, list[Row]]] = {}
        upright: list[Row] = []
        for row in dataset.anchors():
            if any(row.betas[BETAS:]):
                continue
            take = dataset.take(row)
            if np.abs(take.motion.rotations[0] - T_POSE).max() < 1e-6:
                upright.append(row)
                continue
            kind = "derivatives" if take.derivatives else "plain"
            by_pose.setdefault(take.motion[0].hash, {}).setdefault(kind, []).append(row)
        most = max(len(of_pose.get("plain", ())) for of_pose in by_pose.values())
        complete = [each for each in by_pose.values() if len(each.get("plain", ())) == most and "derivatives" in each]
        return cls(upright, [each["plain"] for each in complete], [each["derivatives"][0] for each in complete])


def _shape_model(dataset: Dataset, rows: Sequence[Row]) -> ShapeModel:
    takes = [dataset.take(row) for row in rows]
    garments = np.array([take.vertices[0].ravel() for take in takes], np.float64)
    betas = np.array([take.betas[:BETAS] for take in takes], np.float64)
    return ShapeModel.fit(garments, betas, components=COMPONENTS, ridge=RIDGE)
