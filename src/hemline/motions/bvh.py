"""Reads Biovision hierarchies (BVH) with any joints and any order of channels."""

import re
import warnings
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from hemline.errors import BadMotion, HemlineWarning
from hemline.files.reading import TEXT_MAX, read_text

from .motion import FRAMES_MAX, RATES, check_rate
from .quaternions import from_euler

_ROTATIONS = {"xrotation": "X", "yrotation": "Y", "zrotation": "Z"}
_POSITIONS = {"xposition": 0, "yposition": 1, "zposition": 2}
_SECTION = re.compile(r"^\s*MOTION\s*$", re.IGNORECASE | re.MULTILINE)
_FRAMES_LINE = re.compile(r"\s*Frames\s*:?\s*(\S*)[^\S\n]*(?:\n|$)", re.IGNORECASE)
_TIME_LINE = re.compile(r"\s*Frame\s*Time\s*:?\s*(\S*)[^\S\n]*(?:\n|$)", re.IGNORECASE)
_JOINTS_MAX = 5_000
_TURN = 6.3
_RESTLESS = 8
"""A clip whose rotations all lie within a turn in radians may be in radians if so many channels change."""
_LARGEST = 1e9
"""Limit of angles and positions, in any unit."""
_ROTATIONS_UNCHECKED = 100_000
"""Number of rotations up to which joints without channels are accepted."""


