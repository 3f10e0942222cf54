"""Measures how far the simulation is from itself when a garment is simulated again with one thing changed.

    python -m papers.swingar.spread TAKES... -o benchmarks/results/swingar_spread.json

TAKES are datasets that `python -m hemline.models.make.swingar_takes` made. The first take of each is simulated again:
from another start (a lead-in of another length), with one substep more, and as a mesh of fewer vertices, which is
compared at common vertices. Smaller errors against this truth mean nothing. Rows that exist are not made again.
"""

import argparse
import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from hemline import bodies
from hemline.bench.machine import commit, machine
from hemline.datasets import Dataset, Take, open_dataset
from hemline.garments import Garment
from hemline.garments.proxy.coarser import coarser_garment
from hemline.metrics import normal_errors_deg
from hemline.sim import SimSettings, simulate
from papers.swingar.unseen import LOOSE_MM, Rest, apart_mm

SHARE = 0.88
"""Fraction of the vertices that the other mesh keeps."""


def changed(garment: Garment, settings: SimSettings) -> Iterator[tuple[str, Garment, np.ndarray, SimSettings]]:
    """Yields the changes: a name, the garment, the ids of its vertices in the first garment, and the settings."""
    same = np.arange(len(garment.vertices))
    yield "another start", garment, same, replace(settings, lead_in=2 * settings.lead_in)
    yield "one substep more", garment, same, replace(settings, substeps=settings.substeps + 1)
    yield "another mesh", *coarser_garment(garment, SHARE), settings


def spread(data: Dataset, settings: SimSettings) -> dict[str, Any]:
    """Returns the row of one garment."""
    row = data.clips()[0]
    body, take = bodies.load(data.garment.body_name), data.take(row)
    shaped, garment = body.shaped(row.betas), data.garment
    rest = Rest(garment.dressed(shaped), shaped, data.rest(shaped.betas).vertices[0])
    clip, found = take.motion[int(take.clip_frames[0]) :], {}
    for name, other, kept, how in changed(garment, settings):
        start = data.rest(shaped.betas) if other is garment else None
        again = simulate(other.dressed(shaped), shaped, clip, how, start=start)
        found[name] = means(take, again, kept, garment.faces) | {"vertices": len(kept)}
        print(f"{garment.name:16s} {name:18s} {found[name]['mean_mm']:.1f}", flush=True)
    kind = "loose" if rest.gap_mm > LOOSE_MM else "close-fitting"
    clips = {"clip": take.motion.name, "frames": len(take.clip_frames)}
    return {"garment": garment.name, "class": kind, "gap_mm": rest.gap_mm, "changed": found} | clips


def means(take: Take, again: Take, kept: np.ndarray, faces: np.ndarray) -> dict[str, float]:
    """Returns how far two simulations are apart over common frames.

    Args:
        take: The first simulation.
        again: The second one.
        kept: Index in the first garment of each vertex of the second.
        faces: Triangles of the first garment.

    Returns:
        Mean distance of vertices and the largest mean of a frame [mm]; if both have the same mesh, also the mean angle
        between normals [degrees].
    """
    frames = [(take.vertices[here], again.vertices[there]) for here, there in _common(take, again)]
    errors = [apart_mm(other, one[kept]) for one, other in frames]
    found = {"mean_mm": float(np.mean(errors)), "worst_frame_mm": float(np.max(errors))}
    if len(kept) == take.vertices.shape[1]:
        found["normals_deg"] = float(np.mean([np.nanmean(normal_errors_deg(b, a, faces)) for a, b in frames]))
    return found


def _common(take: Take, again: Take) -> Iterator[tuple[int, int]]:
    return zip(take.clip_frames, again.clip_frames, strict=False)


def main() -> None:
    """Simulates all garments, prints and writes the rows."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("takes", nargs="+", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True)
    given = parser.parse_args()
    made = json.loads(given.output.read_text()) if given.output.exists() else {"rows": []}
    known = {row["garment"] for row in made["rows"]}
    for data in map(open_dataset, given.takes):
        if data.garment.name in known:
            continue
        rows = [*made["rows"], spread(data, SimSettings())]
        made = {"machine": machine(), "commit": commit(), "rows": rows}
        given.output.write_text(json.dumps(made, indent=1, default=float) + "\n")


if __name__ == "__main__":
    main()
