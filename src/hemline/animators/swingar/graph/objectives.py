"""What the two stages of the estimator's training minimise."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from hemline.arrays import Int
from hemline.learning.collision import missing

from .estimator import Estimator, GarmentCode
from .losses import LossWeights, bend_loss, edge_loss, gravity_loss, vertex_loss
from .samples import FrameBatch, GarmentSample, Samples

SUPERVISED = LossWeights(edge=0.0, bend=0.0, gravity=0.0, collision=0.0)
"""The vertex term alone, with which a training begins."""
MARGIN = 0.002
"""Distance that vertices should keep from the body [m]."""


@dataclass(frozen=True)
class Groups:
    """How samples are drawn: some frames of one garment at a time, as a garment is encoded once for all of them."""

    frames: int = 8
    """Frames of one garment together."""
    epoch: int = 100
    """Groups in an epoch."""
    validation: int = 12
    """Frames of each garment of the validation set that are looked at, evenly over its samples."""


class _Stage:
    """What both stages share: a Trainer's samples are groups; which frames they hold is drawn when they are used."""

    def __init__(self, estimator: Estimator, samples: Samples, groups: Groups, weights: LossWeights):
        self.estimator, self.data, self.groups, self.weights = estimator, samples, groups, weights
        self._training = _by_garment(samples, samples.training)
        self._shares = np.array([len(each) for each in self._training], float) / len(samples.training)
        self._sheets = [_Sheet.of(garment) for garment in samples.garments]

    @property
    def samples(self) -> np.ndarray:
        """Numbers of groups."""
        return np.arange(self.groups.epoch)

    def loss(self, chosen: np.ndarray, random: np.random.Generator, mine: slice) -> Tensor:
        """The weighted terms, mean over the groups of a batch."""
        drawn = [self._drawn(random) for _ in chosen]
        return torch.stack([self._terms(frames) for frames in drawn[mine]]).mean()

    def validation_loss(self, random: np.random.Generator) -> Tensor:
        """Mean distance of vertices [m], mean over garments."""
        return torch.tensor(self.errors()).mean()

    def errors(self) -> list[float]:
        """Mean distance of vertices on each garment of the validation set [m]."""
        with torch.no_grad():
            return [float(self._distances(frames)) for frames in validation_frames(self.data, self.groups)]

    def predicted(self, chosen: np.ndarray, batch: FrameBatch) -> Tensor:
        """The garment in some frames of one garment (frames, verts, 3) [m]."""
        raise NotImplementedError

    def _drawn(self, random: np.random.Generator) -> np.ndarray:
        members = self._training[random.choice(len(self._shares), p=self._shares)]
        return np.sort(random.choice(members, min(self.groups.frames, len(members)), replace=False))

    def _distances(self, chosen: np.ndarray) -> Tensor:
        batch = self.data.frames(chosen)
        return (self.predicted(chosen, batch) - torch.from_numpy(batch.truth)).norm(dim=-1).mean()

    def _terms(self, chosen: np.ndarray) -> Tensor:
        batch = self.data.frames(chosen)
        vertices, truth = self.predicted(chosen, batch), torch.from_numpy(batch.truth)
        sheet, w = self._sheets[int(self.data.garment_of[chosen[0]])], self.weights
        total = w.vertex * vertex_loss(vertices, truth)
        if w.edge:
            total = total + w.edge * edge_loss(vertices, truth, sheet.edges)
        if w.bend:
            total = total + w.bend * bend_loss(vertices, sheet.faces, sheet.beside)
        if w.gravity:
            total = total + w.gravity * gravity_loss(vertices, sheet.mass)
        if w.collision and batch.normals is not None and batch.heights is not None:
            normals, heights = torch.from_numpy(batch.normals), torch.from_numpy(batch.heights)
            total = total + w.collision * missing(vertices - truth, normals, heights, MARGIN).square().mean()
        return total


class CoarseObjective(_Stage):
    """The coarse mesh, on sparse frames that do not depend on each other."""

    name = "coarse predictor"

    @property
    def parameters(self) -> Sequence[Tensor]:
        """Encoders of garment, shape and motion, and the coarse predictor."""
        return self.estimator.coarse_parameters()

    def predicted(self, chosen: np.ndarray, batch: FrameBatch) -> Tensor:
        """The coarse meshes."""
        code = encoded(self.estimator, self.data.garments[int(self.data.garment_of[chosen[0]])])
        return _coarse(self.estimator, code, batch)