@dataclass(frozen=True, eq=False)
class BvhSkeleton:
    """The hierarchy of a BVH file, in the file's own unit and axes.

    Attributes:
        names: Joint names, root first, a parent before its children.
        parents: Index of each joint's parent; -1 for the root.
        offsets: Position of each joint relative to its parent in the zero pose [file's unit].
        ends: Offset of the End Site of a leaf joint, by joint index [file's unit].
        channels: Channels of each joint, in their order.
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    offsets: Float[np.ndarray, "joints 3"]
    ends: dict[int, np.ndarray]
    channels: tuple[tuple[str, ...], ...]

    @property
    def zero_positions(self) -> Float[np.ndarray, "joints 3"]:
        """Positions of the joints when all rotations are zero [file's unit]."""
        positions = self.offsets.copy()
        for joint, parent in enumerate(self.parents):
            if parent >= 0:
                positions[joint] += positions[parent]
        return positions


@dataclass(frozen=True, eq=False)
class Bvh:
    """The content of a BVH file.

    Attributes:
        skeleton: Its hierarchy.
        rotations: Local rotation of each joint, unit quaternions wxyz.
        positions: Position relative to the parent, by joint index, of the root and of each joint that has channels for
            it; it replaces the offset [file's unit].
        fps: Frames a second.
        notes: What was guessed or mended when it was read, one sentence each.
    """

    skeleton: BvhSkeleton
    rotations: Float[np.ndarray, "frames joints 4"]
    positions: dict[int, Float[np.ndarray, "frames 3"]]
    fps: float
    notes: tuple[str, ...] = ()


def read_bvh(path: str | Path) -> Bvh:
    """Reads a BVH file as it is: nothing is renamed, scaled or turned.

    It takes what other readers take, and `Bvh.notes` says so: other cases and spacing, a byte order mark, another
    number of rows than declared, decimal commas, and several roots, of which the one with the most joints is read.

    Raises:
        BadMotion: The file is missing, too large, truncated or not a BVH, a number cannot be parsed or is not finite,
            the rows do not have a number a channel, there are more joints than channels, or the rate is implausible.
    """
    path = Path(path)
    text = read_text(path, TEXT_MAX, error=BadMotion, cure="name a BVH file", encoding="utf-8", strict=False)
    section = _SECTION.search(text)
    head = text[: section.start()] if section else text
    if section is None or not head.lstrip().upper().startswith("HIERARCHY"):
        got = "no section HIERARCHY" if "HIERARCHY" not in head.upper() else "no section MOTION"
        raise BadMotion(f"{path} is no whole BVH file", got, "copy it again from where it was made")
    whole = _hierarchy(head.split(), path)
    skeleton, columns, roots_note = _one_tree(whole, path)
    values, fps, notes = _frames(text[section.end() :], (len(columns), int(columns.sum())), path)
    _refuse_bare_joints(whole, values, path)
    values = values[:, columns] if values.shape[1] == len(columns) else values
    positions = _positions(skeleton, values)
    if not np.any(skeleton.offsets[1:]) and len(positions) > 1:
        skeleton = _offsets_from_positions(skeleton, positions)
        notes = (*notes, "all OFFSETs are zero: bones are those of the first frame's positions")
    notes = (*notes, roots_note) if roots_note else notes
    _warn_of_radians(skeleton, values, path)
    return Bvh(skeleton, _rotations(skeleton, values), positions, fps, notes)


def _warn_of_radians(skeleton: BvhSkeleton, values: np.ndarray, path: Path) -> None:
    """Warns of rotations that all lie within one turn in radians, and yet move much for so few degrees."""
    names = [name for channels in skeleton.channels for name in channels]
    turns = values[:, [column for column, name in enumerate(names) if name in _ROTATIONS]]
    if not turns.size or np.abs(turns).max() > _TURN or np.count_nonzero(np.ptp(turns, axis=0) > 0.3) < _RESTLESS:
        return
    what, got = f"rotations of {path} hardly turn a joint", f"none beyond {np.abs(turns).max():.3g} degrees"
    cure = "if they are in radians, multiply them by 57.29578: BVH has degrees"
    warnings.warn(HemlineWarning(what, got, cure), stacklevel=3)


def _one_tree(skeleton: BvhSkeleton, path: Path) -> tuple[BvhSkeleton, np.ndarray, str]:
    """Returns the tree with the most joints of several, which channels are its own, and a note."""
    root_of = list(range(len(skeleton.names)))
    for joint, parent in enumerate(skeleton.parents):
        root_of[joint] = root_of[parent] if parent >= 0 else joint
    sizes = Counter(root_of)
    chosen = max(sizes, key=lambda root: (sizes[root], -root))
    kept = [joint for joint, root in enumerate(root_of) if root == chosen]
    twice = Counter(skeleton.names[joint] for joint in kept).most_common(1)[0]
    if twice[1] > 1:
        what = f"joints of {path} must have different names"
        raise BadMotion(what, f"'{twice[0][:60]}' twice", "rename one of them")
    columns = np.repeat(root_of, [len(channels) for channels in skeleton.channels]) == chosen
    if len(sizes) == 1:
        return skeleton, columns, ""
    at = {joint: place for place, joint in enumerate(kept)}
    tree = BvhSkeleton(
        names=tuple(skeleton.names[joint] for joint in kept),
        parents=tuple(at.get(skeleton.parents[joint], -1) for joint in kept),
        offsets=skeleton.offsets[kept],
        ends={at[joint]: end for joint, end in skeleton.ends.items() if joint in at},
        channels=tuple(skeleton.channels[joint] for joint in kept),
    )
    others = ", ".join(f"'{skeleton.names[root]}' ({count} joints)" for root, count in sizes.items() if root != chosen)
    note = f"several roots: '{skeleton.names[chosen]}' ({len(kept)} joints) is read, {others} left out"
    return tree, columns, note


def _offsets_from_positions(skeleton: BvhSkeleton, positions: dict[int, np.ndarray]) -> BvhSkeleton:
    offsets = skeleton.offsets.copy()
    for joint, places in positions.items():
        if skeleton.parents[joint] >= 0:
            offsets[joint] = places[0]
    return replace(skeleton, offsets=offsets)


def _refuse_bare_joints(skeleton: BvhSkeleton, values: np.ndarray, path: Path) -> None:
    """Refuses joints without channels if they would take far more memory than the size of the file."""
    frames, channels = values.shape
    joints = len(skeleton.names)
    if joints > channels and frames * joints > _ROTATIONS_UNCHECKED:
        got = f"{joints} joints, {channels} channels, {frames} frames"
        raise BadMotion(f"{path} has more joints than channels", got, "give each joint its channels, or leave it out")


class _BadBvh(ValueError):
    """Describes what is wrong with a file."""


def _hierarchy(words: list[str], path: Path) -> BvhSkeleton:
    names: list[str] = []
    parents: list[int] = []
    offsets: list[list[float]] = []
    ends: dict[int, np.ndarray] = {}
    channels: list[tuple[str, ...]] = []
    open_joints: list[int] = []  # -1 stands for an End Site
    place = 1
    try:
        while place < len(words):
            word = words[place].upper()
            if word in ("ROOT", "JOINT"):
                brace = words.index("{", place)
                parents.append(open_joints[-1] if open_joints else -1)
                open_joints.append(len(names))
                names.append(" ".join(words[place + 1 : brace]))
                offsets.append([0.0, 0.0, 0.0])
                channels.append(())
                place = brace + 1
            elif word == "END":
                open_joints.append(-1)
                place = words.index("{", place) + 1
            elif word == "OFFSET":
                offset = [float(number) for number in words[place + 1 : place + 4]]
                if len(offset) != 3 or not open_joints:
                    raise _BadBvh("an OFFSET of other than three numbers, or of no joint")
                if open_joints[-1] == -1:
                    ends[open_joints[-2]] = np.array(offset)
                else:
                    offsets[open_joints[-1]] = offset
                place += 4
            elif word == "CHANNELS":
                count = int(words[place + 1])
                listed = tuple(channel.lower() for channel in words[place + 2 : place + 2 + count])
                if any(name not in _ROTATIONS and name not in _POSITIONS for name in listed) or len(listed) != count:
                    raise _BadBvh(f"CHANNELS {' '.join(words[place + 1 : place + 5])[:60]}")
                channels[open_joints[-1]] = listed
                place += 2 + count
            elif word == "}":
                open_joints.pop()
                place += 1
            else:
                raise _BadBvh(f"'{words[place][:60]}'")
        if open_joints or not names:
            raise _BadBvh("an end inside a joint")
        if not (np.abs(offsets) < _LARGEST).all():
            raise _BadBvh(f"an OFFSET that is NaN, infinite or beyond {_LARGEST:g}")
    except (ValueError, IndexError) as reason:
        got = reason if isinstance(reason, _BadBvh) else f"'{' '.join(words[place : place + 4])[:60]}'"
        raise BadMotion(f"the hierarchy of {path} cannot be read", got, "export the file again") from reason
    if len(names) > _JOINTS_MAX:
        cure = "export the bones of the body alone"
        raise BadMotion(f"{path} may have {_JOINTS_MAX} joints", len(names), cure)
    return BvhSkeleton(tuple(names), tuple(parents), np.array(offsets), ends, tuple(channels))


def _frames(text: str, widths: tuple[int, int], path: Path) -> tuple[np.ndarray, float, tuple[str, ...]]:
    """Returns the numbers of each frame, the rate, and notes.

    Args:
        text: The file after MOTION.
        widths: Number of channels of all roots, and of the one that is read: some files have no numbers for others.
        path: The file.
    """
    again = "copy the file again from where it was made"
    frames_line = _FRAMES_LINE.match(text)
    time_line = _TIME_LINE.match(text, frames_line.end()) if frames_line else None
    if frames_line is None or time_line is None:
        raise BadMotion(f"the motion of {path} cannot be read", "no 'Frames:' or no 'Frame Time:'", again)
    notes, body = [], text[time_line.end() :]
    time_word = time_line[1]
    if "," in body and "." not in body:
        body, time_word = body.replace(",", "."), time_word.replace(",", ".")
        notes.append("decimal commas are read as points")
    word = ""
    try:
        frame_count, frame_time = int(word := frames_line[1]), float(word := time_word.replace(",", "."))
        if frame_count < 1 or not (np.isfinite(frame_time) and frame_time > 0):
            raise _BadBvh(f"{_short(frame_count)} frames of {frame_time} s")
        if frame_count > FRAMES_MAX:
            raise _BadBvh(f"{_short(frame_count)} frames, more than {FRAMES_MAX}, which are an hour at 120 a second")
        fps = _rate(frame_time, path)
        values = np.fromiter((float(word := each) for each in _words(body)), np.float64)
    except (ValueError, OverflowError) as reason:
        if isinstance(reason, BadMotion):
            raise
        got = reason if isinstance(reason, _BadBvh) else f"'{word.strip()[:60]}' in place of a number"
        raise BadMotion(f"the motion of {path} cannot be read", got, again) from reason
    in_first = len(body.lstrip().partition("\n")[0].split())
    channel_count = in_first if in_first == widths[1] else widths[0]
    rows = len(values) / max(channel_count, 1)
    if in_first != channel_count and rows != frame_count:
        what = f"each frame of {path} must have {channel_count} numbers, one a channel"
        raise BadMotion(what, f"{in_first} in the first", "make CHANNELS and the lines of numbers agree")
    if rows != int(rows) or not 1 <= rows <= FRAMES_MAX:
        got = f"{len(values)} numbers, enough for {rows:.6g}"
        raise BadMotion(f"{path} declares {frame_count} frames", got, again)
    if rows != frame_count:
        notes.append(f"the file declares {frame_count} frames and has {int(rows)}: {int(rows)} are read")
        if rows < 0.9 * frame_count:
            what = f"{path} declares {frame_count} frames, and ends before"
            warnings.warn(HemlineWarning(what, f"{int(rows)}", f"{again}, if there should be more"), stacklevel=3)
    odd = ~(np.abs(values) < _LARGEST)  # also of NaN
    if odd.any():
        got = f"NaN or infinity in frame {int(np.argmax(odd)) // channel_count}, or a number beyond {_LARGEST:g}"
        raise BadMotion(f"{path} must hold finite numbers", got, "cut or mend that frame")
    return values.reshape(int(rows), channel_count), fps, tuple(notes)


def _rate(frame_time: float, path: Path) -> float:
    """Returns frames a second. Frame times are printed with few digits: 0.0083333 is 120 a second.

    Raises:
        BadMotion: The rate is not from 1 to 1000 frames a second.
    """
    if frame_time > 1 / RATES[0]:
        what = f"'Frame Time' of {path} must be the seconds of a frame, at most {1 / RATES[0]:g}"
        likely = [
            f"write {seconds:.6g} if it is {what_it_is}"
            for seconds, what_it_is in ((frame_time / 1000, "in milliseconds"), (1 / frame_time, "frames a second"))
            if 1 / RATES[1] <= seconds <= 1 / RATES[0]
        ]
        cure = ", ".join(likely) or "export it again at 30 frames a second"
        raise BadMotion(what, f"{frame_time:g}", cure)
    fps = 1 / max(frame_time, 1e-6)
    whole = round(fps)
    return check_rate(float(whole) if abs(fps - whole) < 1e-3 * fps else fps, path)


def _words(text: str) -> Iterator[str]:
    """Yields the words of a text, line by line, since all of them at once would take thirty times its memory."""
    start = 0
    while start < len(text):
        end = text.find("\n", start)
        end = len(text) if end < 0 else end
        yield from text[start:end].split()
        start = end + 1


def _short(number: int) -> str:
    """Formats a number that may have thousands of digits."""
    return str(number) if abs(number) < 10**12 else "far too many"


def _rotations(skeleton: BvhSkeleton, values: np.ndarray) -> np.ndarray:
    rotations = np.zeros((len(values), len(skeleton.names), 4))
    rotations[..., 0] = 1
    by_order: dict[str, list[tuple[int, list[int]]]] = {}
    column = 0
    for joint, channels in enumerate(skeleton.channels):
        turns = [column + index for index, name in enumerate(channels) if name in _ROTATIONS]
        order = "".join(_ROTATIONS[name] for name in channels if name in _ROTATIONS)
        by_order.setdefault(order, []).append((joint, turns))
        column += len(channels)
    for order, entries in by_order.items():
        joints, turns = [joint for joint, _ in entries], [columns for _, columns in entries]
        if order:
            rotations[:, joints] = from_euler(np.radians(values[:, turns]), order)
    return rotations


def _positions(skeleton: BvhSkeleton, values: np.ndarray) -> dict[int, np.ndarray]:
    positions = {0: np.tile(skeleton.offsets[0], (len(values), 1))}
    column = 0
    for joint, channels in enumerate(skeleton.channels):
        for index, name in enumerate(channels):
            if name in _POSITIONS:
                places = positions.setdefault(joint, np.tile(skeleton.offsets[joint], (len(values), 1)))
                places[:, _POSITIONS[name]] = values[:, column + index]
        column += len(channels)
    return positions
