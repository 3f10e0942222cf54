"""The objectives of the two stages of the estimator's training."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import torch
from torch import Tensor

from hemline.animators.coarse.features.columns import VECTOR
from hemline.animators.swingar.garment_sample import GarmentSample
from hemline.arrays import Int
from hemline.learning.fit.device import full_precision
from hemline.learning.mirror import opposite_joints

from .estimator import Estimator, GarmentCode
from .frame_reader import FrameReader, row_numbers
from .frame_tensors import FrameTensors
from .losses import LossWeights, bend_loss, collision_loss, distance_loss, edge_loss, gravity_loss
from .mirror import mirror_garment
from .samples import TrainingSamples

SUPERVISED = LossWeights(edge=0.0, bend=0.0, gravity=0.0, collision=0.0)
"""Weights of the first stage, which has the vertex term alone."""
BODY_MARGIN = 0.002
"""Distance that vertices should keep from the body [m]."""


@dataclass(frozen=True)
class Groups:
    """How samples are drawn. A group has frames of one garment, which is encoded once for all of them."""

    frames: int = 8
    """Number of frames in a group."""
    epoch: int = 100
    """Number of groups in an epoch."""
    validation: int = 12
    """Number of validated frames of each garment, evenly spread over its samples."""
    garments: int = 60
    """Number of validated garments, evenly spread over all of the validation set."""
    mirrored: bool = True
    """Whether half of the groups are mirrored."""
    evenness: float = 0.5
    """Exponent that balances garments: the loss of a garment is divided by its skinning error to this power."""
    unknown: float = 0.2
    """Fraction of the groups whose features hide how the garment lay at the beginning."""


@dataclass(frozen=True)
class _GroupDraw:
    """A group of frames of one garment."""

    chosen: np.ndarray
    """Numbers of the samples."""
    mirrored: bool = False
    """Whether left and right are exchanged."""
    forgetful: bool = False
    """Whether the features hide how the garment lay at the beginning."""


class _StageObjective:
    """The base of both objectives. Samples of the Trainer are groups, whose frames are drawn when they are used."""

    def __init__(
        self,
        estimator: Estimator,
        samples: TrainingSamples,
        groups: Groups,
        weights: LossWeights,
        reader: FrameReader | None = None,
    ):
        self.estimator, self.data, self.groups, self.weights = estimator, samples, groups, weights
        self._training = _by_garment(samples, self.usable_samples)
        self._probabilities = np.array([len(each) for each in self._training], float) / len(self.usable_samples)
        errors = np.nan_to_num(np.asarray(samples.skinning_errors, float), nan=1.0)
        factors = (errors + 1e-3) ** -groups.evenness
        self._factors = factors / np.average(factors, weights=self._probabilities)
        self._images = [mirror_garment(each) for each in samples.garments] if groups.mirrored else []
        self._device = next(estimator.parameters()).device
        self._reader = reader or FrameReader(samples, self._device)
        self._sheets = [_Sheet.of(garment, self._device) for garment in samples.garments]

    @property
    def usable_samples(self) -> np.ndarray:
        """Samples that the stage can train on."""
        return self.data.training

    @property
    def samples(self) -> np.ndarray:
        """Numbers of groups."""
        return np.arange(self.groups.epoch)

    def loss(self, chosen: np.ndarray, random: np.random.Generator, mine: slice) -> Tensor:
        """Returns the sum of the weighted terms, averaged over the groups of a batch."""
        draws = [self._draw(random) for _ in chosen]
        factors = [float(self._factors[self.data.garment_of[each.chosen[0]]]) for each in draws[mine]]
        terms = [factor * self._terms(each) for factor, each in zip(factors, draws[mine], strict=True)]
        return torch.stack(terms).mean()

    def validation_loss(self, random: np.random.Generator) -> Tensor:
        """Returns the weighted terms relative to the weight of the mean distance, averaged over garments [m]."""
        with torch.no_grad():
            found = [float(self._terms(_GroupDraw(frames))) for frames in validation_frames(self.data, self.groups)]
        return torch.tensor(found).mean() / self.weights.vertex

    def errors(self) -> list[float]:
        """Returns the mean distance of vertices of each garment of the validation set [m]."""
        with torch.no_grad():
            return [float(self._distances(frames)) for frames in validation_frames(self.data, self.groups)]

    def predict(self, chosen: np.ndarray, frames: FrameTensors, mirrored: bool = False) -> Tensor:
        """Predicts some frames of one garment (frames, verts, 3) [m].

        Args:
            chosen: Numbers of the samples.
            frames: The frames, mirrored if `mirrored`.
            mirrored: Whether the frames are mirrored.
        """
        raise NotImplementedError

    def _draw(self, random: np.random.Generator) -> _GroupDraw:
        members = self._training[random.choice(len(self._probabilities), p=self._probabilities)]
        chosen = np.sort(random.choice(members, min(self.groups.frames, len(members)), replace=False))
        mirrored, forgetful = random.random(2) < (0.5 * self.groups.mirrored, self.groups.unknown)
        return _GroupDraw(chosen, bool(mirrored), bool(forgetful))

    def _distances(self, chosen: np.ndarray) -> Tensor:
        frames = self._reader.read(chosen)
        return (self.predict(chosen, frames) - frames.truth).norm(dim=-1).mean()

    def _garment(self, chosen: np.ndarray, mirrored: bool) -> GarmentSample:
        number = int(self.data.garment_of[chosen[0]])
        return self._images[number] if mirrored else self.data.garments[number]

    def _terms(self, drawn: _GroupDraw) -> Tensor:
        frames, number = self._reader.read(drawn.chosen), int(self.data.garment_of[drawn.chosen[0]])
        if drawn.forgetful:
            frames = frames.forget_beginning()
        if drawn.mirrored:
            frames = frames.mirror()
        vertices, truth = self.predict(drawn.chosen, frames, drawn.mirrored), frames.truth
        sheet, w = self._sheets[number], self.weights
        total = w.vertex * distance_loss(vertices, truth)
        if w.edge:
            total = total + w.edge * edge_loss(vertices, truth, sheet.edges)
        if w.bend:
            total = total + w.bend * bend_loss(vertices, sheet.faces, sheet.beside)
        if w.gravity:
            total = total + w.gravity * gravity_loss(vertices, sheet.mass)
        if w.collision:
            heights = self.data.heights(number, vertices, frames)
            total = total + w.collision * collision_loss(heights, BODY_MARGIN)
        return total


class CoarseObjective(_StageObjective):
    """The coarse mesh, on sparse frames that do not depend on each other."""

    name = "coarse predictor"

    @property
    def parameters(self) -> Sequence[Tensor]:
        """Encoders of garment, shape and motion, and the coarse predictor."""
        return self.estimator.coarse_parameters()

    def predict(self, chosen: np.ndarray, frames: FrameTensors, mirrored: bool = False) -> Tensor:
        """The coarse meshes."""
        return _coarse(self.estimator, encode(self.estimator, self._garment(chosen, mirrored)), frames)


class CorrectiveObjective(_StageObjective):
    """The corrective displacement, on coarse meshes that no longer change: they are made once."""

    name = "corrective predictor"

    @cached_property
    def _codes(self) -> list[GarmentCode]:
        with torch.no_grad():
            return [encode(self.estimator, garment) for garment in self.data.garments]

    @cached_property
    def _rows(self) -> np.ndarray:
        return row_numbers(self.data)

    @cached_property
    def _known(self) -> "dict[int, _CoarseFrames]":
        return {}

    @property
    def parameters(self) -> Sequence[Tensor]:
        """Parameters of the body encoder and of the corrective predictor."""
        return self.estimator.corrective_parameters()

    @property
    def usable_samples(self) -> np.ndarray:
        """Samples whose two frames before are samples too."""
        return self.data.training[self.data.has_past[self.data.training]]

    def predict(self, chosen: np.ndarray, frames: FrameTensors, mirrored: bool = False) -> Tensor:
        """Predicts coarse meshes and adds their corrective displacements."""
        number = int(self.data.garment_of[chosen[0]])
        if number not in self._known:
            self._known[number] = self._coarse_frames(number)
        times = np.concatenate([self.data.before[chosen][:, ::-1], chosen[:, None]], axis=1)
        rows = torch.from_numpy(self._rows[times]).to(self._device)
        known = self._known[number]
        meshes, joints, heading = known.meshes[rows], known.joints[rows], known.heading[rows]
        with full_precision():
            # rotates all three into the heading of the last
            turn = heading[:, -1:].transpose(2, 3) @ heading
            meshes, joints = (each @ turn.transpose(2, 3) for each in (meshes, joints))
        if mirrored:
            image = torch.from_numpy(VECTOR).to(self._device)
            meshes, joints = meshes * image, joints[:, :, opposite_joints()] * image
        return meshes[:, -1] + self.estimator.corrective(self._codes[number], meshes, joints, frames.body)

    def _coarse_frames(self, number: int) -> "_CoarseFrames":
        """Predicts the coarse meshes of all samples of a garment."""
        members, parts = np.flatnonzero(self.data.garment_of == number), []
        for first in range(0, len(members), self.groups.frames):
            frames = self._reader.read(members[first : first + self.groups.frames])
            with torch.no_grad():
                made = _coarse(self.estimator, self._codes[number], frames)
            parts.append((made, frames.joints, frames.heading))
        return _CoarseFrames(*(torch.cat(each) for each in zip(*parts, strict=True)))


@dataclass(frozen=True, eq=False)
class _CoarseFrames:
    """Coarse meshes of all samples of a garment."""

    meshes: Tensor
    """Vertices (samples, verts, 3) [m]. Their changes are enlarged, so that half precision would not do."""
    joints: Tensor
    """Positions of the joints (samples, joints, 3) [m]."""
    heading: Tensor
    """Rotations from each frame's own heading to one that all frames of a clip share (samples, 3, 3)."""


