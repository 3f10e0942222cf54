"""The mesh that a garment is simulated with while a model is made: the garment itself, or a coarser copy of it."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from hemline.arrays import Int, Vertices
from hemline.collide import LengthLimits
from hemline.datasets import Dataset, Take, create, open_dataset, take_name
from hemline.datasets.take import take_metadata
from hemline.garments import Garment
from hemline.garments.proxy.coarser import coarser_garment
from hemline.garments.proxy.embedding import Embedding

MINUTE_VERTICES, LEAST_VERTICES = 150, 500
"""Number of simulated vertices for each minute that a run may take, and their least number."""
CARRIED_BY = "carried_by"
"""Input of a take of the garment that names the mesh which was simulated."""
LEAST_SAVING = 0.7
"""A coarser copy is used only if it has at most this fraction of the garment's vertices."""


@dataclass(frozen=True, eq=False)
class DataMesh:
    """A garment, and the mesh that is simulated for it.

    A coarse mesh costs a fraction of the time, so that a short run has several times as many poses and frames. Its
    vertices carry those of the garment along (`Embedding`), so that fits see the garment itself, without folds smaller
    than the coarse triangles. Where the coarse mesh bends, the carried edges are stretched by up to four times as much
    as its own, so they are then brought within their lengths (`LengthLimits`), by half a millimetre on average.

    Attributes:
        garment: The garment.
        simulated: The mesh that is simulated.
        vertex_ids: Index in the garment of each simulated vertex.
    """

    garment: Garment
    simulated: Garment
    vertex_ids: Int[np.ndarray, " simulated"]

    @classmethod
    def of(cls, garment: Garment, minutes: float) -> "DataMesh":
        """Returns the mesh for a run of so many minutes."""
        share = max(LEAST_VERTICES, MINUTE_VERTICES * minutes) / len(garment.vertices)
        return cls(garment, *coarser_garment(garment, share if share <= LEAST_SAVING else 1.0))

    @property
    def is_coarser(self) -> bool:
        """Whether another mesh than the garment is simulated."""
        return self.simulated is not self.garment

    @property
    def cost_ratio(self) -> float:
        """Largest time of a simulated frame of the garment, over that of the simulated mesh."""
        return len(self.garment.vertices) / len(self.simulated.vertices)

    def _embedding(self, rest: Vertices) -> Embedding:
        """Returns the garment in the simulated mesh, both as the garment has settled.

        As it was put on, short edges may be several times too long, and would stay so in all frames.
        """
        settled = replace(self.simulated, vertices=np.ascontiguousarray(rest[self.vertex_ids]))
        return Embedding.of(replace(self.garment, vertices=rest), settled, self.vertex_ids)

    def carry(self, data: Dataset, folder: Path, rest: Vertices) -> None:
        """Writes takes of the simulated mesh as takes of the garment into a dataset; existing ones are kept.

        Args:
            data: Dataset of the simulated mesh.
            folder: Dataset of the garment; created if missing.
            rest: The garment settled on its body (verts, 3) [m].
        """
        embedding, limits = self._embedding(rest), LengthLimits.of(self.garment, rest)
        carried = create(folder, self.garment)
        for row in data.rows():
            inputs = take_metadata(data.path(row.name))["inputs"] | self._names
            if not carried.path(take_name(inputs)).exists():
                carried.add(_carry_take(embedding, limits, data.take(row), inputs))

    def remove_others(self, folder: Path) -> None:
        """Deletes takes of the garment that another mesh carried, from a dataset that may not exist.

        A run of another length simulates another mesh, and fits do not mix the two.
        """
        if not (folder / "garment.safetensors").exists():
            return
        data = open_dataset(folder)
        for row in data.rows():
            if take_metadata(data.path(row.name))["inputs"].get(CARRIED_BY, self.simulated.hash) != self.simulated.hash:
                data.path(row.name).unlink()

    @property
    def _names(self) -> dict[str, str]:
        return {"garment": self.garment.hash, CARRIED_BY: self.simulated.hash}


def _carry_take(embedding: Embedding, limits: LengthLimits, take: Take, inputs: dict[str, Any]) -> Take:
    """Returns a take of the garment, from one of the simulated mesh."""
    vertices = np.stack([limits.hold(embedding.fine_vertices(each)) for each in take.vertices])
    derivatives = {name: _carried_mean(embedding, each) for name, each in take.derivatives.items()}
    return replace(take, vertices=vertices, derivatives=derivatives, inputs=inputs, end_state={})


def _carried_mean(embedding: Embedding, values: Vertices) -> Vertices:
    """Returns the weighted mean of what the carriers of each vertex have (verts, 3), float32."""
    return np.einsum("vk,vkx->vx", embedding.weights, values[embedding.near]).astype(np.float32)
