"""Takes as the graph network is trained on them: every frame of every take, numbered one after the other."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from hemline.animators.swingar.features.dataset_proxy import worn_in
from hemline.animators.swingar.features.trail import Trail
from hemline.arrays import Float, Int, Vertices
from hemline.bodies import PosedBody
from hemline.datasets.collection import Collection, Entry
from hemline.garments.proxy import ProxySize
from hemline.learning.collision import clearance

from .graph_inputs import body_inputs, garment_inputs, lag_inputs
from .history import Seen, Times
from .samples import FrameBatch, GarmentSample


@dataclass(eq=False)
class TakeSamples:
    """`samples.Samples` of takes."""

    garments: list[GarmentSample] = field(default_factory=list)
    garment_of: Int[np.ndarray, " samples"] = field(default_factory=lambda: np.zeros(0, np.int64))
    before: Int[np.ndarray, "samples 2"] = field(default_factory=lambda: np.zeros((0, 2), np.int64))
    training: Int[np.ndarray, " training"] = field(default_factory=lambda: np.zeros(0, np.int64))
    validation: Int[np.ndarray, " validation"] = field(default_factory=lambda: np.zeros(0, np.int64))
    _rows: list["_Row"] = field(default_factory=list)

    def frames(self, chosen: Int[np.ndarray, " frames"]) -> FrameBatch:
        """Some samples, all of one garment."""
        rows = [self._rows[number] for number in chosen.tolist()]
        return FrameBatch(
            np.stack([row.motion for row in rows]),
            np.stack([row.transforms for row in rows]),
            np.stack([row.joints for row in rows]),
            np.stack([row.body for row in rows]),
            np.stack([row.heading for row in rows]),
            np.stack([row.truth for row in rows]),
            np.stack([row.lag for row in rows]).astype(np.float32),
            np.stack([row.normals for row in rows]).astype(np.float32),
            np.stack([row.heights for row in rows]).astype(np.float32),
        )


@dataclass(frozen=True, eq=False)
class _Row:
    motion: Float[np.ndarray, "poses 75"]
    transforms: Float[np.ndarray, "joints 3 4"]
    joints: Float[np.ndarray, "joints 3"]
    body: Float[np.ndarray, " body"]
    heading: Float[np.ndarray, "3 3"]
    truth: Float[np.ndarray, "verts 3"]
    lag: Float[np.ndarray, "verts lag"]
    normals: Float[np.ndarray, "verts 3"]
    heights: Float[np.ndarray, " verts"]


def take_samples(
    data: Collection,
    training: Sequence[Entry],
    validation: Sequence[Entry],
    stride: int,
    descriptor: int,
    size: ProxySize,
    progress: Callable[[int, int], None] = lambda *_: None,
) -> TakeSamples:
    """Read takes.

    Args:
        data: The datasets.
        training: Takes to train on.
        validation: Takes to choose the best weights by.
        stride: Every so many frames are trained on; the two before each are samples, too.
        descriptor: Numbers of the spectral descriptor.
        size: Of proxies.
        progress: Called with the takes read and in all.
    """
    found, numbers = TakeSamples(), {}
    garment_of: list[int] = []
    before: list[tuple[int, int]] = []
    sides: dict[bool, list[int]] = {True: [], False: []}
    entries = [*((each, True) for each in training), *((each, False) for each in validation)]
    for read, (entry, trains) in enumerate(entries, 1):
        key = entry.dataset, tuple(entry.row.betas)
        if key not in numbers:
            made = worn_in(data.datasets[entry.dataset], entry.row.betas, size)
            numbers[key] = len(found.garments), made
            found.garments.append(garment_inputs(made.proxy, descriptor))
        garment, worn = numbers[key]
        proxy = worn.proxy
        take, trail = data.take(entry), None
        times = Times.always(take.motion[0])
        wanted = {frame for frame in take.clip_frames.tolist() if frame % stride == 0}
        needed = {max(frame - back, 0) for frame in wanted for back in (0, 1, 2)}
        own: dict[int, int] = {}
        for frame in range(len(take.motion)):
            pose = take.motion[frame]
            posed = proxy.shaped.posed(pose)
            if trail is None:
                trail = Trail.start(proxy, posed)
            else:
                trail = trail.stepped(proxy, posed, 1 / take.motion.fps)
                times = times.followed(pose, 1 / take.motion.fps)
            if frame not in needed:
                continue
            seen = Seen.of(pose)
            own[frame] = len(found._rows)
            if frame in wanted:
                sides[trains].append(own[frame])
            garment_of.append(garment)
            truth = take.vertices[frame][worn.kept]
            normals, heights = _clearance(truth, posed, seen, known=frame in wanted)
            found._rows.append(
                _Row(
                    times.window(),
                    seen.transforms(posed),
                    seen.into(posed.joints),
                    body_inputs(proxy.shaped, posed, seen),
                    seen.turn.astype(np.float32),
                    seen.into(truth),
                    lag_inputs(trail.told(proxy, posed)).astype(np.float16),
                    normals,
                    heights,
                )
            )
            before.append(tuple(own.get(max(frame - back, 0), own[frame]) for back in (1, 2)))  # type: ignore[arg-type]
        progress(read, len(entries))
    found.garment_of, found.before = np.array(garment_of), np.array(before)
    found.training, found.validation = np.array(sides[True]), np.array(sides[False])
    return found


def _clearance(truth: Vertices, posed: PosedBody, seen: Seen, *, known: bool) -> tuple[np.ndarray, np.ndarray]:
    """Half-spaces of a frame as the network sees it, float16; without terms where the frame is not trained on."""
    if not known:
        return np.zeros(truth.shape, np.float16), np.full(len(truth), np.inf, np.float16)
    normals, heights = clearance(truth, posed.vertices, posed.normals)
    return (normals @ seen.turn).astype(np.float16), heights.astype(np.float16)
