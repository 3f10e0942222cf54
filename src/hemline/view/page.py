"""The page: a viser server that this machine alone reaches, and the loop that plays."""

import contextlib
import errno
import io
import socket
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Self

import numpy as np

from hemline.errors import BadInput, HemlineError, MissingExtra

from .bands import STRETCH
from .downloads import clip_of, file_of
from .measures import Judged, judged, worst_frames
from .pace import Pace
from .panel import NONE_YET, Panel
from .scene import PAINTS, Look, Scene
from .shelf import Choice, Shelf
from .shift import Shift
from .source import Played
from .stage import Stage
from .wishes import Wishes

HOST = "127.0.0.1"
SAID_EVERY = 0.25
"""Time from one line of figures to the next [s]."""
SWINGS = 2.0
"""So long a garment swings out after the body was dragged in a pause [s]."""
QUIET = 0.5
"""So long after a hand was on the slider of frames the program leaves it alone [s]."""
IDLE, SOON, LATE = 0.1, 0.004, 0.1
"""How long it waits for wishes where nothing moves, and for a browser; how much lost time is made up for [s]."""
LOOKS = tuple(Look.__dataclass_fields__)


class Page:
    """Garments on a page at `url`, played until `close`.

    Args:
        shelf: What can be chosen.
        choice: What is shown at the start; None: the first of the shelf.
        port: Where to listen; 0: a port that is free.
        playing: Whether it plays at once.
        report: Told in a line what went wrong.

    Raises:
        MissingExtra: viser is not installed.
        BadInput: The port is none, in use, or not allowed; or the choice cannot be shown.
    """

    def __init__(
        self,
        shelf: Shelf,
        choice: Choice | None = None,
        *,
        port: int = 0,
        playing: bool = True,
        report: Callable[[str], None] = lambda line: None,
    ):
        viser = _viser()
        port = free_port(port)
        self.shelf, self.choice, self.report = shelf, choice or shelf.first(), report
        self.stage, self.look = Stage(shelf.source(self.choice)), Look()
        self.playing, self.speed, self.trouble = playing, 1.0, ""
        self.wishes, self._ended, self._turn = Wishes(), threading.Event(), threading.Lock()
        self._held: tuple[np.ndarray, Shift] | None = None
        self._judged: list[Judged] | None = None
        self._swings_until = self._slid = self._said = 0.0
        with contextlib.redirect_stdout(io.StringIO()):
            self._server = viser.ViserServer(HOST, port, label="hemline", verbose=False)
        self.pace, self._stale = Pace(self._server), True
        if self._server.get_port() != port:
            self.close()
            raise _taken(port, "another program took it")
        self.url = f"http://{HOST}:{port}/"
        self._server.gui.configure_theme(show_logo=False, show_share_button=False, control_width="large")
        self.scene = Scene(self._server)
        self.panel = Panel(self._server, shelf, self.choice, self.wishes.put)
        self.scene.handle.on_update(self._dragged)
        self._renew()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def serve_forever(self) -> None:
        """Play and draw, until `close` is called from another thread or this one is interrupted."""
        due = time.perf_counter()
        while not self._ended.is_set():
            wait = max(due - time.perf_counter(), 0.0) if self._busy else IDLE
            wishes = self.wishes.taken(min(wait, SOON) if self._stale else wait)
            with self._turn:
                if self._ended.is_set():
                    return
                for name, value in wishes.items():
                    self._try(lambda name=name, value=value: self._fulfil(name, value))
                if self._busy and (time.perf_counter() >= due or not self.stage.arrived):
                    due = max(due + 1 / (self.stage.fps * self.speed), time.perf_counter() - LATE)
                    self._try(self._on)
                if self._stale and self.pace.clear:
                    self._draw()
                self._say()

    def close(self) -> None:
        """End, from any thread; a browser that still looks keeps the last picture."""
        self._ended.set()
        self.pace.end()
        with self._turn, contextlib.redirect_stdout(io.StringIO()):
            self._server.stop()

    @property
    def _busy(self) -> bool:
        """Whether a frame is to be made, whatever the hands do."""
        return self.playing or not self.stage.arrived or self._judged is not None or self._swinging

    @property
    def _swinging(self) -> bool:
        return time.perf_counter() < self._swings_until

    def _on(self) -> None:
        """One frame further, wherever it goes."""
        stage = self.stage
        if not stage.arrived:
            stage.move()
        elif self._judged is not None:
            self._judge()
        elif self.playing:
            stage.next()
            stage.move()
        elif self._swinging:
            stage.hold()
        self._stale = True

    def _draw(self) -> None:
        self._stale = False
        with self._server.atomic():
            self.scene.draw(self.stage, self.look)
        self._server.flush()
        self.pace.sent()

    def _try(self, do: Callable[[], None]) -> None:
        """What cannot be done is said; what was shown stays."""
        try:
            do()
        except HemlineError as error:
            self.trouble = str(error)
            self.playing, self._judged = False, None
            self.stage.go(self.stage.index)
            self.report(self.trouble)
            self._say(now=True)

    def _dragged(self, event: Any) -> None:
        if event.client is not None:
            moves = event.phase == "update"
            self.wishes.put(*(("hand", _place(event.target)) if moves else ("grip", event.phase == "start")))

    def _fulfil(self, name: str, value: Any) -> None:
        if name in LOOKS:
            self.look = replace(self.look, **{name: value})
            self._legend()
        else:
            self.trouble = ""
            getattr(self, f"_wish_{name}")(value)
        self._stale = True
        self._say(now=True)

    def _wish_toggle(self, _: None) -> None:
        self.playing = not self.playing

    def _wish_frame(self, index: int) -> None:
        self._slid = time.perf_counter()
        self.stage.go(int(index))

    def _wish_speed(self, speed: str) -> None:
        self.speed = float(speed)

    def _wish_model(self, model: str) -> None:
        self._choose(replace(self.choice, model=model, material=None))

    def _wish_clip(self, clip: str) -> None:
        self._choose(replace(self.choice, clip=clip))

    def _wish_betas(self, betas: tuple[float, ...]) -> None:
        self.stage.reshape(self.stage.source.body.body.shaped(betas))
        self.choice = replace(self.choice, betas=betas)

    def _wish_material(self, material: str) -> None:
        self._choose(replace(self.choice, material=material))

    def _wish_wind(self, wind: tuple[float, float, float]) -> None:
        self.stage.blow(wind)
        self._swings_until = time.perf_counter() + SWINGS

    def _wish_grip(self, held: bool) -> None:
        self.scene.held = held
        here = self.stage.frame.body.joints[0].astype(np.float64)
        self._held = (here, self.stage.shift) if held else None

    def _wish_hand(self, place: tuple[np.ndarray, np.ndarray]) -> None:
        if self._held is not None:
            here, before = self._held
            self.stage.drag(before.dragged(here, *place))
            self._swings_until = time.perf_counter() + SWINGS

    def _wish_back(self, _: None) -> None:
        self.stage.drag(Shift())
        self._swings_until = time.perf_counter() + SWINGS

    def _wish_look(self, _: None) -> None:
        self._judged, self.playing = [], False
        self.stage.go(0)

    def _wish_worst(self, words: str) -> None:
        if words != NONE_YET:
            self.playing = False
            self.stage.go(int(words.split(":")[0].removeprefix("frame ")))

    def _wish_save(self, asked: tuple[str, Any]) -> None:
        """Frames are gathered here and written aside, so that playing goes on."""
        ending, client = asked
        clip = clip_of(self.stage)
        name = f"{self.stage.source.garment.name}-{self.stage.source.motion.name or 'clip'}.{ending}"
        threading.Thread(target=lambda: client.send_file_download(name, file_of(clip, ending)), daemon=True).start()

    def _choose(self, choice: Choice) -> None:
        if choice == self.choice:
            return
        try:
            source = self.shelf.source(choice)
            stage = Stage(source)
        except HemlineError:
            self.panel.model.value, self.panel.clip.value = self.choice.model, self.choice.clip
            raise
        self.choice, self.stage = choice, stage
        self._renew()

    def _renew(self) -> None:
        """What depends on model and clip."""
        source = self.stage.source
        fixed = not isinstance(source, Played) or source.take is not None
        self.scene.look_from(self.stage)
        self.panel.of_body(None if fixed else source.body)
        self.panel.windy(self.shelf.windy(self.choice))
        self.panel.of_materials(self.shelf.materials(self.choice), self.choice.material)
        self.panel.frame.max, self.panel.frame.value = self.stage.count - 1, 0
        self.panel.worst.options = (NONE_YET,)
        self._legend()
        self._stale = True
        self._say(now=True)

    def _judge(self) -> None:
        """Measure this frame, and ask for the next one; at the end list the worst."""
        assert self._judged is not None
        stage = self.stage
        self._judged.append(judged(stage.index, stage.frame, stage.source.garment))
        if stage.index + 1 < stage.count:
            stage.next()
            return
        found = worst_frames(self._judged)
        self._judged = None
        self.panel.worst.options = tuple(words for _, words in found)
        stage.go(found[0][0])

    def _legend(self) -> None:
        scale = PAINTS[self.look.paint]
        rows = "" if scale is None else "".join(_chip(*row) for row in scale.legend)
        if scale not in (None, STRETCH) and self.stage.truth is None:
            rows = "There is no simulation of this clip here: choose a take."
        self.panel.legend.content = f'<div style="padding:0 1em;font-size:0.85em">{rows}</div>'

    def _say(self, *, now: bool = False) -> None:
        """Figures, a few times a second."""
        moment = time.perf_counter()
        if moment - self._said < SAID_EVERY and not now:
            return
        self._said, stage, panel = moment, self.stage, self.panel
        panel.play.label = "Pause" if self.playing else "Play"
        if moment - self._slid > QUIET:
            panel.frame.value = stage.index
        pictures, late = self.pace.figures()
        spans = stage.frame.milliseconds
        total = f"{sum(spans.values()):.1f} ms" if spans else "simulated"
        panel.said.content = self.trouble or (
            f"**{self.choice.model}**, {len(stage.frame.vertices):,} vertices  \n"
            f"frame {stage.index} of {stage.count - 1}, made in {total}  \n"
            + (f"the browser shows {pictures} a second, {late:.0f} ms after they are sent" if pictures else "paused")
        )
        rows = "".join(f"| {name} | {ms:.2f} |\n" for name, ms in spans.items())
        panel.times.content, panel.times.visible = f"| stage | ms |\n|---|---|\n{rows}", bool(spans)


