"""The page: a viser server that only this machine reaches, and the loop that plays."""

import contextlib
import io
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, ClassVar, Self

import numpy as np

from hemline.view.stage.body_shift import BodyShift
from hemline.view.stage.catalog import Catalog, Choice
from hemline.view.stage.measures import STAGES, FrameMeasures, measure_frame, worst_frames
from hemline.view.stage.source import PlayedClip
from hemline.view.stage.stage import Stage

from . import html_text, validate
from .bands import STRETCH
from .downloads import ENDINGS, clip_of, file_of
from .frame_throttle import FrameThrottle
from .panel import BETA, BREEZE, NONE_YET, OWN, SPEEDS, Panel
from .requests import Request, Requests
from .scene import BODIES, PAINTS, Look, Scene
from .server import in_loop, start_server

STATUS_INTERVAL = 0.25
"""Time from one update of the status to the next [s]."""
SWING_TIME = 2.0
"""Time for which the garment swings out after the body was dragged or the wind changed in a pause [s]."""
SLIDER_REST = 0.5
"""Time for which the program leaves the slider of frames alone after a user moved it [s]."""
IDLE_WAIT = 0.1
"""Longest wait for a request where nothing moves [s]."""
BROWSER_WAIT = 0.004
"""Longest wait for a request where a picture waits for a browser [s]."""
LOOP_PATIENCE = 2.0
"""Longest wait for the event loop of the server [s]."""
CATCH_UP = 0.1
"""Longest delay of a frame that is made up for by playing faster [s]."""
LOOK_VALUES: dict[Request, tuple[str, ...] | None] = {Request(name): None for name in Look.__dataclass_fields__}
LOOK_VALUES |= {Request.SHOWN: STAGES, Request.PAINT: tuple(PAINTS), Request.BODY: BODIES}
"""Values that each part of a `Look` can have; None: it is on or off."""


