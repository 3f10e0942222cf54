"""Extracts training frames from takes by stepping through each take once, as the player steps through a motion."""

import shutil
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hemline.animators.coarse.features.columns import DYNAMIC
from hemline.animators.coarse.features.pelvis_frame import PelvisFrame, body_inputs
from hemline.animators.coarse.features.pose_history import PoseHistory
from hemline.animators.coarse.features.rest_features import fit_features, vertex_masses
from hemline.animators.coarse.features.trail import Trail
from hemline.animators.newton_solver import newton_settings
from hemline.arrays import Float
from hemline.datasets import Take, open_dataset
from hemline.datasets.collection import Collection, Entry
from hemline.errors import BadDataset, BadOutput
from hemline.files import content_hash, map_tensors, write_tensors
from hemline.garments.proxy.proxy import ProxySize, proxy_count
from hemline.sim.takes.jobs import Call, Job, Progress, run_jobs
from hemline.sim.takes.workers import workers

from .dataset_proxy import DatasetProxy, proxy_of_dataset
from .garment_frames import GarmentFrames

FRAMES_VERSION = 1
"""Version of the frames; raise it when the same takes give other frames than before."""
FRAMES_KIND = "frames"
"""Kind of the files, see `docs/format.md`."""
HALF_PRECISION = ("told", "turns", "apart", "motion")
"""Names of the arrays that are stored in half precision."""


VERTEX_BYTES = 2 * DYNAMIC.count + 26
"""Size of a vertex of a stored frame: features, rotation and displacement in half precision, and position."""
FRAME_BYTES = 12_000
"""Size of what a stored frame has besides its vertices, most of it the last poses."""


class _Damaged(BadDataset):
    """A file of frames is damaged."""


@dataclass(frozen=True)
class TakeWalk:
    """Which frames to extract. Field names enter a hash, so that they must not change."""

    size: ProxySize
    """Size of the proxies."""
    stride: int
    """Interval between the frames of a clip that are trained on [frames]."""
    recent: int = 0
    """Number of frames before each of them that are extracted with it."""


@dataclass(frozen=True, eq=False)
class GarmentGroup:
    """Takes of one garment on one body."""

    folder: Path
    """Folder of the dataset."""
    betas: tuple[float, ...]
    """Shape of the body."""
    names: tuple[str, ...]
    """Names of the takes."""


