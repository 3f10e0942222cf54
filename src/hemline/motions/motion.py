"""Poses of the 24-joint skeleton, and motions, which are clips of them."""

import operator
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import overload

import numpy as np
from jaxtyping import Float

from hemline.arrays import Quaternions
from hemline.errors import BadMotion
from hemline.files import content_hash

from .quaternions import continuous, slerp

JOINT_NAMES = (
    "pelvis",
    "left_hip",
    "right_hip",
    "spine1",
    "left_knee",
    "right_knee",
    "spine2",
    "left_ankle",
    "right_ankle",
    "spine3",
    "left_foot",
    "right_foot",
    "neck",
    "left_collar",
    "right_collar",
    "head",
    "left_shoulder",
    "right_shoulder",
    "left_elbow",
    "right_elbow",
    "left_wrist",
    "right_wrist",
    "left_hand",
    "right_hand",
)
"""Names of the joints, in the order of all arrays."""

PARENTS = (-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 20, 21)
"""Parent of each joint; -1 for the pelvis. A parent always comes before its children."""

JOINT_COUNT = len(JOINT_NAMES)

RATES = (1.0, 1000.0)
"""Least and greatest number of frames a second of a clip."""

FRAMES_MAX = 432_000
"""Largest number of frames of a clip: an hour at 120 a second."""


@dataclass(frozen=True, eq=False)
class Pose:
    """A pose: the rotation of each joint, and the position of the pelvis.

    Attributes:
        rotations: Local rotation of each joint relative to its parent, unit quaternions wxyz; identity is the T-pose:
            arms along x, legs straight down, facing +z.
        translation: Position of the pelvis joint in the world [m].
        clip: The motion, as it was read, of which this is a frame; a `Player` places the pose by it. None: the pose is
            on its body already.

    Raises:
        BadMotion: Shapes are wrong, numbers are not finite, or a quaternion is not of length one.
    """

    rotations: Quaternions
    translation: Float[np.ndarray, "3"]
    clip: "Motion | None" = field(default=None, repr=False)

    def __post_init__(self) -> None:
        rotations, translation = _validate(self.rotations, self.translation, ())
        object.__setattr__(self, "rotations", rotations)
        object.__setattr__(self, "translation", translation)

    @cached_property
    def hash(self) -> str:
        """Short hash of the content."""
        return content_hash(self.rotations, self.translation)

    def move_to(self, translation: Float[np.ndarray, "3"]) -> "Pose":
        """Returns this pose at another position, on its body and so without a clip.

        Its rotations are not checked again, which would take longer than everything else.

        Args:
            translation: Position of the pelvis joint in the world, finite, float32 [m].
        """
        moved = object.__new__(Pose)
        for name, value in (("rotations", self.rotations), ("translation", translation), ("clip", None)):
            object.__setattr__(moved, name, value)
        return moved