def encode(estimator: Estimator, garment: GarmentSample) -> GarmentCode:
    """Encodes a garment of a training set."""
    device = next(estimator.parameters()).device
    parts = garment.features, garment.descriptor, garment.skin_logits
    each = (torch.from_numpy(part).to(device) for part in parts)
    return estimator.garment(garment.graph, *each)


def validation_frames(samples: TrainingSamples, groups: Groups) -> Iterator[Int[np.ndarray, " frames"]]:
    """Yields numbers of samples of each validated garment, evenly spread over the validation set."""
    held_out = [members for members in _by_garment(samples, samples.validation) if len(members)]
    for i in _evenly(len(held_out), groups.garments):
        yield held_out[i][_evenly(len(held_out[i]), groups.validation)]


def _evenly(count: int, wanted: int) -> Int[np.ndarray, " chosen"]:
    return np.unique(np.linspace(0, count - 1, wanted).round().astype(int))


def _coarse(estimator: Estimator, code: GarmentCode, frames: FrameTensors) -> Tensor:
    return estimator.coarse(code, frames.motion, frames.transforms, frames.features, frames.turns)[0]


def _by_garment(samples: TrainingSamples, chosen: np.ndarray) -> list[np.ndarray]:
    of = samples.garment_of[chosen]
    return [np.sort(chosen[of == i]) for i in range(len(samples.garments))]


@dataclass(frozen=True, eq=False)
class _Sheet:
    """A mesh as the loss terms need it."""

    faces: Tensor
    """Triangles (faces, 3)."""
    edges: Tensor
    """Edges (edges, 2)."""
    beside: Tensor
    """Ids of two faces that share an edge (pairs, 2)."""
    mass: Tensor
    """Mass of each vertex (verts,) [kg]."""

    @classmethod
    def of(cls, garment: GarmentSample, device: torch.device) -> "_Sheet":
        faces = np.asarray(garment.faces, np.int64)
        corners = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
        found, number = np.unique(corners, axis=0, return_inverse=True)
        order = np.argsort(number, kind="stable")
        same = np.flatnonzero(np.diff(number[order]) == 0)
        beside = np.stack([order[same], order[same + 1]], axis=1) % len(faces)
        return cls(*(torch.from_numpy(each).to(device) for each in (faces, found, beside, garment.mass)))
