"""Takes as samples: for frames of a garment, what each vertex is told, and how far the truth is from skinning."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from hemline.animators.swingar.features.dataset_proxy import DatasetProxy, worn_in
from hemline.animators.swingar.features.proxy_on_body import ProxyOnBody
from hemline.animators.swingar.features.trail import Trail
from hemline.arrays import Float, Int
from hemline.datasets import Take
from hemline.datasets.collection import Collection, Entry
from hemline.garments.proxy import ProxySize
from hemline.meshes import edges


@dataclass(frozen=True, eq=False)
class GarmentSamples:
    """Frames of one garment on one body."""

    garment: int
    """Number of its dataset."""
    proxy: ProxyOnBody
    edges: Int[np.ndarray, "edges 2"]
    told: Float[np.ndarray, "frames verts dynamic"]
    """Features, float16."""
    turns: Float[np.ndarray, "frames verts 4"]
    """How vertices are turned, float16; takes displacements back into the world."""
    apart: Float[np.ndarray, "frames verts 3"]
    """Where the truth is, from where skinning puts each vertex, in its turned frame, float16 [m]."""
    entries: Int[np.ndarray, " frames"]
    """Number of the take of each frame."""


def gather(
    data: Collection,
    entries: Sequence[Entry],
    stride: int,
    size: ProxySize,
    progress: Callable[[int, int], None] = lambda *_: None,
) -> list[GarmentSamples]:
    """Read takes.

    Args:
        data: The datasets.
        entries: The takes, each of which is walked through frame by frame.
        stride: Every so many frames become samples.
        size: Of proxies.
        progress: Called with the takes read and in all.

    Returns:
        Samples garment by garment and body by body.
    """
    groups: dict[tuple[int, tuple[float, ...]], list[int]] = {}
    for number, entry in enumerate(entries):
        groups.setdefault((entry.dataset, tuple(entry.row.betas)), []).append(number)
    found, read = [], 0
    for (dataset, betas), numbers in groups.items():
        worn, parts = worn_in(data.datasets[dataset], betas, size), []
        for number in numbers:
            parts.append((number, *frames_of(worn, data.take(entries[number]), stride)))
            read += 1
            progress(read, len(entries))
        told, turns, apart = (np.concatenate([part[k] for part in parts]) for k in (1, 2, 3))
        own = np.concatenate([np.full(len(part[1]), part[0]) for part in parts])
        found.append(GarmentSamples(dataset, worn.proxy, edges(worn.proxy.garment.faces), told, turns, apart, own))
    return found


def frames_of(worn: DatasetProxy, take: Take, stride: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Features, turns and what is missed of every so many frames of a take, float16.

    As in play, the proxy is simulated until the lead-in is over.
    """
    proxy, dt = worn.proxy, 1 / take.motion.fps
    told, turns, apart = [], [], []
    first = proxy.shaped.posed(take.motion[0])
    trail, simulated = Trail.start(proxy, first), worn.simulated.start(first)
    if not take.lead_in.any():
        trail = trail.begun(simulated.positions)
    for frame in range(len(take.motion)):
        posed = proxy.shaped.posed(take.motion[frame])
        trail = trail.stepped(proxy, posed, dt)
        if take.lead_in[frame]:
            simulated = worn.simulated.step(simulated, posed, dt)
            trail = trail.begun(simulated.positions)
        elif frame % stride == 0:
            told.append(trail.told(proxy, posed).astype(np.float16))
            turns.append(trail.turns.astype(np.float16))
            apart.append(trail.turned_back(take.vertices[frame][worn.kept]).astype(np.float16))
    return np.array(told), np.array(turns), np.array(apart)
