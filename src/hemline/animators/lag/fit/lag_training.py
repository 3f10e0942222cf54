"""The training of the lag network with torch."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import nn

from hemline.animators.coarse.features.columns import DYNAMIC, STATIC, VECTOR
from hemline.animators.coarse.proxy_on_body import Cells
from hemline.animators.lag.lag_net import LagNet, layer_sizes
from hemline.learning.fit.device import frame_room

from .lag_samples import ALL, GarmentSamples, Selection

VALIDATION_STRIDE = 4
"""Interval between the samples of a garment that are validated after an epoch."""


class TorchLagNet(nn.Module):
    """The network of `LagNet` for several frames of one garment; `LagNet` has the formula."""

    def __init__(self, width: int, mean: np.ndarray, spread: np.ndarray, seed: int, precision: str = "float32"):
        super().__init__()
        self.precision = getattr(torch, precision)
        generator = torch.Generator().manual_seed(seed)
        self.weights = nn.ParameterDict()
        self.biases = nn.ParameterDict()
        for name, (rows, columns) in layer_sizes(STATIC.count + DYNAMIC.count, width).items():
            scale = 0.0 if name == "fourth" else (2 / rows) ** 0.5
            self.weights[name] = nn.Parameter(scale * torch.randn(rows, columns, generator=generator))
            self.biases[name] = nn.Parameter(torch.zeros(columns))
        self.mean, self.spread = nn.Buffer(torch.from_numpy(mean)), nn.Buffer(torch.from_numpy(spread))

    def forward(self, static: torch.Tensor, features: torch.Tensor, cells: "TorchCells") -> torch.Tensor:
        """Predicts displacements (frames, verts, 3) [m].

        Args:
            static: Features that do not change (verts, static).
            features: Features that change (frames, verts, dynamic).
            cells: Cells of the vertices.
        """
        frames, count = features.shape[:2]
        inputs = torch.cat([static.expand(frames, count, -1), features], dim=2)
        h = self._layer("first", (inputs - self.mean) / self.spread)
        h = self._layer("second", h)
        c = self._layer("cell", cells.mean(h.float()))
        c = self._layer("all_cells", torch.cat([c, c.mean(dim=1, keepdim=True).expand_as(c)], dim=2))
        h = self._layer("third", torch.cat([h, cells.gather(c)], dim=2))
        return h.float() @ self.weights["fourth"] + self.biases["fourth"]

    def _layer(self, name: str, inputs: torch.Tensor) -> torch.Tensor:
        products = inputs.to(self.precision) @ self.weights[name].to(self.precision)
        return torch.relu(products + self.biases[name].to(self.precision))

    def load_weights(self, net: LagNet) -> None:
        """Takes the weights of a network at run time."""
        with torch.no_grad():
            for name, weight in self.weights.items():
                weight.copy_(torch.from_numpy(net.weights[name]))
                self.biases[name].copy_(torch.from_numpy(net.biases[name]))
            self.biases["first"] += self.mean @ self.weights["first"]
            self.weights["first"] *= self.spread[:, None]

    def to_runtime(self) -> LagNet:
        """Returns the network for run time, with the scales of features folded into its weights."""
        arrays = {name: weight.detach().cpu().numpy().copy() for name, weight in self.weights.items()}
        biases = {name: bias.detach().cpu().numpy().copy() for name, bias in self.biases.items()}
        mean, spread = self.mean.cpu().numpy(), self.spread.cpu().numpy()
        biases["first"] -= (mean / spread) @ arrays["first"]
        arrays["first"] /= spread[:, None]
        return LagNet(arrays, biases)


@dataclass(frozen=True)
class TorchCells:
    """The tensors of `Cells`."""

    count: int
    cell: torch.Tensor
    near: torch.Tensor
    shares: torch.Tensor

    @classmethod
    def of(cls, cells: Cells, device: torch.device) -> "TorchCells":
        """Copies the cells of a garment to a device."""
        arrays = (torch.from_numpy(each).to(device) for each in (cells.cell, cells.near, cells.shares))
        return cls(cells.count, *arrays)

    def at(self, ends: np.ndarray) -> "TorchCells":
        """Returns the cells of some vertices."""
        return TorchCells(self.count, self.cell[ends], self.near[ends], self.shares[ends])

    def mean(self, h: torch.Tensor) -> torch.Tensor:
        """Averages the features of the vertices of each cell."""
        sums = h.new_zeros(h.shape[0], self.count, h.shape[2]).index_add(1, self.cell, h)
        sizes = torch.bincount(self.cell, minlength=self.count).clamp(min=1)
        return sums / sizes[:, None]

    def gather(self, c: torch.Tensor) -> torch.Tensor:
        """Sums up the weighted features of the cells that reach each vertex."""
        frames, count = c.shape[0], len(self.near)
        return (c[:, self.near.reshape(-1)].reshape(frames, count, -1, c.shape[2]) * self.shares[:, :, None]).sum(dim=2)


class LagObjective:
    r"""Mean distance of vertices, and of edge vectors in edges: $|x - x^*| + w \, |e - e^*|$ over the vertices.

    The distance is not squared, since a loose garment has several truths in the same motion that lie far apart.
    """

    name = "lag network"

    def __init__(self, net: TorchLagNet, train: Sequence[GarmentSamples], valid: Sequence[GarmentSamples], config):
        self.net, self.config = net, config
        self.device = net.mean.device
        self.train, self.valid = ([_TorchSamples(each, self.device) for each in some] for some in (train, valid))
        room = frame_room(self.device)
        for each in (*self.train, *self.valid):
            room -= each.byte_count
            if room > 0:
                each.keep()
        self._dynamic, self._static = (
            tuple(torch.from_numpy(part).to(self.device) for part in table.mirror()) for table in (DYNAMIC, STATIC)
        )
        chunks = [
            (number, first)
            for number, each in enumerate(train)
            for first in range(0, len(each) - config.frames + 1, config.frames)
        ]
        self._chunks = chunks
        errors = np.array([np.linalg.norm(each.displacements(), axis=2).mean() for each in train])
        weights = (errors + 1e-3) ** -config.evenness
        self._weights = weights / np.average(weights, weights=[len(each) for each in train])

    @property
    def parameters(self) -> Sequence[torch.Tensor]:
        """Tensors that the training changes in place."""
        return list(self.net.parameters())

    @property
    def samples(self) -> np.ndarray:
        """Numbers of the samples; each is a chunk of frames of one garment."""
        return np.arange(len(self._chunks))

    def loss(self, chosen: np.ndarray, random: np.random.Generator, mine: slice) -> torch.Tensor:
        """Returns the mean loss over garments."""
        draws = [self._draw(int(self._chunks[number][0]), random) for number in chosen]
        return torch.stack([float(self._weights[each.garment]) * self._loss(each) for each in draws[mine]]).mean()

    def _draw(self, garment: int, random: np.random.Generator) -> "_FrameDraw":
        """Draws frames and edges of a garment, and how they are shown."""
        ready, config = self.train[garment], self.config
        frames = np.sort(random.choice(ready.count, config.frames, replace=False))
        mirrored = config.mirrored and random.random() < 0.5
        count = min(config.vertices // 2, len(ready.edges))
        edges = ready.edges[random.choice(len(ready.edges), count, replace=False)]
        return _FrameDraw(garment, frames, edges, mirrored, random.random() < config.unknown)

    def validation_loss(self, random: np.random.Generator) -> torch.Tensor:
        """Returns the mean distance of vertices in some of the frames [m]; all garments have the same weight."""
        return torch.stack([self._error(each, VALIDATION_STRIDE) for each in self.valid]).mean()

    def errors(self, all_samples: Sequence[GarmentSamples]) -> list[float]:
        """Returns the mean distance of vertices of each garment [m]."""
        with torch.no_grad():
            return [float(self._error(_TorchSamples(each, self.device))) for each in all_samples]

    def _error(self, ready: "_TorchSamples", every: int = 1) -> torch.Tensor:
        frames = np.arange(0, ready.count, every)
        with torch.no_grad():
            totals = [
                (self.net(ready.static, ready.features(part), ready.cells) - ready.displacements(part))
                .norm(dim=2)
                .mean(dim=1)
                for part in np.array_split(frames, max(1, len(frames) // 16))
            ]
        return torch.cat(totals).mean()

    def _loss(self, drawn: "_FrameDraw") -> torch.Tensor:
        ready, frames, mirrored = self.train[drawn.garment], drawn.frames, drawn.mirrored
        count, ends = len(drawn.edges), drawn.edges.T.reshape(-1)
        static, features, truth = ready.static[ends], ready.features(frames, ends), ready.displacements(frames, ends)
        if drawn.unknown:
            features[..., DYNAMIC["beginning"]] = 0
        if mirrored:
            order, signs = self._static
            static = static[:, order] * signs
            order, signs = self._dynamic
            features = features[..., order] * signs
            truth = truth * torch.from_numpy(VECTOR).to(self.device)
        errors = self.net(static, features, ready.cells.at(ends)) - truth
        loss = _length(errors).mean()
        if self.config.edge_weight:
            rotated = _rotate(ready.turns(frames, ends, mirrored), errors)
            loss = loss + self.config.edge_weight * _length(rotated[:, :count] - rotated[:, count:]).mean()
        return loss


def _length(vectors: torch.Tensor) -> torch.Tensor:
    return (vectors.square().sum(dim=-1) + 1e-8).sqrt()


def _rotate(turns: torch.Tensor, vectors: torch.Tensor) -> torch.Tensor:
    """Rotates vectors by unit quaternions."""
    scalar, axis = turns[..., :1], turns[..., 1:]
    cross = 2 * torch.linalg.cross(axis, vectors)
    return vectors + scalar * cross + torch.linalg.cross(axis, cross)


@dataclass(frozen=True)
class _FrameDraw:
    """One garment of a batch."""

    garment: int
    """Number of the garment."""
    frames: np.ndarray
    """Numbers of the frames."""
    edges: np.ndarray
    """Edges whose ends are trained on, half as many as `config.vertices`."""
    mirrored: bool
    """Whether left and right are exchanged."""
    unknown: bool
    """Whether the features hide how the garment lay at the beginning."""


class _TorchSamples:
    """The samples of a garment as tensors on a device.

    On the processor, frames are read from their file each time. The memory of another device holds them in half
    precision, as the file does, if it has room.
    """

    def __init__(self, samples: GarmentSamples, device: torch.device):
        self._samples, self._device = samples, device
        self.count = len(samples)
        self.static = torch.from_numpy(np.array(samples.frames.static)).to(device)
        self.cells = TorchCells.of(samples.frames.cells, device)
        self.edges = samples.frames.edges
        self._kept: dict[str, torch.Tensor] = {}

    def keep(self) -> None:
        """Copies all frames to the device."""
        for name in ("features", "displacements", "turns"):
            whole = np.asarray(getattr(self._samples.frames, name)[self._samples.rows], np.float16)
            self._kept[name] = torch.from_numpy(whole).to(self._device)

    @property
    def byte_count(self) -> int:
        """Memory that `keep` takes [bytes]."""
        frames = self._samples.frames
        return self.count * 2 * sum(each.shape[1] * each.shape[2] for each in (frames.features, frames.turns))

    def features(self, frames: np.ndarray, ends: Selection = ALL) -> torch.Tensor:
        """Returns the features of some vertices in some frames, see `GarmentSamples.features`."""
        return self._some("features", frames, ends)

    def displacements(self, frames: np.ndarray, ends: Selection = ALL) -> torch.Tensor:
        """Returns the displacements of the truth from skinning [m], see `GarmentSamples.displacements`."""
        return self._some("displacements", frames, ends)

    def turns(self, frames: np.ndarray, ends: Selection, mirrored: bool) -> torch.Tensor:
        """Returns the rotations of vertices, wxyz, or those of their mirror images."""
        turns = self._some("turns", frames, ends)
        return turns * turns.new_tensor([1, 1, -1, -1]) if mirrored else turns

    def _some(self, name: str, frames: np.ndarray, verts: Selection) -> torch.Tensor:
        kept = self._kept.get(name)
        if kept is None:
            return torch.from_numpy(getattr(self._samples, name)(frames, verts)).to(self._device)
        rows = torch.from_numpy(np.asarray(frames)).to(self._device)
        columns = verts if isinstance(verts, slice) else torch.from_numpy(np.asarray(verts)).to(self._device)
        return (kept[rows] if isinstance(columns, slice) else kept[rows[:, None], columns]).float()
