"""Asks whether networks from bones to mesh beat a linear map: `python -m papers.rope_chains.networks TRAIN TEST`.

TRAIN and TEST are datasets of takes of one garment, such as `train` and `test` in the folder of
`papers.rope_chains.bones`. Both networks of the paper (Sections 7 and 8) are trained on TRAIN at two layouts, in
several ways, and judged on clips of TRAIN that choose the best pass, and on TEST, driven by simulated bones. Writes
pages/networks.md.
"""

import argparse
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from hemline.animators.ropes.bones.bones import rest_bones
from hemline.animators.ropes.bones.chains import Ropes
from hemline.animators.ropes.fit.gather import TakeFrames
from hemline.animators.ropes.layout.layout import build_ropes
from hemline.arrays import Float
from hemline.bench.machine import commit, machine
from hemline.bodies import ShapedBody
from hemline.datasets import Take, open_dataset
from hemline.learning.collision import Clearances, clearances
from hemline.learning.pca import principal_of_map
from hemline.learning.ridge import ridge

from .printed_networks import COMPONENTS, Frames, Training, error_mm, inside_percent, train, train_both

PAGE = Path(__file__).parent / "pages" / "networks.md"
LAYOUTS = {"the paper's cape, 10 chains of 13 to 15": (10, (13, 15)), "ours, 26 chains of 8 to 10": (26, (8, 10))}
NOISE_M = 0.003
"""Noise on the bones for which the linear map is optimal [m]."""
TEXT = """\
# Networks from bones to mesh, against a linear map

`python -m papers.rope_chains.networks TRAIN TEST` wrote this page at commit {commit}, on {machine}, one thread.
Garment: {garment}, {vertices} vertices, {train} frames to train on, {val} that choose the best of {epochs} passes,
{test} of other people to judge. Mean distance of the vertices from the simulation, driven by simulated bones [mm].

{tables}

*Linear map*: ridge regression from bones to vertices, for noise of 3 mm on the bones. *In 200 components*: the same,
cut to the principal directions of its output. *Both networks*: the paper's skinning and shape network, each with two
hidden layers of 500 neurons and 100 principal components of the frames, or of what the first network leaves; random
start, no noise, and no collision term but where it is named. *With the collision term*: at the paper's rates and
weights (1,000 against 0.1), vertices nearer than 5 mm to the body are drawn to where the line to their ground truth is
clear of it. *A network on what the line leaves*: a network with 100 principal components of the residual of the linear
map, beside it. Learning rates are those at the start, of the first and the second network; a cosine takes them to zero
(Adam). The lowest error on validation data chooses the pass, the start included. *Inside*: vertices of the frames of
other people that are inside the body, before any collision step, judged by the half-space of the skin under their
ground truth.
"""


def frames_of_take(ropes: Ropes, take: Take, body: ShapedBody) -> tuple[np.ndarray, np.ndarray, Clearances]:
    """Returns bones and vertices of a clip in the frame of the key joint [m], and the body around each vertex."""
    clip = take.clip_frames
    transforms, _ = body.transforms_of(take.motion.rotations[clip], take.motion.translations[clip])
    keys, vertices = transforms[:, ropes.key_index].astype(np.float64), take.vertices[clip]
    bones = np.array(ropes.positions_on(vertices))
    bones[:, ropes.kinematic] = ropes.kinematic_paths(transforms, body)
    posed = [body.posed(take.motion[int(frame)]) for frame in clip]
    near = clearances(vertices, [each.vertices for each in posed], [each.normals for each in posed])
    normals = np.einsum("fnb,fba->fna", near.normals.astype(np.float64), keys[:, :, :3]).astype(np.float16)
    here = [np.einsum("fnb,fba->fna", each - keys[:, None, :, 3], keys[:, :, :3]) for each in (bones, vertices)]
    return here[0], here[1], Clearances(normals, near.heights)


def gather_frames(ropes: Ropes, takes: Iterator[tuple[Take, int]], body: ShapedBody, rest: np.ndarray) -> Frames:
    """Returns the frames of all takes, each with its side."""
    bones_at_rest, found = rest_bones(ropes, rest, body), []
    for take, side in takes:
        bones, vertices, near = frames_of_take(ropes, take, body)
        moved = [(each - still).astype(np.float32) for each, still in ((bones, bones_at_rest), (vertices, rest))]
        found.append((*moved, near.normals, near.heights, np.full(len(bones), side)))
    bones, vertices, normals, heights, sides = (np.concatenate(each) for each in zip(*found, strict=True))
    count = len(sides)
    return Frames(bones.reshape(count, -1), vertices.reshape(count, -1), sides, Clearances(normals, heights))


def compare(frames: Frames, free: Float[np.ndarray, " ins"]) -> dict[str, np.ndarray]:
    """Returns what each map leaves of the displacements [m]."""
    samples, whole = frames.of(0), frames.vertices
    noise = np.where(free > 0, NOISE_M, 1e-4)
    matrix, offset = (each.astype(np.float32) for each in ridge(frames.bones[samples], whole[samples], noise))
    line = frames.bones @ matrix.T + offset
    modes = principal_of_map(matrix, offset, frames.bones[samples], 2 * COMPONENTS).basis
    found = {"linear map": whole - line, "linear map in 200 components": whole - line @ modes.T @ modes}
    for rates in (Training.rates, (1e-3, 1e-4), (1e-3, 1e-3)):
        name = f"both networks, {rates[0]:g} and {rates[1]:g}" + (" (the paper's)" if rates == Training.rates else "")
        found[name] = train_both(frames, Training(rates=rates))[1]
    found["both networks as printed, with the collision term"] = train_both(frames, Training(collision=True))[1]
    rates = (1e-3, 1e-3)
    found["linear map, and a network on what it leaves, 0.001"] = train(
        frames, whole - line, Training(rates=rates), 0, 2
    )
    return found


def table(frames: Frames, found: dict[str, np.ndarray]) -> str:
    """Returns a Markdown table of the errors."""
    lines = ["| map | train | validation | other people | inside [%] |", "|---|---|---|---|---|"]
    some = frames.of(2)
    for name, left in found.items():
        values = [f"{error_mm(left[frames.of(side)]):.2f}" for side in range(3)]
        values.append(f"{inside_percent(frames, left[some], some):.2f}")
        lines.append(f"| {name} | " + " | ".join(values) + " |")
    lines.append(f"| *the simulation itself* | | | | {inside_percent(frames, 0 * frames.vertices[some], some):.2f} |")
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
            epochs=Training.epochs,
            tables="\n\n".join(tables),
        )
        PAGE.write_text(page)  # after each layout, since one takes twenty minutes


if __name__ == "__main__":
    main()
