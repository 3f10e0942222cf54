"""Comparison of layouts of the bones.

Run `python -m papers.rope_chains.layouts TAKES`; TAKES is a dataset. For several numbers of chains and bones, at even
distances and by skinning decomposition (SSDR), the script fits a ridge regression from the simulated bones to the mesh,
the start of the networks, to the takes to train on. It prints the error on all three parts of the split. The first two
errors choose the layout; the third one measures it. It uses every third frame and every ninth vertex.

The script appends one JSON line for each row to benchmarks/results/rope_chains_layouts.jsonl and writes the page
papers/rope_chains/pages/layouts-NAME.md.
"""

import argparse
import json
from dataclasses import replace
from pathlib import Path

import numpy as np

import hemline
from hemline.animators.ropes import RopesConfig
from hemline.animators.ropes.bones.bones import rest_bones
from hemline.animators.ropes.fit.fit_ropes import sample_frames
from hemline.animators.ropes.fit.gather import TakeFrames
from hemline.animators.ropes.layout.layout import build_ropes
from hemline.bench.machine import commit, machine
from hemline.learning.fit.batches import SMALLEST_DEVIATION
from hemline.learning.key_frame import to_key_frame
from hemline.learning.ridge import ridge

ROOT = Path(__file__).parents[2]
RESULTS = ROOT / "benchmarks" / "results" / "rope_chains_layouts.jsonl"
PAGES = ROOT / "papers" / "rope_chains" / "pages"
FRAME, VERTEX = 3, 9
"""Strides of the frames and vertices that are used."""
COUNTS = ((10, 14), (14, 14), (20, 14), (26, 9), (30, 12), (36, 12), (40, 14))
"""Numbers of chains, and of bones in each chain."""
DECOMPOSED = ((10, 14), (20, 14), (26, 9))
"""The numbers of `COUNTS` that are also built by decomposition, which takes half a minute each."""
HEADER = """\
| layout | chains x bones asked | bones in all | line, train, mm | validation | test |
|---|---|---|---|---|---|"""
PAGE = """\
# Where the bones of a {name} lie

Written by `python -m papers.rope_chains.layouts TAKES` at commit {commit}, on {machine},
from {frames} frames of {takes} takes, split by subject. The line is a ridge regression from the bones on simulated
cloth to the mesh, with noise of {noise:g} mm on the bones: the start of the networks. "Decomposed": bones where a
skinning decomposition of {shown} frames to train on puts them (Le, Deng, 2012), joined downward; bones at the same
place are merged.

{table}
"""


def all_layouts(garment, body, rest, shown):
    """Yields all layouts: name, numbers of chains and bones, ropes."""
    if garment.chains:
        yield "by hand", (len(garment.chains), len(garment.chains[0])), build_ropes(garment, body, rest=rest)
    free = replace(garment, chains=())
    for chains, bones in COUNTS:
        numbers, counts = (chains, bones), (bones - 1, bones + 1)
        yield "even", numbers, build_ropes(free, body, rest=rest, chain_count=chains, bone_counts=counts)
        if numbers in DECOMPOSED:
            decomposed = build_ropes(free, body, rest=rest, chain_count=chains, bone_counts=counts, frames=shown)
            yield "decomposed", numbers, decomposed


def main() -> None:
    parser = argparse.ArgumentParser(description="Comparison of layouts of the bones.")
    parser.add_argument("takes", type=Path, help="a dataset")
    takes = hemline.datasets.open_dataset(parser.parse_args().takes)
    source, garment = TakeFrames.of(takes), takes.garment
    body = hemline.bodies.load(garment.body_name).shaped(garment.body_betas)
    rest = takes.rest(garment.body_betas).vertices[0].astype(np.float64)
    shown = sample_frames(source, body).vertices
    found = list(all_layouts(garment, body, rest, shown))
    at_rest = [rest_bones(ropes, rest, body) for _, _, ropes in found]
    bones = [[] for _ in found]
    vertices, sides = [], []
    for take, side, _ in source.takes():
        for frame in take.clip_frames[::FRAME]:
            posed = body.posed(take.motion[int(frame)])
            key = posed.transforms[found[0][2].key_index].astype(np.float64)
            seen = to_key_frame(key, take.vertices[frame]).astype(np.float64)
            vertices.append((seen - rest)[::VERTEX].ravel().astype(np.float32))
            sides.append(side)
            for (_, _, ropes), still, rows in zip(found, at_rest, bones, strict=True):
                moved = ropes.positions_on(seen)
                moved[ropes.kinematic] = to_key_frame(key, ropes.kinematic_positions(posed))
                rows.append((moved - still).ravel().astype(np.float32))
    wanted, sides, noise = np.array(vertices), np.array(sides), RopesConfig().bone_noise
    common = {"garment": garment.name, "machine": machine(), "commit": commit(), "frames": len(sides)}
    lines = [HEADER]
    print(HEADER, flush=True)
    for (name, (chains, each), ropes), rows in zip(found, bones, strict=True):
        inputs = np.array(rows)
        deviations = np.full((ropes.node_count, 3), noise)
        deviations[ropes.kinematic] = SMALLEST_DEVIATION
        matrix, offset = ridge(inputs[sides == 0], wanted[sides == 0], deviations.ravel())
        apart = np.linalg.norm((inputs @ matrix.T + offset - wanted).reshape(len(wanted), -1, 3), axis=2).mean(1)
        errors = [1e3 * float(apart[sides == side].mean()) for side in range(3)]
        told = " | ".join(f"{error:.2f}" for error in errors)
        lines.append(f"| {name} | {chains} x {each} | {ropes.node_count} | {told} |")
        print(lines[-1], flush=True)
        row = {"layout": name, "chains": chains, "chain_bones": each, "bones": ropes.node_count}
        with RESULTS.open("a") as stream:
            stream.write(json.dumps(row | dict(zip(("train", "val", "test"), errors, strict=True)) | common) + "\n")
    page = PAGE.format(
        name=garment.name,
        commit=commit(),
        machine=machine(),
        frames=len(sides),
        takes=len(source.rows),
        noise=1e3 * noise,
        shown=len(shown),
        table="\n".join(lines),
    )
    (PAGES / f"layouts-{garment.name}.md").write_text(page)


if __name__ == "__main__":
    main()
