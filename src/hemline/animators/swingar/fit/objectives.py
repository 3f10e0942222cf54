"""What the two stages of the estimator's training minimise."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from hemline.animators.coarse.features.mirror import VECTOR
from hemline.arrays import Int
from hemline.learning.fit.distance_network import distances_at
from hemline.learning.mirror import swapped_joints

from .estimator import Estimator, GarmentCode
from .graph_samples import forget_beginning
from .losses import LossWeights, bend_loss, collision_loss, distance_loss, edge_loss, gravity_loss
from .mirrored import mirrored_frames, mirrored_garment
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
    garments: int = 60
    """Garments of the validation set that are looked at, evenly over all."""
    mirrored: bool = True
    """Whether half of the groups are shown with left and right exchanged."""
    evenness: float = 0.5
    """Garments count by what skinning misses of them to minus this power."""
    unknown: float = 0.2
    """Share of the groups that are shown without how the garment lay at the beginning."""


@dataclass(frozen=True)
class _Drawn:
    """A group: frames of one garment, as they are or in a mirror."""

    chosen: np.ndarray
    mirrored: bool
    forgetful: bool


class _Stage:
    """What both stages share: a Trainer's samples are groups; which frames they hold is drawn when they are used."""

    def __init__(self, estimator: Estimator, samples: Samples, groups: Groups, weights: LossWeights):
        self.estimator, self.data, self.groups, self.weights = estimator, samples, groups, weights
        self._training = _by_garment(samples, self.shown)
        self._shares = np.array([len(each) for each in self._training], float) / len(self.shown)
        missed = np.nan_to_num(np.asarray(samples.missed, float), nan=1.0)
        counts = (missed + 1e-3) ** -groups.evenness
        self._counts = counts / np.average(counts, weights=self._shares)
        self._images = [mirrored_garment(each) for each in samples.garments] if groups.mirrored else []
        self._device = next(estimator.parameters()).device
        self._sheets = [_Sheet.of(garment, self._device) for garment in samples.garments]

    @property
    def shown(self) -> np.ndarray:
        """Samples that are trained on."""
        return self.data.training

    @property
    def samples(self) -> np.ndarray:
        """Numbers of groups."""
        return np.arange(self.groups.epoch)

    def loss(self, chosen: np.ndarray, random: np.random.Generator, mine: slice) -> Tensor:
        """The weighted terms, mean over the groups of a batch."""
        drawn = [self._drawn(random) for _ in chosen]
        return torch.stack([self._terms(each) for each in drawn[mine]]).mean()

    def validation_loss(self, random: np.random.Generator) -> Tensor:
        """Mean distance of vertices [m], mean over garments."""
        return torch.tensor(self.errors()).mean()

    def errors(self) -> list[float]:
        """Mean distance of vertices on each garment of the validation set [m]."""
        with torch.no_grad():
            return [float(self._distances(frames)) for frames in validation_frames(self.data, self.groups)]

    def predicted(self, chosen: np.ndarray, batch: FrameBatch, mirrored: bool = False) -> Tensor:
        """The garment in some frames of one garment (frames, verts, 3) [m].

        Args:
            chosen: Numbers of the samples.
            batch: The frames, as they are shown.
            mirrored: Whether they are shown in a mirror.
        """
        raise NotImplementedError

    def _drawn(self, random: np.random.Generator) -> _Drawn:
        members = self._training[random.choice(len(self._shares), p=self._shares)]
        chosen = np.sort(random.choice(members, min(self.groups.frames, len(members)), replace=False))
        mirrored, forgetful = random.random(2) < (0.5 * self.groups.mirrored, self.groups.unknown)
        return _Drawn(chosen, bool(mirrored), bool(forgetful))

    def _distances(self, chosen: np.ndarray) -> Tensor:
        batch = self.data.frames(chosen)
        return (self.predicted(chosen, batch) - self._tensor(batch.truth)).norm(dim=-1).mean()

    def _tensor(self, array: np.ndarray) -> Tensor:
        return torch.from_numpy(array).to(self._device)

    def _garment(self, chosen: np.ndarray, mirrored: bool) -> GarmentSample:
        number = int(self.data.garment_of[chosen[0]])
        return self._images[number] if mirrored else self.data.garments[number]

    def _terms(self, drawn: _Drawn) -> Tensor:
        batch, number = self.data.frames(drawn.chosen), int(self.data.garment_of[drawn.chosen[0]])
        if drawn.forgetful and batch.told is not None:
            forget_beginning(batch.told)
        if drawn.mirrored:
            batch = mirrored_frames(batch)
        vertices, truth = self.predicted(drawn.chosen, batch, drawn.mirrored), self._tensor(batch.truth)
        sheet, w = self._sheets[number], self.weights
        total = w.vertex * distance_loss(vertices, truth)
        if w.edge:
            total = total + w.edge * edge_loss(vertices, truth, sheet.edges)
        if w.bend:
            total = total + w.bend * bend_loss(vertices, sheet.faces, sheet.beside)
        if w.gravity:
            total = total + w.gravity * gravity_loss(vertices, sheet.mass)
        if w.collision:
            bodies = self.data.bodies(number, batch)
            heights = torch.stack([distances_at(*each) for each in zip(vertices, bodies, strict=True)])
            total = total + w.collision * collision_loss(heights, MARGIN)
        return float(self._counts[number]) * total


