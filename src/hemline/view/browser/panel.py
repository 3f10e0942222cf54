"""The controls of the page; each passes what the user asks for on as a `Request`."""

from collections.abc import Callable
from typing import Any

from hemline.bodies import ShapedBody
from hemline.view.stage.catalog import Catalog, Choice
from hemline.view.stage.measures import STAGES

from . import html_text
from .requests import Request
from .scene import BODIES, PAINTS

SPEEDS = ("0.1", "0.25", "0.5", "1", "2")
NONE_YET = "not looked for yet"
OWN = "its own"
BETA, BREEZE = 3.0, 6.0
"""Ends of the sliders of shape [1] and of wind [m/s]."""


class Panel:
    """Buttons, lists and sliders.

    viser runs plain callbacks in a pool of threads, some time after it has set a control's value. A callback that reads
    the value there may find another one, which the page has set in between. So callbacks are coroutines, which viser
    awaits in its event loop together with the message; `Page` sets values of controls in that loop, too.

    Args:
        server: The viser server.
        catalog: Models and clips to choose from.
        choice: The choice at the start.
        ask: Called in the event loop with a request and its value.
    """

    def __init__(self, server: Any, catalog: Catalog, choice: Choice, ask: Callable[[Request, Any], None]):
        self._gui, self._ask = server.gui, ask
        self._controls: dict[Request, Any] = {}
        gui = self._gui
        self.status = gui.add_html("")
        self.play = self._button(Request.PLAY_OR_PAUSE, "Pause")
        self.frame = self._control(Request.FRAME, gui.add_slider("Frame", 0, 1, 1, 0))
        self._control(Request.SPEED, gui.add_dropdown("Speed", SPEEDS, initial_value="1"))
        self._control(Request.MODEL, gui.add_dropdown("Garment", catalog.model_names, initial_value=choice.model))
        self._control(Request.CLIP, gui.add_dropdown("Motion", catalog.clip_names, initial_value=choice.clip))
        self.material = self._control(Request.MATERIAL, gui.add_dropdown("Material", (OWN,), visible=False))
        with gui.add_folder("What is shown"):
            self._control(Request.SHOWN, gui.add_dropdown("Stage", STAGES))
            self._control(Request.PAINT, gui.add_dropdown("Colours", tuple(PAINTS)))
            self.legend = gui.add_html("")
            self._control(Request.MARK, gui.add_checkbox("Red: inside the body", False))
            self._control(Request.BODY, gui.add_dropdown("Body", BODIES))
            self._control(Request.BONES, gui.add_checkbox("Bones", False, hint="Of garments that hang on ropes"))
            self._control(Request.COLLIDERS, gui.add_checkbox("Colliders", False, hint="What ropes are kept out of"))
            self._control(Request.FOLLOW, gui.add_checkbox("Camera follows", True))
        with gui.add_folder("Drag the body"):
            hint = "Pull its arrows, turn its rings"
            self._control(Request.HANDLE, gui.add_checkbox("Handle at the pelvis", False, hint=hint))
            self._button(Request.RESET_DRAG, "Put it back")
        self.shape = gui.add_folder("Body shape", expand_by_default=False)
        self.betas: list[Any] = []
        self.wind = gui.add_folder("Wind", expand_by_default=False)
        with self.wind:
            labels = ("To its left, m/s", "Forward, m/s")
            self.breeze = [gui.add_slider(label, -BREEZE, BREEZE, 0.5, 0.0) for label in labels]
        self._sliders(Request.WIND, self.breeze)
        with gui.add_folder("Worst frames", expand_by_default=False):
            self._button(Request.MEASURE, "Look for them")
            self.worst = self._control(Request.WORST, gui.add_dropdown("Go to", (NONE_YET,)))
        with gui.add_folder("Download", expand_by_default=False):
            gui.add_html(html_text.lines(["The frames that were played since the last change, at most 300."]))
            for ending, label in (("glb", "GLB, for Blender and engines"), ("webp", "WebP, to look at")):
                self._button(Request.SAVE, label, lambda event, ending=ending: (ending, event.client))
        self.times = gui.add_html("", visible=False)

    def show_shape_of(self, body: ShapedBody | None) -> None:
        """Makes sliders for the shape of a body.

        Args:
            body: The body that wears the garment; None removes the sliders, where the body keeps its shape.
        """
        for slider in self.betas:
            slider.remove()
        self.betas = []
        self.shape.visible = body is not None
        if body is None:
            return
        with self.shape:
            for number, value in enumerate(body.betas.tolist()):
                slider = self._gui.add_slider(f"Shape {number + 1}", -BETA, BETA, 0.1, _slider_value(value))
                self.betas.append(slider)
        self._sliders(Request.BETAS, self.betas)

    def show_materials(self, names: tuple[str, ...], chosen: str | None) -> None:
        """Fills the list of materials; an empty list is hidden.

        Args:
            names: Materials, that of the fit first.
            chosen: The present material; None: the first one.
        """
        self.material.visible = bool(names)
        if names:
            self.material.options = names
            self.material.value = chosen or names[0]

    def show_value(self, request: Request, value: Any) -> None:
        """Shows a value at the control of a request, after one that was refused.

        Args:
            request: The request.
            value: The value that holds: betas for the shape of a body, wind to the left and forward [m/s].
        """
        if request is Request.BETAS:
            for slider, beta in zip(self.betas, value, strict=False):
                slider.value = _slider_value(beta)
        elif request is Request.WIND:
            for slider, speed in zip(self.breeze, value, strict=True):
                slider.value = speed
        elif request in self._controls:
            self._controls[request].value = value

    def show_wind(self, visible: bool) -> None:
        """Shows or hides the sliders of the wind."""
        self.wind.visible = visible

    def _button(self, request: Request, label: str, value: Callable[[Any], Any] = lambda event: None) -> Any:
        button = self._gui.add_button(label)

        async def ask(event: Any) -> None:
            self._ask(request, value(event))

        button.on_click(ask)
        return button

    def _control(self, request: Request, control: Any) -> Any:
        """Makes each change by a user, not by the program, a request with the value of the control."""

        async def ask(event: Any) -> None:
            if event.client is not None:
                self._ask(request, event.target.value)

        control.on_update(ask)
        self._controls[request] = control
        return control

    def _sliders(self, request: Request, sliders: list[Any]) -> None:
        """Makes each change of a slider by a user a request with the values of them all."""

        async def ask(event: Any) -> None:
            if event.client is not None:
                self._ask(request, tuple(slider.value for slider in sliders))

        for slider in sliders:
            slider.on_update(ask)


def _slider_value(beta: float) -> float:
    """Rounds and clamps a beta to what a slider can show."""
    return min(max(round(beta, 1), -BETA), BETA)