def free_port(port: int) -> int:
    """A port on which one can listen: this one, or for 0 any.

    Raises:
        BadInput: It is none, in use, or not allowed.
    """
    if not 0 <= port <= 65535:
        raise BadInput("a port lies from 0 to 65535", port, "0 takes one that is free")
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((HOST, port))
        except OSError as reason:
            raise _taken(port, "it is in use" if reason.errno == errno.EADDRINUSE else reason.strerror) from None
        return probe.getsockname()[1]


def _taken(port: int, why: object) -> BadInput:
    return BadInput(f"cannot listen on port {port}", why, "choose another one; 0 takes one that is free")


def _viser() -> Any:
    try:
        import viser
    except ImportError:
        raise MissingExtra("viser", "view", "a page in the browser") from None
    return viser


def _place(handle: Any) -> tuple[np.ndarray, np.ndarray]:
    """Where a handle is (3,) [m], and how it is turned (4,), wxyz."""
    return np.array(handle.position, np.float64), np.array(handle.wxyz, np.float64)


def _chip(colour: tuple[int, int, int], words: str) -> str:
    square = f"display:inline-block;width:1em;height:1em;margin-right:0.5em;background:rgb{colour}"
    return f'<div><span style="{square}"></span>{words}</div>'


__all__ = ["Page"]
