"""What is played, and at which frame: no browser, no clock."""

import numpy as np

from hemline.arrays import Vertices
from hemline.bodies import ShapedBody
from hemline.errors import BadInput
from hemline.motions import Pose
from hemline.playback import Frame

from .body_shift import BodyShift
from .source import StoredFrame, PlayedClip, FrameSource

STORED_FRAMES = 300
"""Frames that are kept to go back to, about one megabyte each for the cape."""


class Stage:
    """A garment on a body in a clip, at one frame of it.

    Frames are made one after the other and kept, so that going back costs nothing and what is shown does not depend on
    how one came there. What changes a frame's past (the body's shape, wind, a hand that drags the body) leaves only the
    present one: later frames go on from there, and earlier ones start anew where they are asked for.

    Args:
        source: Where frames come from; the clip's first one is made at once.

    Example:
        >>> import hemline
        >>> from hemline.view import Played, Stage
        >>> shirt, body = hemline.load("tshirt-light"), hemline.bodies.load("anny24").shaped()
        >>> stage = Stage(Played.on(shirt, body, hemline.motions.load("walk"), fps=30.0))
        >>> stage.go(2)
        >>> stage.arrive()
        >>> stage.index, stage.frame.vertices.shape
        (2, (3150, 3))
    """

    def __init__(self, source: FrameSource):
        self.source = source
        self.shift = self.hand = BodyShift()
        self.index = self.goal = 0
        self._kept: dict[int, StoredFrame] = {}
        self._begin(0)

    @property
    def count(self) -> int:
        """Frames of the clip."""
        return len(self.source.motion)

    @property
    def fps(self) -> float:
        """Frames a second."""
        return self.source.motion.fps

    @property
    def frame(self) -> Frame:
        """What is shown."""
        return self._kept[self.index].frame

    @property
    def truth(self) -> Vertices | None:
        """The simulation's version of it [m]; None where there is none, or the body was dragged out of it."""
        return self.source.truth(self.index) if self.shift.still else None

    @property
    def arrived(self) -> bool:
        """Whether the frame that was asked for is shown."""
        return self.index == self.goal and not self.reaching

    @property
    def reaching(self) -> bool:
        """Whether the body still follows the hand."""
        return self.shift is not self.hand

    @property
    def known(self) -> range:
        """Frames that are kept: a stretch without a gap."""
        first = min(self._kept)
        return range(first, first + len(self._kept))

    def kept(self, index: int) -> Frame:
        """A frame that is kept."""
        return self._kept[index].frame

    def go(self, index: int) -> None:
        """Ask for a frame; `move` comes nearer to it.

        Raises:
            BadInput: The clip has no such frame.
        """
        if not 0 <= index < self.count:
            raise BadInput(f"the clip has frames 0 to {self.count - 1}", index, "ask for one of them")
        self.goal = index

    def next(self) -> None:
        """Ask for the next frame; after the last one comes the first, from which the clip starts anew."""
        self.go((self.index + 1) % self.count)

    def move(self) -> None:
        """Come one frame nearer to the one that was asked for: shown at once where it is kept."""
        if self.reaching:
            if self.goal == self.index:
                return self.hold()
            self._follow_hand()
        if self.goal in self._kept:
            self.index = self.goal
        elif self.goal < self.known.start:
            self._begin(self.goal)
        else:
            last = self.known[-1]
            self._keep(last + 1, self.source.after(self._kept[last], last + 1, self._pose(last + 1)))
        return None

    def arrive(self) -> None:
        """Go all the way."""
        while not self.arrived:
            self.move()

    def hold(self) -> None:
        """Let a time of 1 / fps pass in the pose of this frame: the garment swings out, the body follows the hand."""
        if self.reaching:
            self._follow_hand()
        self._forget()
        self.goal = self.index
        self._keep(self.index, self.source.after(self._kept[self.index], self.index, self._pose(self.index)))

    def drag(self, hand: BodyShift) -> None:
        """Where the body is dragged to; in the next frames it follows, at the speed of a body.

        Args:
            hand: The place of the hand.
        """
        self.hand = hand

    def reshape(self, body: ShapedBody) -> None:
        """Change the body's shape at this frame: under a settled garment at once, others start anew here.

        Raises:
            BadInput: A take, whose body is the one that it was simulated on.
        """
        source = self._played("the body's shape")
        if source.take is not None:
            raise BadInput("the body of a take keeps its shape", "another one", "choose a clip instead of a take")
        self.source = source.reshaped(body)
        before = self._kept.get(self.index - 1)
        if source.settled and before is not None:
            _, moved = source.player.reshaped(before.state, body)
            self._kept = {self.index: self.source.after(StoredFrame(moved, before.frame), self.index, self._pose(self.index))}
            self.goal = self.index
        else:
            self._begin(self.index)

    def blow(self, wind: tuple[float, float, float]) -> None:
        """Change the wind from the next frame on [m/s]."""
        self.source = self._played("wind").blown(wind)
        self._forget()

    def _played(self, what: str) -> PlayedClip:
        if not isinstance(self.source, PlayedClip):
            raise BadInput(f"{what} changes where a model plays", "a simulated take", "choose a model")
        return self.source

    def _pose(self, index: int) -> Pose:
        return self.shift.of(self.source.motion[index])

    def _follow_hand(self) -> None:
        pelvis = self.source.motion.translations[self.index].astype(np.float64)
        self.shift = self.shift.towards(self.hand, pelvis)
        self._forget()

    def _begin(self, index: int) -> None:
        self._kept = {index: self.source.first(index, self._pose(index))}
        self.index = self.goal = index

    def _keep(self, index: int, kept: StoredFrame) -> None:
        self._kept[index] = kept
        self.index = index
        if len(self._kept) > STORED_FRAMES:
            del self._kept[self.known.start]

    def _forget(self) -> None:
        self._kept = {self.index: self._kept[self.index]}