@dataclass(frozen=True, eq=False)
class Motion:
    """A clip of poses at a constant rate.

    Attributes:
        rotations: Local rotation of each joint in each frame, as in `Pose`.
        translations: Position of the pelvis joint in each frame [m].
        fps: Frames a second.
        leg_length: Hip to knee to ankle of the body that the translations are scaled for [m].
        name: Name of the clip.
        source: File and number of the recording.
        licence: Terms, in short.
        notes: What was guessed, ignored or dropped when it was read, one sentence each.

    Raises:
        BadMotion: Shapes are wrong, there is no frame, numbers are not finite, a quaternion is not of length one, the
            rate is not from 1 to 1000 frames a second, or the leg length is not positive.
    """

    rotations: Float[np.ndarray, "frames joints 4"]
    translations: Float[np.ndarray, "frames 3"]
    fps: float
    leg_length: float
    name: str = ""
    source: str = ""
    licence: str = ""
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        frames = (len(np.atleast_1d(self.rotations)),)
        if frames == (0,):
            raise BadMotion(f"motion '{self.name}' must have a frame", "none", "take a longer stretch")
        rotations, translations = _validate(self.rotations, self.translations, frames)
        object.__setattr__(self, "rotations", rotations)
        object.__setattr__(self, "translations", translations)
        leg = float(self.leg_length)
        if not (np.isfinite(leg) and leg > 0):
            raise BadMotion(f"leg_length of motion '{self.name}' must be positive", leg, "give a number above 0")
        object.__setattr__(self, "fps", check_rate(float(self.fps), f"motion '{self.name}'"))
        object.__setattr__(self, "leg_length", leg)
        object.__setattr__(self, "notes", tuple(self.notes))

    def __len__(self) -> int:
        return len(self.rotations)

    @overload
    def __getitem__(self, index: int) -> Pose: ...
    @overload
    def __getitem__(self, index: slice) -> "Motion": ...
    def __getitem__(self, index: int | slice) -> "Pose | Motion":
        """Returns the pose of a frame, or the motion of a range of frames; a step of 2 halves the rate."""
        if not isinstance(index, slice):
            index = operator.index(index)
            return Pose(self.rotations[index], self.translations[index], self)
        if index.step is not None and index.step < 1:
            raise BadMotion("a stretch of a motion must go forward", f"step {index.step}", "use a step of 1 or more")
        return replace(
            self,
            rotations=self.rotations[index],
            translations=self.translations[index],
            fps=self.fps / (index.step or 1),
        )

    @property
    def seconds(self) -> float:
        """Time from the first frame to the last [s]."""
        return (len(self) - 1) / self.fps

    @cached_property
    def hash(self) -> str:
        """Short hash of rotations, translations, rate and leg length, but not of names."""
        return content_hash(self.rotations, self.translations, {"fps": self.fps, "leg_length": self.leg_length})

    def at(self, seconds: float) -> Pose:
        """Returns the pose at any time, by slerp: before the start the first one, after the end the last one."""
        rotations, translations = self._between_frames(np.array([seconds], dtype=np.float64))
        return Pose(rotations[0], translations[0], self)

    def resample(self, fps: float) -> "Motion":
        """Returns this motion at another rate, by slerp, from the first frame to the last or just before it.

        Raises:
            BadMotion: The rate is not positive, or the result would have more than 432,000 frames.
        """
        if not (np.isfinite(fps) and fps > 0):
            raise BadMotion(f"fps of motion '{self.name}' must be positive", fps, "give a number above 0")
        if fps == self.fps:
            return self
        frames = self.frames_at(fps)
        if frames > FRAMES_MAX:
            got = f"{frames} for {self.seconds:.6g} s"
            raise BadMotion(
                f"motion '{self.name}' may have {FRAMES_MAX} frames at {fps:g} a second", got, "cut it first"
            )
        rotations, translations = self._between_frames(np.arange(frames) / fps)
        rotations = continuous(rotations)
        return replace(self, rotations=rotations, translations=translations, fps=fps)

    def at_speed(self, speed: float) -> "Motion":
        """Returns this motion played faster (above 1) or slower, at the same rate; its name says the speed.

        Args:
            speed: Playback speed, as a multiple of the recorded one.

        Raises:
            BadMotion: The speed is not positive, or the result would have more than 432,000 frames.
        """
        if not (np.isfinite(speed) and speed > 0):
            raise BadMotion(f"speed of motion '{self.name}' must be positive", speed, "give a number above 0")
        if speed == 1:
            return self
        return replace(self, fps=self.fps * speed, name=f"{self.name} x{speed:g}").resample(self.fps)

    def frames_at(self, fps: float) -> int:
        """Returns the number of frames of this motion at another rate."""
        return len(self) if fps == self.fps else int(np.floor(self.seconds * fps + 1e-3)) + 1

    def _between_frames(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        place = np.clip(times * self.fps, 0, len(self) - 1)
        before = np.floor(place).astype(np.int64)
        after = np.minimum(before + 1, len(self) - 1)
        fraction = place - before
        rotations = slerp(
            self.rotations[before].astype(np.float64), self.rotations[after].astype(np.float64), fraction[:, None]
        )
        start, end = self.translations[before].astype(np.float64), self.translations[after].astype(np.float64)
        return rotations, start + fraction[:, None] * (end - start)


def check_rate(fps: float, clip: object) -> float:
    """Checks the rate of a clip, which messages call `clip`, and returns it.

    Raises:
        BadMotion: The rate is not from 1 to 1000 frames a second.
    """
    if not RATES[0] <= fps <= RATES[1]:
        what = f"{clip} must have from {RATES[0]:g} to {RATES[1]:g} frames a second"
        raise BadMotion(what, f"{fps:.6g}", "correct its rate, or export it again at 30")
    return fps


def _validate(
    rotations: np.ndarray, translations: np.ndarray, frames: tuple[int, ...]
) -> tuple[np.ndarray, np.ndarray]:
    """Checks rotations and translations, and returns both as C-contiguous float32, with quaternions of length one."""
    turned, moved = np.asarray(rotations), np.asarray(translations)
    expected = (*frames, JOINT_COUNT, 4), (*frames, 3)
    if turned.shape != expected[0] or moved.shape != expected[1]:
        raise BadMotion(
            f"rotations must be {expected[0]} and translations {expected[1]}",
            f"{turned.shape} and {moved.shape}",
            "give one quaternion wxyz a joint and one pelvis position a frame",
        )
    norms = np.sqrt(np.einsum("...i,...i->...", turned, turned, dtype=np.float64))
    if not (np.isfinite(norms).all() and np.isfinite(moved).all()):
        raise BadMotion("a motion must be finite", "NaN or infinity", "mend or cut the frames that hold it")
    off = np.abs(norms - 1)
    if off.max() > 1e-2:
        raise BadMotion(
            "rotations must be unit quaternions", f"one of length {norms.flat[off.argmax()]:.3g}", "normalise"
        )
    if off.max() > 1e-6:  # rounding to float32 stays below, so that saving and loading changes no bit
        turned = turned / norms[..., None]
    return np.ascontiguousarray(turned, dtype=np.float32), np.ascontiguousarray(moved, dtype=np.float32)