class Page:
    """A page on which garments are played until `close`.

    Whoever has the address `url` can use the page; browsers without it, and pages of other origins, are turned away.
    Every request of a browser is checked. An error is shown on the page and passed to `report`, and playing goes on.

    Args:
        catalog: Models and clips to choose from.
        choice: The choice at the start; None: the first of the catalog.
        port: The port to listen on; 0: any free port.
        playing: Whether the clip plays from the start.
        report: Called with each error, as one line.

    Raises:
        MissingExtra: viser is not installed.
        BadInput: The port does not exist, is in use or is not allowed; or the choice cannot be shown.
        HemlineError: This version of viser is unknown, so that access could not be restricted.

    Attributes:
        url: The address, with the key that grants access.
        door: The access control; it also gives an address that works once.
        requests: Requests of browsers that were not handled yet.
        error: The last error, as one line; empty after a request that worked.
    """

    def __init__(
        self,
        catalog: Catalog,
        choice: Choice | None = None,
        *,
        port: int = 0,
        playing: bool = True,
        report: Callable[[str], None] = lambda line: None,
    ):
        self.catalog, self.choice, self.report = catalog, choice or catalog.first(), report
        self.playing, self.speed, self.error = playing, 1.0, ""
        self.requests, self._ended, self._turn = Requests(), threading.Event(), threading.Lock()
        self._grabbed: tuple[np.ndarray, BodyShift] | None = None
        self._measured: list[FrameMeasures] | None = None
        self._worst: dict[str, int] = {}
        self._wind = 0.0, 0.0
        self._swings_until = self._slider_moved = self._status_at = 0.0
        self._server, self.door = start_server(port, report)
        self.url = self.door.url
        self.throttle, self._stale = FrameThrottle(self._server), True
        try:
            self.stage, self.look = Stage(catalog.source(self.choice)), Look()
            self._server.gui.configure_theme(show_logo=False, show_share_button=False, control_width="large")
            self.scene = Scene(self._server, self._on_drag)
            self.panel = Panel(self._server, catalog, self.choice, self.requests.put)
            self._renew()
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def serve_forever(self) -> None:
        """Plays and draws until `close` is called from another thread or this one is interrupted."""
        due = time.perf_counter()
        while not self._ended.is_set():
            wait = max(due - time.perf_counter(), 0.0) if self._busy else IDLE_WAIT
            requests = self.requests.take(min(wait, BROWSER_WAIT) if self._stale else wait)
            with self._turn:
                if self._ended.is_set():
                    return
                for request, value in requests.items():
                    self._try(partial(self._handle, request, value), request)
                if self._busy and (time.perf_counter() >= due or not self.stage.at_goal):
                    due = max(due + 1 / (self.stage.fps * self.speed), time.perf_counter() - CATCH_UP)
                    self._try(self._advance)
                if self._stale and self.throttle.clear:
                    self._try(self._draw)
                self._try(self._update_status)

    def close(self) -> None:
        """Stops the server, from any thread; an open browser keeps the last picture."""
        self._ended.set()
        self.throttle.end()
        with self._turn, contextlib.redirect_stdout(io.StringIO()):
            self._server.stop()

    @property
    def _busy(self) -> bool:
        """Whether a frame has to be made even without a request."""
        return self.playing or not self.stage.at_goal or self._measured is not None or self._swinging

    @property
    def _swinging(self) -> bool:
        return time.perf_counter() < self._swings_until

    def _advance(self) -> None:
        """Makes one frame, of whatever is going on."""
        stage = self.stage
        if not stage.at_goal:
            stage.move()
        elif self._measured is not None:
            self._measure()
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
        self.throttle.count_picture()

    def _try(self, do: Callable[[], None], request: Request | None = None) -> None:
        """Runs something; an error is reported in one line, and the page keeps what it showed.

        Args:
            do: What to run.
            request: The request that is handled, after whose failure playing goes on; None: playing stops.
        """
        try:
            do()
        except Exception as error:
            self.error = html_text.one_line(error)
            self.report(self.error)
            if request is None:
                self.playing, self._measured = False, None
                self.stage.go(self.stage.index)
            with contextlib.suppress(Exception):  # the terminal has the error, even where the page fails
                if request is not None:
                    self._put_back(request)
                self._update_status(now=True)

    def _on_drag(self, event: Any) -> None:
        if event.client is None:
            return
        if event.phase == "update":
            self.requests.put(Request.DRAG, (np.array(event.target.position), np.array(event.target.wxyz)))
        else:
            self.requests.put(Request.GRAB, event.phase == "start")

    def _handle(self, request: Request, value: Any) -> None:
        if request in LOOK_VALUES:
            known = LOOK_VALUES[request]
            if known is None:
                value = validate.check_switch(request, value)
            else:
                value = validate.check_choice(f"choice for '{request}'", value, known)
            self.look = replace(self.look, **{request: value})
            self._show_legend()
        else:
            self.error = ""
            self.HANDLERS[request](self, value)
        self._stale = True
        self._update_status(now=True)

    def _put_back(self, request: Request) -> None:
        """Shows at a control what holds, after a request that was refused.

        It happens in the event loop, between two messages of browsers, and only where no newer request of the same
        control is waiting: that one would otherwise be taken for undone.
        """
        materials = self.catalog.materials(self.choice)
        values = {
            **{Request(name): value for name, value in vars(self.look).items()},
            Request.FRAME: self.stage.index,
            Request.SPEED: f"{self.speed:g}",
            Request.MODEL: self.choice.model,
            Request.CLIP: self.choice.clip,
            Request.MATERIAL: self.choice.material or next(iter(materials), OWN),
            Request.BETAS: self.stage.source.body.betas.tolist(),
            Request.WIND: self._wind,
            Request.WORST: next(iter(self._worst), NONE_YET),
        }

        def show() -> None:
            if request in values and not self.requests.is_pending(request):
                self.panel.show_value(request, values[request])

        in_loop(self._server, show).result(timeout=LOOP_PATIENCE)

    def _play_or_pause(self, _: None) -> None:
        self.playing = not self.playing

    def _go_to_frame(self, index: Any) -> None:
        last = self.stage.count - 1
        index = int(validate.check_number("the number of a frame", index, (0, last)))
        self._slider_moved = time.perf_counter()
        self.stage.go(index)

    def _set_speed(self, speed: Any) -> None:
        self.speed = float(validate.check_choice("speed", speed, SPEEDS))

    def _choose_model(self, model: Any) -> None:
        model = validate.check_choice("garment", model, self.catalog.model_names)
        self._choose(replace(self.choice, model=model, material=None))

    def _choose_clip(self, clip: Any) -> None:
        self._choose(replace(self.choice, clip=validate.check_choice("motion", clip, self.catalog.clip_names)))

    def _set_betas(self, betas: Any) -> None:
        body = self.stage.source.body
        betas = validate.check_numbers("the shape of a body", betas, len(body.betas), (-BETA, BETA))
        self.stage.reshape(body.body.shaped(betas))
        self.choice = replace(self.choice, betas=betas)

    def _choose_material(self, material: Any) -> None:
        material = validate.check_choice("material", material, self.catalog.materials(self.choice))
        self._choose(replace(self.choice, material=material))

    def _set_wind(self, wind: Any) -> None:
        left, forward = validate.check_numbers("wind", wind, 2, (-BREEZE, BREEZE))
        self.stage.blow((left, 0.0, forward))
        self._wind = left, forward
        self._swings_until = time.perf_counter() + SWING_TIME

    def _grab(self, grabbed: Any) -> None:
        self.scene.grabbed = validate.check_switch("the grip", grabbed)
        here = self.stage.frame.body.joints[0].astype(np.float64)
        self._grabbed = (here, self.stage.shift) if grabbed else None

    def _drag(self, place: Any) -> None:
        position, turn = validate.check_place(place)
        if self._grabbed is not None:
            here, before = self._grabbed
            self.stage.drag(before.drag_handle(here, position, turn))
            self._swings_until = time.perf_counter() + SWING_TIME

    def _reset_drag(self, _: None) -> None:
        self.stage.drag(BodyShift())
        self._swings_until = time.perf_counter() + SWING_TIME

    def _begin_measuring(self, _: None) -> None:
        self._measured, self.playing = [], False
        self.stage.go(0)

    def _go_to_worst(self, row: Any) -> None:
        row = validate.check_choice("frame", row, (NONE_YET, *self._worst))
        if row != NONE_YET:
            self.playing = False
            self.stage.go(self._worst[row])

    def _save(self, wanted: tuple[str, Any]) -> None:
        """Collects the frames here, and writes the file in a thread so that playing goes on."""
        ending, client = validate.check_choice("kind of file", wanted[0], ENDINGS), wanted[1]
        clip = clip_of(self.stage)
        name = f"{self.stage.source.garment.name}-{self.stage.source.motion.name or 'clip'}.{ending}"

        def write() -> None:
            try:
                client.send_file_download(name, file_of(clip, ending))
            except Exception as error:
                self.error = html_text.one_line(error)
                self.report(self.error)

        threading.Thread(target=write, daemon=True).start()

    HANDLERS: ClassVar[dict[Request, Callable[["Page", Any], None]]] = {
        Request.PLAY_OR_PAUSE: _play_or_pause,
        Request.FRAME: _go_to_frame,
        Request.SPEED: _set_speed,
        Request.MODEL: _choose_model,
        Request.CLIP: _choose_clip,
        Request.MATERIAL: _choose_material,
        Request.BETAS: _set_betas,
        Request.WIND: _set_wind,
        Request.GRAB: _grab,
        Request.DRAG: _drag,
        Request.RESET_DRAG: _reset_drag,
        Request.MEASURE: _begin_measuring,
        Request.WORST: _go_to_worst,
        Request.SAVE: _save,
    }
    """What is done about each request that does not only change the `Look`."""

    def _choose(self, choice: Choice) -> None:
        if choice != self.choice:
            stage = Stage(self.catalog.source(choice))
            self.choice, self.stage = choice, stage
            self._renew()

    def _renew(self) -> None:
        """Adapts everything that depends on model and clip."""
        source = self.stage.source
        fixed = not isinstance(source, PlayedClip) or source.take is not None
        self.scene.look_from(self.stage)
        self.panel.show_shape_of(None if fixed else source.body)
        self.panel.show_wind(self.catalog.takes_wind(self.choice))
        self.panel.show_materials(self.catalog.materials(self.choice), self.choice.material)
        self.panel.frame.max, self.panel.frame.value = self.stage.count - 1, 0
        self._worst, self.panel.worst.options = {}, (NONE_YET,)
        self._show_legend()
        self._stale = True
        self._update_status(now=True)

    def _measure(self) -> None:
        """Measures this frame and requests the next one; after the last frame, lists the worst ones."""
        assert self._measured is not None
        stage = self.stage
        self._measured.append(measure_frame(stage.index, stage.frame, stage.source.garment))
        if stage.index + 1 < stage.count:
            stage.next()
            return
        worst = worst_frames(self._measured)
        self._measured = None
        self._worst = {row: index for index, row in worst}
        self.panel.worst.options = tuple(self._worst)
        stage.go(worst[0][0])

    def _show_legend(self) -> None:
        scale, note = PAINTS[self.look.paint], ""
        if scale not in (None, STRETCH) and self.stage.truth is None:
            note = "There is no simulation of this clip here: choose a take."
        self.panel.legend.content = html_text.legend(() if scale is None else scale.legend, note)

    def _show_index(self, index: int) -> None:
        if not self.requests.is_pending(Request.FRAME):
            self.panel.frame.value = index

    def _update_status(self, *, now: bool = False) -> None:
        """Writes the figures, a few times a second."""
        moment = time.perf_counter()
        if moment - self._status_at < STATUS_INTERVAL and not now:
            return
        self._status_at, stage, panel = moment, self.stage, self.panel
        panel.play.label = "Pause" if self.playing else "Play"
        if moment - self._slider_moved > SLIDER_REST:
            in_loop(self._server, partial(self._show_index, stage.index))
        pictures, delay = self.throttle.figures()
        spans = stage.frame.milliseconds
        total = f"{sum(spans.values()):.1f} ms" if spans else "simulated"
        rows = (
            f"{self.choice.model}, {len(stage.frame.vertices):,} vertices",
            f"frame {stage.index} of {stage.count - 1}, made in {total}",
            f"the browser shows {pictures} a second, {delay:.0f} ms after they are sent" if pictures else "paused",
        )
        panel.status.content = html_text.lines(rows, first_bold=True, trouble=self.error)
        times = ((name, f"{ms:.2f}") for name, ms in spans.items())
        panel.times.content, panel.times.visible = html_text.table(("stage", "ms"), times), bool(spans)


__all__ = ["Page"]