class CorrectiveObjective(_Stage):
    """The corrective displacement, on coarse meshes that no longer change: they are made once."""

    name = "corrective predictor"

    def __init__(self, estimator: Estimator, samples: Samples, groups: Groups, weights: LossWeights):
        super().__init__(estimator, samples, groups, weights)
        with torch.no_grad():
            self._codes = [encoded(estimator, garment) for garment in samples.garments]
        self._known: dict[int, tuple[np.ndarray, ...]] = {}

    @property
    def parameters(self) -> Sequence[Tensor]:
        """The encoder of the body, and the corrective predictor."""
        return self.estimator.corrective_parameters()

    def predicted(self, chosen: np.ndarray, batch: FrameBatch) -> Tensor:
        """The coarse meshes with the displacement added."""
        code = self._codes[self.data.garment_of[chosen[0]]]
        times = np.concatenate([self.data.before[chosen][:, ::-1], chosen[:, None]], axis=1)
        self._make(np.array([i for i in np.unique(times).tolist() if i not in self._known], np.int64))
        meshes, joints, heading = (
            torch.from_numpy(np.stack([[self._known[i][part] for i in row] for row in times.tolist()]))
            for part in range(3)
        )
        turned = torch.from_numpy(batch.heading).transpose(1, 2)[:, None] @ heading
        meshes, joints = (each.float() @ turned.transpose(2, 3) for each in (meshes, joints))
        return meshes[:, -1] + self.estimator.corrective(code, meshes, joints, torch.from_numpy(batch.body))

    def _make(self, unknown: np.ndarray) -> None:
        """Make coarse meshes that are not known yet; they are kept as float16."""
        for members in _by_garment(self.data, unknown):
            for first in range(0, len(members), self.groups.frames):
                chosen = members[first : first + self.groups.frames]
                batch = self.data.frames(chosen)
                with torch.no_grad():
                    code = self._codes[self.data.garment_of[chosen[0]]]
                    made = _coarse(self.estimator, code, batch).numpy().astype(np.float16)
                self._known |= dict(
                    zip(chosen.tolist(), zip(made, batch.joints, batch.heading, strict=True), strict=True)
                )


def encoded(estimator: Estimator, garment: GarmentSample) -> GarmentCode:
    """A garment of a training set, encoded."""
    each = (torch.from_numpy(part) for part in (garment.features, garment.descriptor, garment.skin_logits))
    return estimator.garment(garment.graph, *each)


def validation_frames(samples: Samples, groups: Groups) -> Iterator[Int[np.ndarray, " frames"]]:
    """Some samples of each garment of the validation set, evenly over all it has, as sample numbers."""
    for members in _by_garment(samples, samples.validation):
        if len(members):
            yield members[np.unique(np.linspace(0, len(members) - 1, groups.validation).round().astype(int))]


def _coarse(estimator: Estimator, code: GarmentCode, batch: FrameBatch) -> Tensor:
    lag = None if batch.lag is None else torch.from_numpy(batch.lag)
    return estimator.coarse(code, torch.from_numpy(batch.motion), lag, torch.from_numpy(batch.transforms))[0]


def _by_garment(samples: Samples, chosen: np.ndarray) -> list[np.ndarray]:
    of = samples.garment_of[chosen]
    return [np.sort(chosen[of == i]) for i in range(len(samples.garments))]


@dataclass(frozen=True, eq=False)
class _Sheet:
    """What the loss terms know of a mesh, as tensors."""

    faces: Tensor
    edges: Tensor
    beside: Tensor
    mass: Tensor

    @classmethod
    def of(cls, garment: GarmentSample) -> "_Sheet":
        faces = np.asarray(garment.faces, np.int64)
        corners = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
        found, number = np.unique(corners, axis=0, return_inverse=True)
        order = np.argsort(number, kind="stable")
        same = np.flatnonzero(np.diff(number[order]) == 0)
        beside = np.stack([order[same], order[same + 1]], axis=1) % len(faces)
        return cls(*(torch.from_numpy(each) for each in (faces, found, beside, garment.mass)))
