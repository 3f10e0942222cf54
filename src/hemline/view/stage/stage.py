"""The playback behind the page: a source of frames and the present one, without browser or clock."""

import numpy as np

from hemline.arrays import Vertices
from hemline.bodies import ShapedBody
from hemline.errors import BadInput
from hemline.motions import Pose
from hemline.playback import Frame

from .body_shift import BodyShift
from .source import FrameSource, PlayedClip, StoredFrame

STORED_FRAMES = 300
"""Number of past frames that are stored for scrubbing, about one megabyte each for the cape."""


class Stage:
    """A garment on a body in a clip, at one frame of it.

    Frames are made one after another and stored, so that scrubbing back costs nothing and what is shown does not depend
    on the path to it. A change of the past (the body's shape, wind, a drag of the body) keeps only the present frame:
    later frames continue from it, and earlier ones start anew when they are asked for.

    Args:
        source: The source of frames; the first frame of the clip is made at once.

    Example:
        >>> import hemline
        >>> from hemline.view import PlayedClip, Stage
        >>> shirt, body = hemline.load("tshirt-light"), hemline.bodies.load("anny24").shaped()
        >>> stage = Stage(PlayedClip.on(shirt, body, hemline.motions.load("walk"), fps=30.0))
        >>> stage.go(2)
        >>> stage.arrive()
        >>> stage.index, stage.frame.vertices.shape
        (2, (3150, 3))
    """

    def __init__(self, source: FrameSource):
        self.source = source
        self.shift = self.drag_goal = BodyShift()
        self.index = self.goal = 0
        self._stored: dict[int, StoredFrame] = {}
        self._begin(0)

    @property
    def count(self) -> int:
        """Number of frames of the clip."""
        return len(self.source.motion)

    @property
    def fps(self) -> float:
        """Frames per second."""
        return self.source.motion.fps

    @property
    def frame(self) -> Frame:
        """The frame that is shown."""
        return self._stored[self.index].frame

    @property
    def truth(self) -> Vertices | None:
        """The simulated garment in this frame (verts, 3) [m]; None without one, or once the body was dragged."""
        return self.source.truth(self.index) if self.shift.is_identity else None

    @property
    def at_goal(self) -> bool:
        """Whether the requested frame is shown and the body has reached the pointer."""
        return self.index == self.goal and not self.following_drag

    @property
    def following_drag(self) -> bool:
        """Whether the body is still on its way to the pointer."""
        return self.shift is not self.drag_goal

    @property
    def stored_frames(self) -> range:
        """Numbers of the frames that are stored, without a gap."""
        first = min(self._stored)
        return range(first, first + len(self._stored))

    def stored_frame(self, index: int) -> Frame:
        """Returns a stored frame by its number."""
        return self._stored[index].frame

    def go(self, index: int) -> None:
        """Requests a frame; `move` approaches it.

        Raises:
            BadInput: The clip has no such frame.
        """
        if not 0 <= index < self.count:
            raise BadInput(f"the clip has frames 0 to {self.count - 1}", index, "ask for one of them")
        self.goal = index

    def next(self) -> None:
        """Requests the next frame; after the last one the clip starts anew."""
        self.go((self.index + 1) % self.count)

    def move(self) -> None:
        """Approaches the requested frame by one frame, or shows it at once where it is stored."""
        if self.following_drag:
            if self.goal == self.index:
                return self.hold()
            self._follow_drag()
        if self.goal in self._stored:
            self.index = self.goal
        elif self.goal < self.stored_frames.start:
            self._begin(self.goal)
        else:
            last = self.stored_frames[-1]
            self._store(last + 1, self.source.after(self._stored[last], last + 1, self._pose(last + 1)))
        return None

    def arrive(self) -> None:
        """Moves until the requested frame is shown."""
        while not self.at_goal:
            self.move()

    def hold(self) -> None:
        """Plays 1 / fps in the pose of this frame: the garment swings out, and a dragged body moves on."""
        if self.following_drag:
            self._follow_drag()
        self._drop_other_frames()
        self.goal = self.index
        self._store(self.index, self.source.after(self._stored[self.index], self.index, self._pose(self.index)))

    def drag(self, goal: BodyShift) -> None:
        """Drags the body; it follows in the next frames, at the speed of a body.

        Args:
            goal: The shift that the pointer asks for.
        """
        self.drag_goal = goal

    def reshape(self, body: ShapedBody) -> None:
        """Changes the body's shape at this frame; a garment of settled states follows at once, others start anew here.

        Raises:
            BadInput: A take is shown; it keeps the body of its simulation.
        """
        source = self._require_player("the body's shape")
        if source.take is not None:
            raise BadInput("the body of a take keeps its shape", "another one", "choose a clip instead of a take")
        before = self._stored.get(self.index - 1)
        self.source, state = source.reshape((before or self._stored[self.index]).state, body)
        if state is None or before is None:
            self._begin(self.index)
            return
        moved = StoredFrame(state, before.frame)
        self._stored = {self.index: self.source.after(moved, self.index, self._pose(self.index))}
        self.goal = self.index

    def blow(self, wind: tuple[float, float, float]) -> None:
        """Changes the wind from the next frame on [m/s]."""
        self.source = self._require_player("wind").with_wind(wind)
        self._drop_other_frames()

    def _require_player(self, what: str) -> PlayedClip:
        if not isinstance(self.source, PlayedClip):
            raise BadInput(f"{what} changes where a model plays", "a simulated take", "choose a model")
        return self.source

    def _pose(self, index: int) -> Pose:
        return self.shift.apply_to(self.source.motion[index])

    def _follow_drag(self) -> None:
        pelvis = self.source.motion.translations[self.index].astype(np.float64)
        self.shift = self.shift.step_towards(self.drag_goal, pelvis)
        self._drop_other_frames()

    def _begin(self, index: int) -> None:
        self._stored = {index: self.source.first(index, self._pose(index))}
        self.index = self.goal = index

    def _store(self, index: int, frame: StoredFrame) -> None:
        self._stored[index] = frame
        self.index = index
        if len(self._stored) > STORED_FRAMES:
            del self._stored[self.stored_frames.start]

    def _drop_other_frames(self) -> None:
        self._stored = {self.index: self._stored[self.index]}
