"""From a garment that was settled in other materials, too, to what a material adds in any pose."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from hemline import bodies
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
    """What other materials change on the mean shape.

    Attributes:
        own: The material of the fit.
        known: Names of the others.
        poses: In which pose of the fit each garment was settled, rising.
        where: Its material, see `coordinates`.
        added: What it adds to the garment of the fit, in turned frames [m].
    """

    own: Material
    known: tuple[str, ...]
    poses: Int[np.ndarray, " samples"]
    coordinates: Float[np.ndarray, "samples 3"]
    added: Float[np.ndarray, "samples rows"]

    @classmethod
    def of(cls, garment: Garment, anchors: AnchorSet, others: Sequence[Dataset]) -> Self:
        """Read them.

        Args:
            garment: That of the fit.
            anchors: How it lies in each pose.
            others: Datasets of the same garment, each of another material.

        Raises:
            BadDataset: Another garment; or one was settled in no pose of the fit.
        """
        rotations = np.concatenate([anchors.rotations, anchors.single_rotations])
        worn = np.concatenate([anchors.offsets[:, 0], anchors.single_offsets]).reshape(len(rotations), -1)
        rest = anchors.rest.mean.reshape(-1, 3)
        poses: list[int] = []
        where: list[np.ndarray] = []
        added: list[np.ndarray] = []
        for dataset in others:
            if dataset.garment.in_material(garment.material).hash != garment.hash:
                got = f"'{dataset.garment.name}' of {dataset.folder}"
                cure = "name datasets of one garment: of its own material first, then of others"
                raise BadDataset(f"AgentDress is fitted to one garment, '{garment.name}'", got, cure)
            rows = [row for row in dataset.anchors() if not np.any(row.betas)]
            settled = SettledGarments.of(bodies.load(garment.body_name).shaped(), [dataset.take(row) for row in rows])
            apart = np.abs(rotations[:, None] - settled.rotations).max(axis=(2, 3), initial=0)
            known = np.flatnonzero((apart == 0).any(axis=0))
            if not len(known):
                cure = "make them with 'hemline drape --material NAME --poses-of' the first dataset"
                raise BadDataset(f"{dataset.folder} has no pose of the fit", f"{len(rows)} others", cure)
            lying = settled.offsets(anchors.binding, rest).reshape(len(rows), -1)[known]
            here = apart[:, known].argmin(axis=0)
            poses += here.tolist()
            where += [material_coordinates(dataset.garment.material, garment.material)] * len(here)
            added += list(lying - worn[here])
        order = np.argsort(poses, kind="stable")
        return cls(
            garment.material,
            tuple(each.garment.material.name for each in others),
            np.array(poses)[order],
            np.array(where, np.float64)[order],
            np.array(added, np.float64)[order],
        )


def fit_materials(
    changes: MaterialChanges,
    outputs: Float[np.ndarray, "samples modes"],
    distances: Float[np.ndarray, "poses regions poses"],
    together: Int[np.ndarray, " poses"],
    basis: Float[np.ndarray, "modes rows"],
    regions: Float[np.ndarray, "verts regions"],
) -> tuple[Materials, dict[str, float]]:
    """What a material adds, as it is played; and what the fit reached.

    Args:
        changes: What is learned from.
        outputs: The same, as coefficients of the basis [m].
        distances: Between all poses, squared, in each region.
        together: Poses that are left out together, see `AnchorSet.together`.
        basis: Directions of the garment, one a row.
        regions: Share of each region in each vertex.
    """
    given = ShapeChanges(changes.poses, changes.coordinates, outputs, together[changes.poses])
    found, missed_mm = best_shape_kernel(distances, given, basis, regions)
    samples = ShapeSamples(
        changes.poses.astype(np.int32),
        changes.coordinates.astype(np.float32),
        found.weights.astype(np.float32),
        np.eye(changes.coordinates.shape[1], dtype=np.float32),
    )
    figures = {
        "materials": float(len(changes.known)),
        "material_kernel_width": found.width,
        "material_kernel_ridge": found.ridge,
        "material_change_left_out_mm": missed_mm,
        "material_change_mm": 1e3 * float(np.linalg.norm(changes.added.reshape(len(outputs), -1, 3), axis=2).mean()),
    }
    return Materials(changes.own, changes.known, samples, found.width), figures