def walk_takes(
    data: Collection, entries: Sequence[Entry], walk: TakeWalk, folder: Path, *, jobs: int, tell: Progress
) -> tuple[list[GarmentFrames], list[list[Entry]]]:
    """Extracts the frames of takes, by garment and body.

    The frames of each group of takes are stored in a file, so that a killed call continues where it stopped.

    Args:
        data: The datasets.
        entries: The takes.
        walk: Frames to extract.
        folder: Folder for the files.
        jobs: Number of processes.
        tell: Called with the groups done and the number of groups.

    Returns:
        The frames of each group, mapped from its file, and its takes in the order that `GarmentFrames.take` counts.

    Raises:
        BadDataset: A take cannot be read.
        BadOutput: The folder cannot be written, or its disk has no room for the frames.
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
    missing = [entry for each, path in zip(members.values(), paths, strict=True) if not path.exists() for entry in each]
    check_room(folder, frame_bytes(data, missing, walk))
    done = 0

    def job(group: GarmentGroup, path: Path) -> Job[None]:
        nonlocal done
        if not _is_whole(path):
            yield Call(_walk_group, walk, (group, path))
        done += 1
        tell(done, len(groups))

    with workers(jobs) as processes:
        run_jobs((job(*each) for each in zip(groups, paths, strict=True)), processes)
    return [_map_file(path) for path in paths], list(members.values())


def frame_bytes(data: Collection, entries: Sequence[Entry], walk: TakeWalk) -> int:
    """Returns about how many bytes the frames of takes need on the disk; they are mapped, not read, into memory.

    Args:
        data: The datasets.
        entries: The takes.
        walk: Frames to extract.
    """
    sizes = {each: proxy_count(data.garments[each], walk.size) for each in {entry.dataset for entry in entries}}
    total = 0
    for entry in entries:
        frames = min(entry.row.clip_frames, -(-entry.row.clip_frames // walk.stride) * (walk.recent + 1))
        total += frames * (VERTEX_BYTES * sizes[entry.dataset] + FRAME_BYTES)
    return total


def check_room(folder: Path, needed: int) -> None:
    """Checks that the disk of a folder has room for so many bytes.

    Raises:
        BadOutput: It has not.
    """
    free = shutil.disk_usage(folder).free
    if needed > free:
        cure = "raise --stride, name fewer takes, or write the model to another disk (-o)"
        raise BadOutput(
            f"the frames of a fit need {needed / 1e9:.1f} GB in {folder}", f"{free / 1e9:.1f} GB free", cure
        )


def _map_file(path: Path) -> GarmentFrames:
    arrays, metadata = map_tensors(path, FRAMES_KIND)
    return GarmentFrames.of(metadata["body"], arrays)


def _mark(group: GarmentGroup, walk: TakeWalk) -> str:
    """Returns the name of a file: a hash of everything that it depends on."""
    # the name of a take is a hash of everything that it was made from
    return content_hash(asdict(walk) | {"version": FRAMES_VERSION, "betas": group.betas, "names": group.names})


def _is_whole(path: Path) -> bool:
    if not path.exists():
        return False
    try:
        map_tensors(path, FRAMES_KIND, damaged=_Damaged)
    except _Damaged:
        return False
    return True


def _walk_group(walk: TakeWalk, task: tuple[GarmentGroup, Path], tell: Progress) -> None:
    """Steps through the takes of a group and writes its file."""
    group, path = task
    dataset = open_dataset(group.folder)
    on_body = proxy_of_dataset(dataset, group.betas, walk.size)
    rows = {row.name: row for row in dataset.rows()}
    extracted: list[dict[str, Any]] = []
    for number, name in enumerate(group.names):
        extracted += frames_of(on_body, dataset.take(rows[name]), walk, number)
    proxy, names = on_body.proxy, extracted[0] if extracted else ()
    arrays: dict[str, Any] = {name: np.stack([each[name] for each in extracted]) for name in names}
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
    if not extracted:
        cure = "ask for a smaller stride"
        raise BadDataset("a take must have a frame to learn from", f"none in {group.folder}", cure)
    frames = GarmentFrames.of(proxy.garment.body_name, arrays)
    write_tensors(path, frames.arrays(), {"kind": FRAMES_KIND, "garment": proxy.garment.name, "body": frames.body_name})


def frames_of(on_body: DatasetProxy, take: Take, walk: TakeWalk, number: int) -> Iterator[dict[str, Any]]:
    """Extracts the frames of a take, by the names of the arrays in files of `GarmentFrames`.

    As in play, the proxy is simulated until the end of the lead-in, and where it lies then is its beginning. If the
    take was simulated with the same settings, its own vertices are used.

    Args:
        on_body: The proxy on its body.
        take: The take.
        walk: Frames to extract.
        number: Number of the take in `GarmentFrames.take`.
    """
    proxy, dt = on_body.proxy, 1 / take.motion.fps
    wanted = {frame for frame in take.clip_frames.tolist() if frame % walk.stride == 0}
    needed = {max(frame - back, 0) for frame in wanted for back in range(walk.recent + 1)} & set(
        take.clip_frames.tolist()
    )
    trail, poses, beginning = None, PoseHistory.standing(take.motion[0]), _beginning_positions(on_body, take)
    for frame in range(max(needed, default=-1) + 1):
        pose = take.motion[frame]
        posed = proxy.shaped.posed(pose)
        if trail is None:
            trail = Trail.start(proxy, posed)
        else:
            trail, poses = trail.advance(proxy, posed, dt), poses.advance(pose, dt)
        if frame == max(0, int(take.lead_in.sum()) - 1):
            trail = trail.with_beginning(beginning)
        if frame not in needed:
            continue
        local, truth = PelvisFrame.of(pose), take.vertices[frame][on_body.vertex_ids]
        yield {
            "take": np.int32(number),
            "frame": np.int32(frame),
            "wanted": np.bool_(frame in wanted),
            "told": trail.features(proxy, posed),
            "turns": local.local_turns(trail.turns),
            "apart": trail.local_offsets(truth),
            "truth": local.to_local(truth),
            "motion": poses.window(),
            "transforms": local.local_transforms(posed),
            "joints": local.to_local(posed.joints),
            "body": body_inputs(proxy.shaped, posed, local),
            "heading": local.turn.astype(np.float32),
        }


def _beginning_positions(on_body: DatasetProxy, take: Take) -> Float[np.ndarray, "verts 3"]:
    """Returns the positions of the proxy at the end of the lead-in, simulated as in play [m]."""
    proxy, last = on_body.proxy, int(take.lead_in.sum()) - 1
    same = content_hash(take.inputs.get("settings", {})) == content_hash(asdict(newton_settings()))
    if last >= 0 and same:
        return take.vertices[last][on_body.vertex_ids]
    state = on_body.simulator.start(proxy.shaped.posed(take.motion[0]))
    for frame in range(1, last + 1):
        state = on_body.simulator.step(state, proxy.shaped.posed(take.motion[frame]), 1 / take.motion.fps)
    return state.positions.astype(np.float32)
