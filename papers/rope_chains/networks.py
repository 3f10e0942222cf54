"""Asks whether networks from bones to mesh beat a linear map: `python -m papers.rope_chains.networks TRAIN TEST`.

TRAIN and TEST are datasets of takes of one garment, such as `train` and `test` in the folder of
`papers.rope_chains.bones`. Both networks of the paper (Sections 7 and 8) are trained on TRAIN at two layouts, in
several ways, and judged on clips of TRAIN that choose the best pass, and on TEST, driven by simulated bones. Writes
pages/networks.md.
"""

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch

from hemline.animators.ropes.bones.bones import rest_bones
from hemline.animators.ropes.bones.chains import Ropes
from hemline.animators.ropes.fit.gather import TakeFrames
from hemline.animators.ropes.layout.layout import build_ropes
from hemline.arrays import Float, Int
from hemline.bench.machine import commit, machine
from hemline.bodies import ShapedBody
from hemline.datasets import Take, open_dataset
from hemline.learning.fit.network import ScaledNetwork
from hemline.learning.fit.trainer import Schedule, Trainer
from hemline.learning.pca import deviations_of, principal_of_map, principal_of_rows
from hemline.learning.ridge import ridge

PAGE = Path(__file__).parent / "pages" / "networks.md"
LAYOUTS = {"the paper's cape, 10 chains of 13 to 15": (10, (13, 15)), "ours, 26 chains of 8 to 10": (26, (8, 10))}
COMPONENTS, HIDDEN, BATCH, EPOCHS = 100, 500, 128, 200
NOISE_M = 0.003
"""Noise on the bones for which the linear map is optimal [m]."""
PCA_FRAMES = 2500
"""Number of frames whose principal components are the bases."""
TEXT = """\
# Networks from bones to mesh, against a linear map

`python -m papers.rope_chains.networks TRAIN TEST` wrote this page at commit {commit}, on {machine}, one thread.
Garment: {garment}, {vertices} vertices, {train} frames to train on, {val} that choose the best of {epochs} passes,
{test} of other people to judge. Mean distance of the vertices from the simulation, driven by simulated bones [mm].

{tables}

*Linear map*: ridge regression from bones to vertices, for noise of 3 mm on the bones. *In 200 components*: the same,
cut to the principal directions of its output. *Both networks*: the paper's skinning and shape network, each with two
hidden layers of 500 neurons and 100 principal components of the frames, or of what the first network leaves; random
start, no noise, no collision term. *A network on what the line leaves*: a network with 100 principal components of the
residual of the linear map, beside it. Learning rates are those at the start, of the first and the second network; a
cosine takes them to zero (Adam). The lowest error on validation data chooses the pass, the start included.
"""


@dataclass(frozen=True)
class Frames:
    """Bones and vertices of many frames in the frame of the key joint, as displacements from rest [m]."""

    bones: Float[np.ndarray, "frames ins"]
    vertices: Float[np.ndarray, "frames rows"]
    side: Int[np.ndarray, " frames"]
    """0: to train on, 1: chooses the pass, 2: judges."""

    def of(self, side: int) -> Int[np.ndarray, " some"]:
        """Returns the frames of a side."""
        return np.flatnonzero(self.side == side)


def in_key_frame(ropes: Ropes, take: Take, body: ShapedBody) -> tuple[np.ndarray, np.ndarray]:
    """Returns bones and vertices of a clip in the frame of the key joint [m]."""
    clip = take.clip_frames
    transforms, _ = body.transforms_of(take.motion.rotations[clip], take.motion.translations[clip])
    keys, vertices = transforms[:, ropes.key_index].astype(np.float64), take.vertices[clip]
    bones = np.array(ropes.positions_on(vertices))
    bones[:, ropes.kinematic] = ropes.kinematic_paths(transforms, body)
    return tuple(np.einsum("fnb,fba->fna", each - keys[:, None, :, 3], keys[:, :, :3]) for each in (bones, vertices))


def gather_frames(ropes: Ropes, takes: Iterator[tuple[Take, int]], body: ShapedBody, rest: np.ndarray) -> Frames:
    """Returns the frames of all takes, each with its side."""
    bones_at_rest, found, sides = rest_bones(ropes, rest, body), [], []
    for take, side in takes:
        bones, vertices = in_key_frame(ropes, take, body)
        found.append([(bones - bones_at_rest).astype(np.float32), (vertices - rest).astype(np.float32)])
        sides.append(np.full(len(bones), side))
    bones, vertices = (np.concatenate([each[k] for each in found]) for k in (0, 1))
    return Frames(bones.reshape(len(bones), -1), vertices.reshape(len(bones), -1), np.concatenate(sides))


