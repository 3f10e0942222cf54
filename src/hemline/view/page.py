"""The page: a viser server that this machine alone reaches, and the loop that plays."""

import contextlib
import io
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, Self

import numpy as np

from . import validate, html_text
from .bands import STRETCH
from .downloads import ENDINGS, clip_of, file_of
from .measures import STAGES, FrameMeasures, measure_frame, worst_frames
from .frame_throttle import FrameThrottle
from .panel import BETA, BREEZE, NONE_YET, OWN, SPEEDS, Panel
from .scene import BODIES, PAINTS, Look, Scene
from .server import start_server
from .catalog import Choice, Catalog
from .body_shift import BodyShift
from .source import PlayedClip
from .stage import Stage
from .requests import Requests

SAID_EVERY = 0.25
"""Time from one line of figures to the next [s]."""
SWINGS = 2.0
"""So long a garment swings out after the body was dragged in a pause [s]."""
QUIET = 0.5
"""So long after a hand was on the slider of frames the program leaves it alone [s]."""
IDLE, SOON, LATE = 0.1, 0.004, 0.1
"""How long it waits for wishes where nothing moves, and for a browser; how much lost time is made up for [s]."""
LOOKS: dict[str, tuple[str, ...] | None] = dict.fromkeys(Look.__dataclass_fields__)
LOOKS |= {"shown": STAGES, "paint": tuple(PAINTS), "body": BODIES}
"""The names that each part of a look can have; None: it is on or off."""


