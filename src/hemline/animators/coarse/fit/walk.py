"""Takes walked through as the player walks through a motion, once: what networks learn from is kept in files."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hemline.animators.coarse.features.rest_features import fit_features, vertex_masses
from hemline.animators.coarse.features.seen import PelvisFrame, PoseHistory, body_inputs
from hemline.animators.coarse.features.trail import Trail
from hemline.animators.simulated_proxy import QUALITY_LEVELS
from hemline.arrays import Float
from hemline.datasets import Take, open_dataset
from hemline.datasets.collection import Collection, Entry
from hemline.errors import BadDataset
from hemline.files import content_hash, map_tensors, write_tensors
from hemline.garments.proxy.proxy import ProxySize
from hemline.sim.takes.jobs import Call, Job, Progress, run_jobs
from hemline.sim.takes.workers import workers

from .dataset_proxy import DatasetProxy, proxy_of_dataset
from .garment_frames import GarmentFrames

FRAMES_VERSION = 1
"""Raised when the same takes give other frames than before."""
FRAMES_KIND = "frames"
HALF_PRECISION = ("told", "turns", "apart", "motion")
"""Arrays that are kept in half precision."""


class _Damaged(BadDataset):
    """A file of frames that is not whole."""


@dataclass(frozen=True)
class TakeWalk:
    """Which frames are kept, of proxies of which size."""

    size: ProxySize
    stride: int
    """Every so many frames of a clip are kept."""
    recent: int = 2
    """How many frames before each of them are kept, too."""


@dataclass(frozen=True, eq=False)
class GarmentGroup:
    """Takes of one garment on one body."""

    folder: Path
    """The dataset."""
    betas: tuple[float, ...]
    names: tuple[str, ...]
    """Names of the takes."""


def walk_takes(
    data: Collection, entries: Sequence[Entry], walk: TakeWalk, folder: Path, *, jobs: int, tell: Progress
) -> tuple[list[GarmentFrames], list[list[Entry]]]:
    """Frames of takes, garment by garment and body by body.

    Each group of takes is walked through once, and its frames are kept in a file: a call that was killed goes on.

    Args:
        data: The datasets.
        entries: The takes.
        walk: Which frames.
        folder: Where the files are kept.
        jobs: Processes that walk.
        tell: Called with the groups done and in all.

    Returns:
        The frames of each group, mapped from its file; and its takes, which `WornFrames.take` counts.

    Raises:
        BadDataset: A take cannot be read.
        BadOutput: The folder cannot be written.
    """
    members: dict[tuple[int, tuple[float, ...]], list[Entry]] = {}
    for entry in entries:
        members.setdefault((entry.dataset, tuple(entry.row.betas)), []).append(entry)
    groups = [
        GarmentGroup(data.datasets[dataset].folder, betas, tuple(entry.row.name for entry in each))
        for (dataset, betas), each in members.items()
    ]
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / f"{_mark(group, walk)}.safetensors" for group in groups]
    done = 0

    def job(group: GarmentGroup, path: Path) -> Job[None]:
        nonlocal done
        if not _is_whole(path):
            yield Call(_walk_group, walk, (group, path))
        done += 1
        tell(done, len(groups))

    with workers(jobs) as those:
        run_jobs((job(*each) for each in zip(groups, paths, strict=True)), those)
    return [_map_file(path) for path in paths], list(members.values())


def _map_file(path: Path) -> GarmentFrames:
    arrays, metadata = map_tensors(path, FRAMES_KIND)
    return GarmentFrames.of(metadata["body"], arrays)


def _mark(group: GarmentGroup, walk: TakeWalk) -> str:
    """The name of a file: a hash of all that it depends on."""
    # names of takes are hashes of all that they were made of
    return content_hash(asdict(walk) | {"version": FRAMES_VERSION, "betas": group.betas, "names": group.names})


def _is_whole(path: Path) -> bool:
    if not path.exists():
        return False
    try:
        map_tensors(path, FRAMES_KIND, damaged=_Damaged)
    except _Damaged:
        return False
    return True


def _walk_group(walk: TakeWalk, given: tuple[GarmentGroup, Path], tell: Progress) -> None:
    """Walk through the takes of a group, and write its file."""
    group, path = given
    dataset = open_dataset(group.folder)
    worn = proxy_of_dataset(dataset, group.betas, walk.size)
    rows = {row.name: row for row in dataset.rows()}
    found: list[dict[str, Any]] = []
    for number, name in enumerate(group.names):
        found += frames_of(worn, dataset.take(rows[name]), walk, number)
    proxy = worn.proxy
    arrays: dict[str, Any] = {name: np.stack([each[name] for each in found]) for name in found[0]} if found else {}
    arrays |= {name: arrays[name].astype(np.float16) for name in HALF_PRECISION if name in arrays}
    arrays |= {
        "faces": proxy.garment.faces,
        "cut": proxy.garment.vertices,
        "fit": fit_features(proxy),
        "skin": proxy.skin.dense(),
        "mass": vertex_masses(proxy),
        "static": proxy.static,
        "cell": proxy.cells.cell,
        "near": proxy.cells.near,
        "shares": proxy.cells.shares,
    }
    if not found:
        cure = "ask for a smaller stride"
        raise BadDataset("a take must have a frame to learn from", f"none in {group.folder}", cure)
    frames = GarmentFrames.of(proxy.garment.body_name, arrays)
    write_tensors(path, frames.arrays(), {"kind": FRAMES_KIND, "garment": proxy.garment.name, "body": frames.body_name})


def frames_of(worn: DatasetProxy, take: Take, walk: TakeWalk, number: int) -> Iterator[dict[str, Any]]:
    """The kept frames of a take, by the names of `GarmentFrames`.

    As in play, the proxy is simulated until the lead-in is over, and is known to lie there then. A take that was
    simulated with the same settings says itself where that is.

    Args:
        worn: The garment on its body.
        take: The take.
        walk: Which frames.
        number: What `WornFrames.take` calls it.
    """
    proxy, dt = worn.proxy, 1 / take.motion.fps
    wanted = {frame for frame in take.clip_frames.tolist() if frame % walk.stride == 0}
    needed = {max(frame - back, 0) for frame in wanted for back in range(walk.recent + 1)} & set(
        take.clip_frames.tolist()
    )
    trail, times, lay = None, PoseHistory.always(take.motion[0]), _beginning_positions(worn, take)
    for frame in range(max(needed, default=-1) + 1):
        pose = take.motion[frame]
        posed = proxy.shaped.posed(pose)
        if trail is None:
            trail = Trail.start(proxy, posed)
        else:
            trail, times = trail.stepped(proxy, posed, dt), times.followed(pose, dt)
        if frame == max(0, int(take.lead_in.sum()) - 1):
            trail = trail.begun(lay)
        if frame not in needed:
            continue
        seen, truth = PelvisFrame.of(pose), take.vertices[frame][worn.vertex_ids]
        yield {
            "take": np.int32(number),
            "frame": np.int32(frame),
            "wanted": np.bool_(frame in wanted),
            "told": trail.told(proxy, posed),
            "turns": seen.turns(trail.turns),
            "apart": trail.turned_back(truth),
            "truth": seen.into(truth),
            "motion": times.window(),
            "transforms": seen.transforms(posed),
            "joints": seen.into(posed.joints),
            "body": body_inputs(proxy.shaped, posed, seen),
            "heading": seen.turn.astype(np.float32),
        }


def _beginning_positions(worn: DatasetProxy, take: Take) -> Float[np.ndarray, "verts 3"]:
    """Where a simulation as in play has brought the proxy when the lead-in is over [m]."""
    proxy, last = worn.proxy, int(take.lead_in.sum()) - 1
    same = content_hash(take.inputs.get("settings", {})) == content_hash(asdict(QUALITY_LEVELS["good"].settings()))
    if last >= 0 and same:
        return take.vertices[last][worn.vertex_ids]
    state = worn.simulator.start(proxy.shaped.posed(take.motion[0]))
    for frame in range(1, last + 1):
        state = worn.simulator.step(state, proxy.shaped.posed(take.motion[frame]), 1 / take.motion.fps)
    return state.positions.astype(np.float32)