class CoefficientLoss:
    """The mean square error of a network's coefficients, without noise."""

    name = "network"

    def __init__(self, frames: Frames, coefficients: Float[np.ndarray, "frames modes"], seed: int):
        self.bones, self.coefficients = torch.from_numpy(frames.bones), torch.from_numpy(coefficients)
        self.samples, self.val = frames.of(0), frames.of(1)
        scale = np.maximum(deviations_of(coefficients[self.samples]), 1e-6).astype(np.float32)
        self.network = ScaledNetwork(frames.bones[self.samples], scale, hidden=HIDDEN, seed=seed)
        self.network.start_at_zero()

    @property
    def parameters(self) -> list[torch.Tensor]:
        """Parameters of the network."""
        return self.network.parameters

    def loss(self, chosen: np.ndarray, random: np.random.Generator, mine: slice) -> torch.Tensor:
        """Returns the error on some frames."""
        some = chosen[mine]
        return ((self.network(self.bones[some]) - self.coefficients[some]) ** 2).sum(dim=1).mean()

    def validation_loss(self, random: np.random.Generator) -> torch.Tensor:
        """Returns the error on the frames that choose the pass."""
        return self.loss(self.val, random, slice(None))


def error_mm(left: Float[np.ndarray, "frames rows"]) -> float:
    """Returns the mean distance of vertices [mm]."""
    return 1e3 * float(np.linalg.norm(left.reshape(len(left), -1, 3), axis=2).mean())


def train(frames: Frames, left: Float[np.ndarray, "frames rows"], rate: float, seed: int) -> np.ndarray:
    """Trains a network to what is left of the displacements, and returns what its prediction leaves [m]."""
    samples = frames.of(0)
    some = samples[np.linspace(0, len(samples) - 1, min(PCA_FRAMES, len(samples))).astype(int)]
    basis = principal_of_rows(left[some].astype(np.float64), COMPONENTS)[0].astype(np.float32)
    objective = CoefficientLoss(frames, left @ basis.T, seed)
    Trainer(objective, Schedule(EPOCHS, BATCH, rate, seed, 1)).run(progress=lambda done, total: None)
    with torch.no_grad():
        made = objective.network(torch.from_numpy(frames.bones)).numpy()
    return left - made @ basis


def compare(frames: Frames, free: Float[np.ndarray, " ins"]) -> dict[str, np.ndarray]:
    """Returns what each map leaves of the displacements [m]."""
    samples, whole = frames.of(0), frames.vertices
    noise = np.where(free > 0, NOISE_M, 1e-4)
    matrix, offset = (each.astype(np.float32) for each in ridge(frames.bones[samples], whole[samples], noise))
    line = frames.bones @ matrix.T + offset
    modes = principal_of_map(matrix, offset, frames.bones[samples], 2 * COMPONENTS).basis
    found = {"linear map": whole - line, "linear map in 200 components": whole - line @ modes.T @ modes}
    for first, second in ((1e-4, 1e-5), (1e-3, 1e-4), (1e-3, 1e-3)):
        name = f"both networks, {first:g} and {second:g}" + (" (the paper's rates)" if first == 1e-4 else "")
        found[name] = train(frames, train(frames, whole, first, 0), second, 1)
    found["linear map, and a network on what it leaves, 0.001"] = train(frames, whole - line, 1e-3, 2)
    return found


def table(frames: Frames, found: dict[str, np.ndarray]) -> str:
    """Returns a Markdown table of the errors."""
    lines = ["| map | train | validation | other people |", "|---|---|---|---|"]
    for name, left in found.items():
        values = [f"{error_mm(left[frames.of(side)]):.2f}" for side in range(3)]
        lines.append(f"| {name} | " + " | ".join(values) + " |")
    return "\n".join(lines)


def main() -> None:
    """Trains, judges and writes the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("train", type=Path, help="Dataset to train on.")
    parser.add_argument("test", type=Path, help="Dataset of the same garment, of other people.")
    options = parser.parse_args()
    data, other = open_dataset(options.train), open_dataset(options.test)
    source, garment = TakeFrames.of(data), data.garment
    body = data.body.shaped(garment.body_betas)
    rest = data.rest(garment.body_betas).vertices[0]

    def takes() -> Iterator[tuple[Take, int]]:
        for row, side in zip(source.rows, source.sides, strict=True):
            if side < 2:
                yield data.take(row), side
        for row in other.clips():
            yield other.take(row), 2

    tables: list[str] = []
    for name, (chains, bones) in LAYOUTS.items():
        ropes = build_ropes(garment, body, rest=rest, chain_count=chains, bone_counts=bones)
        frames = gather_frames(ropes, takes(), body, rest)
        counts = [len(frames.of(side)) for side in range(3)]
        free = np.repeat(ropes.parents >= 0, 3).astype(np.float32)
        tables.append(f"Layout: {name}, {ropes.node_count} bones.\n\n{table(frames, compare(frames, free))}")
        print(tables[-1], flush=True)
        page = TEXT.format(
            commit=commit(),
            machine=machine(),
            garment=garment.name,
            vertices=len(garment.vertices),
            train=counts[0],
            val=counts[1],
            test=counts[2],
            epochs=EPOCHS,
            tables="\n\n".join(tables),
        )
        PAGE.write_text(page)  # after each layout, since one takes twenty minutes


if __name__ == "__main__":
    main()
