"""The lag network while it is trained (torch)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import nn

from hemline.animators.swingar.features.mirror import VECTOR, dynamic_mirror, static_mirror
from hemline.animators.swingar.features.proxy_on_body import DYNAMIC, STATIC, Cells

from .lag_net import LagNet, layer_sizes
from .lag_samples import GarmentSamples

Ends = np.ndarray | slice


class TorchLagNet(nn.Module):
    """As `LagNet`, whose formula it is, for several frames of one garment."""

    def __init__(self, width: int, mean: np.ndarray, spread: np.ndarray, seed: int):
        super().__init__()
        generator = torch.Generator().manual_seed(seed)
        self.weights = nn.ParameterDict()
        self.biases = nn.ParameterDict()
        for name, (rows, columns) in layer_sizes(STATIC + DYNAMIC, width).items():
            scale = 0.0 if name == "fourth" else (2 / rows) ** 0.5
            self.weights[name] = nn.Parameter(scale * torch.randn(rows, columns, generator=generator))
            self.biases[name] = nn.Parameter(torch.zeros(columns))
        self.mean, self.spread = torch.from_numpy(mean), torch.from_numpy(spread)

    def forward(self, static: torch.Tensor, told: torch.Tensor, cells: "TorchCells") -> torch.Tensor:
        """Displacements (frames, verts, 3) [m] of static (verts, ...) and told (frames, verts, ...) features."""
        frames, count = told.shape[:2]
        inputs = torch.cat([static.expand(frames, count, -1), told], dim=2)
        h = self._layer("first", (inputs - self.mean) / self.spread)
        h = self._layer("second", h)
        c = self._layer("cell", cells.mean(h))
        c = self._layer("all_cells", torch.cat([c, c.mean(dim=1, keepdim=True).expand_as(c)], dim=2))
        h = self._layer("third", torch.cat([h, cells.heard(c)], dim=2))
        return h @ self.weights["fourth"] + self.biases["fourth"]

    def _layer(self, name: str, inputs: torch.Tensor) -> torch.Tensor:
        return torch.relu(inputs @ self.weights[name] + self.biases[name])

    def go_on_from(self, net: LagNet) -> None:
        """Begin with the weights of one that plays."""
        with torch.no_grad():
            for name, weight in self.weights.items():
                weight.copy_(torch.from_numpy(net.weights[name]))
                self.biases[name].copy_(torch.from_numpy(net.biases[name]))
            self.biases["first"] += self.mean @ self.weights["first"]
            self.weights["first"] *= self.spread[:, None]

    def played(self) -> LagNet:
        """What plays, with the scales folded in."""
        arrays = {name: weight.detach().numpy().copy() for name, weight in self.weights.items()}
        biases = {name: bias.detach().numpy().copy() for name, bias in self.biases.items()}
        biases["first"] -= (self.mean.numpy() / self.spread.numpy()) @ arrays["first"]
        arrays["first"] /= self.spread.numpy()[:, None]
        return LagNet(arrays, biases)


@dataclass(frozen=True)
class TorchCells:
    """`Cells` for torch."""

    count: int
    cell: torch.Tensor
    near: torch.Tensor
    shares: torch.Tensor

    @classmethod
    def of(cls, cells: Cells) -> "TorchCells":
        """Those of a garment."""
        arrays = (torch.from_numpy(each) for each in (cells.cell, cells.near, cells.shares))
        return cls(cells.count, *arrays)

    def at(self, ends: np.ndarray) -> "TorchCells":
        """Those of some vertices."""
        return TorchCells(self.count, self.cell[ends], self.near[ends], self.shares[ends])

    def mean(self, h: torch.Tensor) -> torch.Tensor:
        """Mean of the vertices of each cell."""
        sums = torch.zeros(h.shape[0], self.count, h.shape[2]).index_add(1, self.cell, h)
        sizes = torch.bincount(self.cell, minlength=self.count).clamp(min=1)
        return sums / sizes[:, None]

    def heard(self, c: torch.Tensor) -> torch.Tensor:
        """What each vertex hears from the cells near it."""
        frames, count = c.shape[0], len(self.near)
        return (c[:, self.near.reshape(-1)].reshape(frames, count, -1, c.shape[2]) * self.shares[:, :, None]).sum(dim=2)


class LagObjective:
    r"""Mean distance of vertices, and of edge vectors in edges: $|x - x^*| + w \, |e - e^*|$ over the vertices.

    The distance, not its square: of a loose garment in one and the same motion there are several truths, far apart.
    """

    name = "lag network"

    def __init__(self, net: TorchLagNet, train: Sequence[GarmentSamples], valid: Sequence[GarmentSamples], config):
        self.net, self.config = net, config
        self.train, self.valid = [_Ready(each) for each in train], [_Ready(each) for each in valid]
        self._dynamic, self._static = dynamic_mirror(), static_mirror()
        chunks = [
            (number, first)
            for number, each in enumerate(train)
            for first in range(0, len(each.told) - config.frames + 1, config.frames)
        ]
        self._chunks = chunks

    @property
    def parameters(self) -> Sequence[torch.Tensor]:
        """The tensors that are changed in place."""
        return list(self.net.parameters())

    @property
    def samples(self) -> np.ndarray:
        """Numbers of chunks of frames of one garment."""
        return np.arange(len(self._chunks))

    def loss(self, chosen: np.ndarray, random: np.random.Generator, mine: slice) -> torch.Tensor:
        """Mean over garments."""
        drawn = [self._drawn(self.train[self._chunks[number][0]], random) for number in chosen]
        return torch.stack([self._loss(*each) for each in drawn[mine]]).mean()

    def _drawn(self, ready: "_Ready", random: np.random.Generator) -> tuple["_Ready", np.ndarray, bool, np.ndarray]:
        """Frames of a garment, whether they are mirrored, and edges: as many ends as `config.vertices`."""
        frames = np.sort(random.choice(ready.count, self.config.frames, replace=False))
        mirrored = self.config.mirrored and random.random() < 0.5
        count = min(self.config.vertices // 2, len(ready.edges))
        return ready, frames, mirrored, ready.edges[random.choice(len(ready.edges), count, replace=False)]

    def validation_loss(self, random: np.random.Generator) -> torch.Tensor:
        """Mean distance of vertices, each garment alike."""
        return torch.stack([self._error(each) for each in self.valid]).mean()

    def errors(self, all_samples: Sequence[GarmentSamples]) -> list[float]:
        """Mean distance of vertices of each [m]."""
        with torch.no_grad():
            return [float(self._error(_Ready(each))) for each in all_samples]

    def _error(self, ready: "_Ready") -> torch.Tensor:
        with torch.no_grad():
            totals = [
                (self.net(ready.static, ready.told(part), ready.cells) - ready.apart(part)).norm(dim=2).mean(dim=1)
                for part in np.array_split(np.arange(ready.count), max(1, ready.count // 16))
            ]
        return torch.cat(totals).mean()

    def _loss(self, ready: "_Ready", frames: np.ndarray, mirrored: bool, edges: np.ndarray) -> torch.Tensor:
        """Of the ends of some edges."""
        count, ends = len(edges), edges.T.reshape(-1)
        static, told, apart = ready.static[ends], ready.told(frames, ends), ready.apart(frames, ends)
        if mirrored:
            order, signs = self._static
            static = static[:, order] * torch.from_numpy(signs)
            order, signs = self._dynamic
            told = told[..., order] * torch.from_numpy(signs)
            apart = apart * torch.from_numpy(VECTOR)
        missed = self.net(static, told, ready.cells.at(ends)) - apart
        loss = _length(missed).mean()
        if self.config.edge_weight:
            turned = _turned(ready.turns(frames, ends, mirrored), missed)
            loss = loss + self.config.edge_weight * _length(turned[:, :count] - turned[:, count:]).mean()
        return loss


def _length(vectors: torch.Tensor) -> torch.Tensor:
    return (vectors.square().sum(dim=-1) + 1e-8).sqrt()


def _turned(turns: torch.Tensor, vectors: torch.Tensor) -> torch.Tensor:
    """Vectors turned by unit quaternions."""
    scalar, axis = turns[..., :1], turns[..., 1:]
    cross = 2 * torch.linalg.cross(axis, vectors)
    return vectors + scalar * cross + torch.linalg.cross(axis, cross)


class _Ready:
    """Samples of a garment as torch asks for them."""

    def __init__(self, samples: GarmentSamples):
        self._samples = samples
        self.count = len(samples.told)
        self.static = torch.from_numpy(samples.proxy.static)
        self.cells = TorchCells.of(samples.proxy.cells)
        self.edges = samples.edges

    def told(self, frames: np.ndarray, ends: Ends = slice(None)) -> torch.Tensor:
        return torch.from_numpy(self._samples.told[frames][:, ends].astype(np.float32))

    def apart(self, frames: np.ndarray, ends: Ends = slice(None)) -> torch.Tensor:
        return torch.from_numpy(self._samples.apart[frames][:, ends].astype(np.float32))

    def turns(self, frames: np.ndarray, ends: Ends, mirrored: bool) -> torch.Tensor:
        turns = self._samples.turns[frames][:, ends].astype(np.float32)
        return torch.from_numpy(turns * np.array([1, 1, -1, -1], np.float32) if mirrored else turns)