class CoarseObjective(_Stage):
    """The coarse mesh, on sparse frames that do not depend on each other."""

    name = "coarse predictor"

    @property
    def parameters(self) -> Sequence[Tensor]:
        """Encoders of garment, shape and motion, and the coarse predictor."""
        return self.estimator.coarse_parameters()

    def predicted(self, chosen: np.ndarray, batch: FrameBatch, mirrored: bool = False) -> Tensor:
        """The coarse meshes."""
        return _coarse(self.estimator, encoded(self.estimator, self._garment(chosen, mirrored)), batch)


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

    @property
    def shown(self) -> np.ndarray:
        """Samples whose two frames before are samples, too."""
        return self.data.training[self.data.wanted[self.data.training]]

    def predicted(self, chosen: np.ndarray, batch: FrameBatch, mirrored: bool = False) -> Tensor:
        """The coarse meshes with the displacement added."""
        code = self._codes[self.data.garment_of[chosen[0]]]
        times = np.concatenate([self.data.before[chosen][:, ::-1], chosen[:, None]], axis=1)
        self._make(np.array([i for i in np.unique(times).tolist() if i not in self._known], np.int64))
        meshes, joints, heading = (
            self._tensor(np.stack([[self._known[i][part] for i in row] for row in times.tolist()])) for part in range(3)
        )
        # all three are seen from the heading of the last
        turned = heading[:, -1:].transpose(2, 3) @ heading
        meshes, joints = (each.float() @ turned.transpose(2, 3) for each in (meshes, joints))
        if mirrored:
            image = self._tensor(VECTOR)
            meshes, joints = meshes * image, joints[:, :, swapped_joints()] * image
        return meshes[:, -1] + self.estimator.corrective(code, meshes, joints, self._tensor(batch.body))

    def _make(self, unknown: np.ndarray) -> None:
        """Make coarse meshes that are not known yet; they are kept as float16."""
        for members in _by_garment(self.data, unknown):
            for first in range(0, len(members), self.groups.frames):
                chosen = members[first : first + self.groups.frames]
                batch = self.data.frames(chosen)
                with torch.no_grad():
                    code = self._codes[self.data.garment_of[chosen[0]]]
                    made = _coarse(self.estimator, code, batch).cpu().numpy().astype(np.float16)
                self._known |= dict(
                    zip(chosen.tolist(), zip(made, batch.joints, batch.heading, strict=True), strict=True)
                )


def encoded(estimator: Estimator, garment: GarmentSample) -> GarmentCode:
    """A garment of a training set, encoded."""
    device = next(estimator.parameters()).device
    parts = garment.features, garment.descriptor, garment.skin_logits
    each = (torch.from_numpy(part).to(device) for part in parts)
    return estimator.garment(garment.graph, *each)


def validation_frames(samples: Samples, groups: Groups) -> Iterator[Int[np.ndarray, " frames"]]:
    """Some samples of garments of the validation set, evenly over all that there are, as sample numbers."""
    held_out = [members for members in _by_garment(samples, samples.validation) if len(members)]
    for i in _evenly(len(held_out), groups.garments):
        yield held_out[i][_evenly(len(held_out[i]), groups.validation)]


def _evenly(count: int, wanted: int) -> Int[np.ndarray, " chosen"]:
    return np.unique(np.linspace(0, count - 1, wanted).round().astype(int))


def _coarse(estimator: Estimator, code: GarmentCode, batch: FrameBatch) -> Tensor:
    device = code.positions.device
    motion, transforms = (torch.from_numpy(each).to(device) for each in (batch.motion, batch.transforms))
    told, turns = (None if each is None else torch.from_numpy(each).to(device) for each in (batch.told, batch.turns))
    return estimator.coarse(code, motion, transforms, told, turns)[0]


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
    def of(cls, garment: GarmentSample, device: torch.device) -> "_Sheet":
        faces = np.asarray(garment.faces, np.int64)
        corners = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
        found, number = np.unique(corners, axis=0, return_inverse=True)
        order = np.argsort(number, kind="stable")
        same = np.flatnonzero(np.diff(number[order]) == 0)
        beside = np.stack([order[same], order[same + 1]], axis=1) % len(faces)
        return cls(*(torch.from_numpy(each).to(device) for each in (faces, found, beside, garment.mass)))
