"""Sources of frames: a player that steps an animator, or a take that was simulated."""

from dataclasses import dataclass, replace
from typing import Any, Protocol, Self

import numpy as np

from hemline.animators import Animator, Settled, Windy
from hemline.arrays import Vertices
from hemline.bodies import ShapedBody
from hemline.collide import ProjectionReport
from hemline.datasets import Take
from hemline.garments import Garment
from hemline.motions import Motion, Pose
from hemline.playback import Frame, Player, PlayerState

NOT_PROJECTED = ProjectionReport(0, float("nan"), np.zeros(0, np.int32), np.zeros((0, 3), np.float32), None, False)
"""Report for frames of a simulation, which are not projected."""


@dataclass(frozen=True, eq=False)
class StoredFrame:
    """A frame and the state from which the next one is made."""

    state: Any
    frame: Frame


class FrameSource(Protocol):
    """Source of the frames of a `BasisNetwork`."""

    @property
    def body(self) -> ShapedBody:
        """The body that wears the garment."""
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
        """Makes a frame that has no predecessor.

        Args:
            index: Number of the frame.
            pose: Its pose, dragged where the user dragged it.
        """
        ...

    def after(self, before: StoredFrame, index: int, pose: Pose) -> StoredFrame:
        """Makes the frame 1 / fps after another one.

        Args:
            before: The other frame.
            index: Number of the new frame.
            pose: Its pose.
        """
        ...

    def truth(self, index: int) -> Vertices | None:
        """Returns the simulated garment in a frame (verts, 3) [m]; None without a simulation."""
        ...


@dataclass(frozen=True, eq=False)
class PlayedClip:
    """Frames of a player; from the start of the clip on they equal those of `hemline.play`, bit for bit."""

    player: Player
    clip: Motion
    """The clip as it was read."""
    motion: Motion
    """The clip as it is played."""
    take: Take | None = None
    """A simulation of the same clip."""

    @classmethod
    def on(cls, animator: Animator, body: ShapedBody, clip: Motion, *, fps: float, take: Take | None = None) -> Self:
        """Prepares a player.

        Args:
            animator: The animator of the garment.
            body: The body that wears it.
            clip: Any clip.
            fps: Frames per second; a take keeps its own.
            take: A simulation of the clip; its poses are played unchanged.
        """
        player = Player.prepare(animator, body, placed=True)
        return cls(player, clip, _place_clip(body, clip, fps) if take is None else take.motion, take)

    @property
    def body(self) -> ShapedBody:
        """The body that wears the garment."""
        return self.player.body

    @property
    def garment(self) -> Garment:
        """The garment that is shown."""
        return self.player.garment

    def first(self, index: int, pose: Pose) -> StoredFrame:
        """Settles the garment in a pose, as at the start of a clip."""
        dt = 1 / self.motion.fps
        return StoredFrame(*self.player.step(self.player.start(pose, dt=dt), pose, dt))

    def after(self, before: StoredFrame, index: int, pose: Pose) -> StoredFrame:
        """Plays the next frame."""
        return StoredFrame(*self.player.step(before.state, pose, 1 / self.motion.fps))

    def truth(self, index: int) -> Vertices | None:
        """Returns the garment of the take (verts, 3) [m]; None without a take."""
        return None if self.take is None else self.take.vertices[index]

    def reshape(self, state: PlayerState, body: ShapedBody) -> tuple[Self, PlayerState | None]:
        """Returns this source on a body of another shape, and the state to continue from.

        The state is None where the garment has to be put on anew, since the animator is not `Settled`.

        Args:
            state: A state of the player.
            body: The body of the new shape.
        """
        motion = _place_clip(body, self.clip, self.motion.fps)
        if not isinstance(self.player.animator, Settled):
            player = Player.prepare(self.player.animator, body, placed=True)
            return replace(self, player=player, motion=motion), None
        player, state = self.player.reshape(state, body)
        return replace(self, player=player, motion=motion), state

    def with_wind(self, wind: tuple[float, float, float]) -> Self:
        """Returns this source in another wind [m/s]; states remain valid. Only `Windy` animators change."""
        animator = self.player.animator
        if not isinstance(animator, Windy):
            return self
        return replace(self, player=replace(self.player, animator=animator.in_wind(wind)))


@dataclass(frozen=True, eq=False)
class SimulatedClip:
    """Frames of a take, as they were simulated."""

    take: Take
    garment: Garment
    body: ShapedBody
    """The body at the take's betas."""

    @property
    def motion(self) -> Motion:
        """The poses that the take was simulated against."""
        return self.take.motion

    def first(self, index: int, pose: Pose) -> StoredFrame:
        """Returns a frame of the take."""
        cloth = self.take.vertices[index]
        return StoredFrame(None, Frame(cloth, cloth, cloth, self.body.posed(self.motion[index]), NOT_PROJECTED, {}))

    def after(self, before: StoredFrame, index: int, pose: Pose) -> StoredFrame:
        """Returns a frame of the take."""
        return self.first(index, pose)

    def truth(self, index: int) -> Vertices | None:
        """Returns None, since the vertices (verts, 3) [m] that are shown are the take's own."""
        return None


def _place_clip(body: ShapedBody, clip: Motion, fps: float) -> Motion:
    """Places a clip on a body, then resamples it, in the same order as `hemline.play`."""
    placed = body.placed(clip)
    return placed if fps == placed.fps else placed.resample(fps)
