"""The fit of material effects to a garment that was draped in several materials."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from hemline.animators.agentdress.materials import Materials, material_coordinates
from hemline.animators.agentdress.shape_samples import ShapeSamples
from hemline.arrays import Float, Int
from hemline.datasets import Dataset
from hemline.errors import BadDataset
from hemline.garments.garment import Garment
from hemline.garments.material import Material

from .anchor_set import AnchorSet
from .settled_garments import SettledGarments
from .shape_kernel import ShapeChanges, best_shape_kernel


@dataclass(frozen=True)
class MaterialChanges:
    """Changes of the garment on the mean shape in other materials.

    Attributes:
        own: The material of the fit.
        known: Names of the other materials.
        poses: Pose of the fit in which each garment was draped, ascending.
        coordinates: Material of each garment, see `material_coordinates`.
        added: Change from the garment of the fit, in rotated vertex frames [m].
    """

    own: Material
    known: tuple[str, ...]
    poses: Int[np.ndarray, " samples"]
    coordinates: Float[np.ndarray, "samples 3"]
    added: Float[np.ndarray, "samples rows"]

    @classmethod
    def of(cls, garment: Garment, anchors: AnchorSet, others: Sequence[Dataset]) -> Self:
        """Reads the changes from datasets of other materials.

        Args:
            garment: The garment of the fit.
            anchors: Its anchors.
            others: Datasets of the same garment, each in another material.

        Raises:
            BadDataset: A dataset has another garment, or no pose of the fit.
        """
        rotations = np.concatenate([anchors.rotations, anchors.single_rotations])
        offsets = np.concatenate([anchors.offsets[:, 0], anchors.single_offsets]).reshape(len(rotations), -1)
        rest = anchors.rest.mean.reshape(-1, 3)
        poses: list[int] = []
        positions: list[np.ndarray] = []
        added: list[np.ndarray] = []
        for dataset in others:
            if dataset.garment.in_material(garment.material).hash != garment.hash:
                got = f"'{dataset.garment.name}' of {dataset.folder}"
                cure = "name datasets of one garment: of its own material first, then of others"
                raise BadDataset(f"AgentDress is fitted to one garment, '{garment.name}'", got, cure)
            rows = [row for row in dataset.anchors() if not np.any(row.betas)]
            settled = SettledGarments.of(dataset.body.shaped(), [dataset.take(row) for row in rows])
            distances = np.abs(rotations[:, None] - settled.rotations).max(axis=(2, 3), initial=0)
            known = np.flatnonzero((distances == 0).any(axis=0))
            if not len(known):
                cure = "make them with 'hemline drape --material NAME --poses-of' the first dataset"
                raise BadDataset(f"{dataset.folder} has no pose of the fit", f"{len(rows)} others", cure)
            of_material = settled.offsets(anchors.binding, rest).reshape(len(rows), -1)[known]
            indices = distances[:, known].argmin(axis=0)
            poses += indices.tolist()
            positions += [material_coordinates(dataset.garment.material, garment.material)] * len(indices)
            added += list(of_material - offsets[indices])
        order = np.argsort(poses, kind="stable")
        return cls(
            garment.material,
            tuple(data.garment.material.name for data in others),
            np.array(poses)[order],
            np.array(positions, np.float64)[order],
            np.array(added, np.float64)[order],
        )


def fit_materials(
    changes: MaterialChanges,
    outputs: Float[np.ndarray, "samples modes"],
    distances: Float[np.ndarray, "poses regions poses"],
    groups: Int[np.ndarray, " poses"],
    basis: Float[np.ndarray, "modes rows"],
    regions: Float[np.ndarray, "verts regions"],
) -> tuple[Materials, dict[str, float]]:
    """Fits the effect of materials; returns it with the figures of the fit.

    Args:
        changes: Changes in other materials.
        outputs: These changes as coefficients of the basis [m].
        distances: Squared distances between all poses, per region.
        groups: Poses that are left out together, see `AnchorSet.groups`.
        basis: Modes of the garment, one per row.
        regions: Weight of each region at each vertex.
    """
    training = ShapeChanges(changes.poses, changes.coordinates, outputs, groups[changes.poses])
    best, error_mm = best_shape_kernel(distances, training, basis, regions)
    samples = ShapeSamples(
        changes.poses.astype(np.int32),
        changes.coordinates.astype(np.float32),
        best.weights.astype(np.float32),
        np.eye(changes.coordinates.shape[1], dtype=np.float32),
        sizes=np.stack([each.sizes for each in best.packed]),
        steps=np.stack([each.steps for each in best.packed]),
    )
    figures = {
        "materials": float(len(changes.known)),
        "material_kernel_width": best.width,
        "material_kernel_ridge": best.ridge,
        "material_change_left_out_mm": error_mm,
        "material_change_mm": 1e3 * float(np.linalg.norm(changes.added.reshape(len(outputs), -1, 3), axis=2).mean()),
    }
    return Materials(changes.own, changes.known, samples, best.width), figures