class Page:
    """Garments on a page, played until `close`.

    Whoever has the address `url` plays with them; a browser that has not is turned away, and so are pages of other
    origins. What a browser asks for is checked, and what goes wrong is said on the page and to `report`; it goes on.

    Args:
        shelf: What can be chosen.
        choice: What is shown at the start; None: the first of the shelf.
        port: Where to listen; 0: a port that is free.
        playing: Whether it plays at once.
        report: Told in a line what went wrong.

    Raises:
        MissingExtra: viser is not installed.
        BadInput: The port is none, in use, or not allowed; or the choice cannot be shown.
        HemlineError: This version of viser is not known, and could not be guarded.

    Attributes:
        url: The address, with the key that lets a browser in.
        door: Whom it lets in; it gives an address that works once, too.
    """

    def __init__(
        self,
        shelf: Catalog,
        choice: Choice | None = None,
        *,
        port: int = 0,
        playing: bool = True,
        report: Callable[[str], None] = lambda line: None,
    ):
        self.shelf, self.choice, self.report = shelf, choice or shelf.first(), report
        self.playing, self.speed, self.trouble = playing, 1.0, ""
        self.wishes, self._ended, self._turn = Requests(), threading.Event(), threading.Lock()
        self._held: tuple[np.ndarray, BodyShift] | None = None
        self._judged: list[FrameMeasures] | None = None
        self._worst: dict[str, int] = {}
        self._wind = 0.0, 0.0
        self._swings_until = self._slid = self._said = 0.0
        self._server, self.door = start_server(port, report)
        self.url = self.door.url
        self.pace, self._stale = FrameThrottle(self._server), True
        try:
            self.stage, self.look = Stage(shelf.source(self.choice)), Look()
            self._server.gui.configure_theme(show_logo=False, show_share_button=False, control_width="large")
            self.scene = Scene(self._server, self._dragged)
            self.panel = Panel(self._server, shelf, self.choice, self.wishes.put)
            self._renew()
        except BaseException:
            self.close()
            raise

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
                    self._try(partial(self._fulfil, name, value), wish=name)
                if self._busy and (time.perf_counter() >= due or not self.stage.arrived):
                    due = max(due + 1 / (self.stage.fps * self.speed), time.perf_counter() - LATE)
                    self._try(self._on)
                if self._stale and self.pace.clear:
                    self._try(self._draw)
                self._try(self._say)

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

    def _try(self, do: Callable[[], None], *, wish: str = "") -> None:
        """What fails is said in a line, and what was shown stays, whoever sent or wrote what it failed on.

        Args:
            do: What is to be done.
            wish: The name of the wish that it is, after which all plays on as before; empty: none, and playing stops.
        """
        try:
            do()
        except Exception as error:
            self.trouble = html_text.one_line(error)
            self.report(self.trouble)
            if not wish:
                self.playing, self._judged = False, None
                self.stage.go(self.stage.index)
            with contextlib.suppress(Exception):  # it is said in the terminal, even where the page fails
                self._put_back(wish)
                self._say(now=True)

    def _dragged(self, event: Any) -> None:
        if event.client is not None:
            handle = np.array(event.target.position), np.array(event.target.wxyz)
            self.wishes.put(*(("hand", handle) if event.phase == "update" else ("grip", event.phase == "start")))

    def _fulfil(self, name: str, value: Any) -> None:
        if name in LOOKS:
            known = LOOKS[name]
            checked = validate.check_switch(name, value) if known is None else validate.check_choice(f"choice for '{name}'", value, known)
            self.look = replace(self.look, **{name: checked})
            self._legend()
        else:
            self.trouble = ""
            getattr(self, f"_wish_{name}")(value)
        self._stale = True
        self._say(now=True)

    def _put_back(self, wish: str) -> None:
        """Where a wish was refused, its control shows what holds."""
        materials = self.shelf.materials(self.choice)
        holds = {
            **vars(self.look),
            "frame": self.stage.index,
            "speed": f"{self.speed:g}",
            "model": self.choice.model,
            "clip": self.choice.clip,
            "material": self.choice.material or next(iter(materials), OWN),
            "betas": self.stage.source.body.betas.tolist(),
            "wind": self._wind,
            "worst": next(iter(self._worst), NONE_YET),
        }
        self.panel.put_back(wish, holds.get(wish))

    def _wish_toggle(self, _: None) -> None:
        self.playing = not self.playing

    def _wish_frame(self, index: Any) -> None:
        last = self.stage.count - 1
        index = int(validate.check_number("the number of a frame", index, (0, last)))
        self._slid = time.perf_counter()
        self.stage.go(index)

    def _wish_speed(self, speed: Any) -> None:
        self.speed = float(validate.check_choice("speed", speed, SPEEDS))

    def _wish_model(self, model: Any) -> None:
        model = validate.check_choice("garment", model, self.shelf.model_names)
        self._choose(replace(self.choice, model=model, material=None))

    def _wish_clip(self, clip: Any) -> None:
        self._choose(replace(self.choice, clip=validate.check_choice("motion", clip, self.shelf.clip_names)))

    def _wish_betas(self, betas: Any) -> None:
        body = self.stage.source.body
        betas = validate.check_numbers("the shape of a body", betas, len(body.betas), (-BETA, BETA))
        self.stage.reshape(body.body.shaped(betas))
        self.choice = replace(self.choice, betas=betas)

    def _wish_material(self, material: Any) -> None:
        material = validate.check_choice("material", material, self.shelf.materials(self.choice))
        self._choose(replace(self.choice, material=material))

    def _wish_wind(self, wind: Any) -> None:
        left, forward = validate.check_numbers("wind", wind, 2, (-BREEZE, BREEZE))
        self.stage.blow((left, 0.0, forward))
        self._wind = left, forward
        self._swings_until = time.perf_counter() + SWINGS

    def _wish_grip(self, held: Any) -> None:
        self.scene.held = validate.check_switch("the grip", held)
        here = self.stage.frame.body.joints[0].astype(np.float64)
        self._held = (here, self.stage.shift) if held else None

    def _wish_hand(self, place: Any) -> None:
        at, turn = validate.check_place(place)
        if self._held is not None:
            here, before = self._held
            self.stage.drag(before.dragged(here, at, turn))
            self._swings_until = time.perf_counter() + SWINGS

    def _wish_back(self, _: None) -> None:
        self.stage.drag(BodyShift())
        self._swings_until = time.perf_counter() + SWINGS

    def _wish_look(self, _: None) -> None:
        self._judged, self.playing = [], False
        self.stage.go(0)

    def _wish_worst(self, row: Any) -> None:
        row = validate.check_choice("frame", row, (NONE_YET, *self._worst))
        if row != NONE_YET:
            self.playing = False
            self.stage.go(self._worst[row])

    def _wish_save(self, wanted: tuple[str, Any]) -> None:
        """Frames are gathered here and written aside, so that playing goes on."""
        ending, client = validate.check_choice("kind of file", wanted[0], ENDINGS), wanted[1]
        clip = clip_of(self.stage)
        name = f"{self.stage.source.garment.name}-{self.stage.source.motion.name or 'clip'}.{ending}"

        def write() -> None:
            try:
                client.send_file_download(name, file_of(clip, ending))
            except Exception as error:
                self.trouble = html_text.one_line(error)
                self.report(self.trouble)

        threading.Thread(target=write, daemon=True).start()

    def _choose(self, choice: Choice) -> None:
        if choice != self.choice:
            stage = Stage(self.shelf.source(choice))
            self.choice, self.stage = choice, stage
            self._renew()

    def _renew(self) -> None:
        """What depends on model and clip."""
        source = self.stage.source
        fixed = not isinstance(source, PlayedClip) or source.take is not None
        self.scene.look_from(self.stage)
        self.panel.of_body(None if fixed else source.body)
        self.panel.windy(self.shelf.windy(self.choice))
        self.panel.of_materials(self.shelf.materials(self.choice), self.choice.material)
        self.panel.frame.max, self.panel.frame.value = self.stage.count - 1, 0
        self._worst, self.panel.worst.options = {}, (NONE_YET,)
        self._legend()
        self._stale = True
        self._say(now=True)

    def _judge(self) -> None:
        """Measure this frame, and ask for the next one; at the end list the worst."""
        assert self._judged is not None
        stage = self.stage
        self._judged.append(measure_frame(stage.index, stage.frame, stage.source.garment))
        if stage.index + 1 < stage.count:
            stage.next()
            return
        found = worst_frames(self._judged)
        self._judged = None
        self._worst = {row: index for index, row in found}
        self.panel.worst.options = tuple(self._worst)
        stage.go(found[0][0])

    def _legend(self) -> None:
        scale, note = PAINTS[self.look.paint], ""
        if scale not in (None, STRETCH) and self.stage.truth is None:
            note = "There is no simulation of this clip here: choose a take."
        self.panel.legend.content = html_text.legend(() if scale is None else scale.legend, note)

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
        rows = (
            f"{self.choice.model}, {len(stage.frame.vertices):,} vertices",
            f"frame {stage.index} of {stage.count - 1}, made in {total}",
            f"the browser shows {pictures} a second, {late:.0f} ms after they are sent" if pictures else "paused",
        )
        panel.said.content = html_text.lines(rows, first_bold=True, trouble=self.trouble)
        times = ((name, f"{ms:.2f}") for name, ms in spans.items())
        panel.times.content, panel.times.visible = html_text.table(("stage", "ms"), times), bool(spans)


__all__ = ["Page"]
