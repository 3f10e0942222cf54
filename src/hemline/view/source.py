"""Where frames come from: a player that steps an animator, or a take that was simulated."""

from dataclasses import dataclass, replace
from typing import Any, Protocol, Self

import numpy as np

from hemline.animators import Animator, Settled
from hemline.arrays import Vertices
from hemline.bodies import ShapedBody
from hemline.collide import ProjectionReport
from hemline.datasets import Take
from hemline.garments import Garment
from hemline.motions import Motion, Pose
from hemline.playback import Frame, Player

from .wind import with_wind

NOT_PROJECTED = ProjectionReport(0, float("nan"), np.zeros(0, np.int32), np.zeros((0, 3), np.float32), None, False)
"""Of frames that come from the simulation."""


@dataclass(frozen=True, eq=False)
class StoredFrame:
    """A frame, and all that the next one needs."""

    state: Any
    frame: Frame


class FrameSource(Protocol):
    """What a `Stage` asks for frames."""

    @property
    def body(self) -> ShapedBody:
        """Who wears the garment."""
        ...

    @property
    def garment(self) -> Garment:
        """The garment that is shown."""
        ...

    @property
    def motion(self) -> Motion:
        """The clip as it is played: placed on the body, at the frame rate of the stage."""
        ...

    def first(self, index: int, pose: Pose) -> StoredFrame:
        """A frame with nothing before it; `pose` is that of frame `index`, dragged where it was."""
        ...

    def after(self, kept: StoredFrame, index: int, pose: Pose) -> StoredFrame:
        """The frame a time of 1 / fps after another one."""
        ...

    def truth(self, index: int) -> Vertices | None:
        """What the simulation made of a frame (verts, 3) [m]; None where it did not."""
        ...


@dataclass(frozen=True, eq=False)
class PlayedClip:
    """Frames of a player. Those from the clip's start on are those of `hemline.play`, bit for bit."""

    player: Player
    clip: Motion
    """As it was read."""
    motion: Motion
    """As it is played."""
    take: Take | None = None
    """The same clip, simulated."""

    @classmethod
    def on(cls, animator: Animator, body: ShapedBody, clip: Motion, *, fps: float, take: Take | None = None) -> Self:
        """Prepare a player.

        Args:
            animator: What moves the garment.
            body: Who wears it.
            clip: Any clip.
            fps: Frames a second; of a take its own are kept.
            take: Its truth, whose poses are played as they are.
        """
        player = Player.prepare(animator, body, placed=True)
        return cls(player, clip, _place_clip(body, clip, fps) if take is None else take.motion, take)

    @property
    def body(self) -> ShapedBody:
        """Who wears the garment."""
        return self.player.body

    @property
    def garment(self) -> Garment:
        """The garment that is shown."""
        return self.player.garment

    def first(self, index: int, pose: Pose) -> StoredFrame:
        """The garment settled in a pose, as at the start of a clip."""
        dt = 1 / self.motion.fps
        return StoredFrame(*self.player.step(self.player.start(pose, dt=dt), pose, dt))

    def after(self, kept: StoredFrame, index: int, pose: Pose) -> StoredFrame:
        """The next frame."""
        return StoredFrame(*self.player.step(kept.state, pose, 1 / self.motion.fps))

    def truth(self, index: int) -> Vertices | None:
        """Of the take [m]."""
        return None if self.take is None else self.take.vertices[index]

    @property
    def settled(self) -> bool:
        """Whether the body's shape can change without a new start."""
        return isinstance(self.player.animator, Settled)

    def reshaped(self, body: ShapedBody) -> Self:
        """The same on a body of another shape; the garment of settled states is kept, others are put on anew."""
        motion = _place_clip(body, self.clip, self.motion.fps)
        if self.settled:
            return replace(self, player=replace(self.player, body=body, collider=body), motion=motion)
        return replace(self, player=Player.prepare(self.player.animator, body, placed=True), motion=motion)

    def blown(self, wind: tuple[float, float, float]) -> Self:
        """The same in another wind [m/s], from the next frame on."""
        return replace(self, player=replace(self.player, animator=with_wind(self.player.animator, wind)))


@dataclass(frozen=True, eq=False)
class SimulatedClip:
    """Frames of a take, as they were simulated."""

    take: Take
    garment: Garment
    body: ShapedBody
    """At the take's betas."""

    @property
    def motion(self) -> Motion:
        """The very poses of the simulation."""
        return self.take.motion

    def first(self, index: int, pose: Pose) -> StoredFrame:
        """A frame of the take."""
        cloth = self.take.vertices[index]
        return StoredFrame(None, Frame(cloth, cloth, cloth, self.body.posed(self.motion[index]), NOT_PROJECTED, {}))

    def after(self, kept: StoredFrame, index: int, pose: Pose) -> StoredFrame:
        """A frame of the take."""
        return self.first(index, pose)

    def truth(self, index: int) -> Vertices | None:
        """None: the take is what is shown (verts, 3) [m]."""
        return None


def _place_clip(body: ShapedBody, clip: Motion, fps: float) -> Motion:
    """As `hemline.play` does it: placed, then at the frame rate."""
    placed = body.placed(clip)
    return placed if fps == placed.fps else placed.resampled(fps)
