"""The controls of the page, in plain words; each hands its wish on."""

from collections.abc import Callable
from typing import Any

from hemline.bodies import ShapedBody

from . import html_text
from .measures import STAGES
from .scene import BODIES, PAINTS
from .catalog import Choice, Catalog

SPEEDS = ("0.1", "0.25", "0.5", "1", "2")
NONE_YET = "not looked for yet"
OWN = "its own"
BETA, BREEZE = 3.0, 6.0
"""Ends of the sliders of shape [1] and of wind [m/s]."""


class Panel:
    """Buttons, lists and sliders.

    Args:
        server: The viser server.
        shelf: What can be chosen.
        choice: What is chosen at the start.
        wish: Called with the name of a wish and its value, when a hand on the page asks for something.
    """

    def __init__(self, server: Any, shelf: Catalog, choice: Choice, wish: Callable[[str, Any], None]):
        self._gui, self._wish = server.gui, wish
        self._hands: dict[str, Any] = {}
        gui = self._gui
        self.said = gui.add_html("")
        self.play = gui.add_button("Pause")
        self.play.on_click(lambda _: wish("toggle", None))
        self.frame = self._hand("frame", gui.add_slider("Frame", 0, 1, 1, 0))
        self.speed = self._hand("speed", gui.add_dropdown("Speed", SPEEDS, initial_value="1"))
        self.model = self._hand("model", gui.add_dropdown("Garment", shelf.model_names, initial_value=choice.model))
        self.clip = self._hand("clip", gui.add_dropdown("Motion", shelf.clip_names, initial_value=choice.clip))
        self.material = self._hand("material", gui.add_dropdown("Material", (OWN,), visible=False))
        with gui.add_folder("What is shown"):
            self._hand("shown", gui.add_dropdown("Stage", STAGES))
            self._hand("paint", gui.add_dropdown("Colours", tuple(PAINTS)))
            self.legend = gui.add_html("")
            self._hand("mark", gui.add_checkbox("Red: inside the body", False))
            self._hand("body", gui.add_dropdown("Body", BODIES))
            self._hand("bones", gui.add_checkbox("Bones", False, hint="Of garments that hang on ropes"))
            self._hand("colliders", gui.add_checkbox("Colliders", False, hint="What ropes are kept out of"))
            self._hand("follow", gui.add_checkbox("Camera follows", True))
        with gui.add_folder("Drag the body"):
            self._hand(
                "handle", gui.add_checkbox("Handle at the pelvis", False, hint="Pull its arrows, turn its rings")
            )
            gui.add_button("Put it back").on_click(lambda _: wish("back", None))
        self.shape = gui.add_folder("Body shape", expand_by_default=False)
        self.betas: list[Any] = []
        self._breeze(gui)
        with gui.add_folder("Worst frames", expand_by_default=False):
            gui.add_button("Look for them").on_click(lambda _: wish("look", None))
            self.worst = self._hand("worst", gui.add_dropdown("Go to", (NONE_YET,)))
        with gui.add_folder("Download", expand_by_default=False):
            gui.add_html(html_text.lines(["The frames that were played since the last change, at most 300."]))
            for ending, label in (("glb", "GLB, for Blender and engines"), ("webp", "WebP, to look at")):
                gui.add_button(label).on_click(lambda event, ending=ending: wish("save", (ending, event.client)))
        self.times = gui.add_html("", visible=False)

    def of_body(self, body: ShapedBody | None) -> None:
        """Sliders for the shape of a body; none where it keeps its own.

        Args:
            body: Who wears the garment.
        """
        for slider in self.betas:
            slider.remove()
        self.betas = []
        self.shape.visible = body is not None
        if body is None:
            return
        with self.shape:
            for number, value in enumerate(body.betas.tolist()):
                slider = self._gui.add_slider(f"Shape {number + 1}", -BETA, BETA, 0.1, _on_slider(value))
                slider.on_update(self._shaped)
                self.betas.append(slider)

    def of_materials(self, names: tuple[str, ...], chosen: str | None) -> None:
        """The list of materials; none where there is nothing to choose.

        Args:
            names: That of the fit first.
            chosen: The one that is worn; None: the first.
        """
        self.material.visible = bool(names)
        if names:
            self.material.options = names
            self.material.value = chosen or names[0]

    def put_back(self, name: str, value: Any) -> None:
        """Let a list or a slider show what holds, after a hand asked there for what cannot be.

        Args:
            name: That of the wish.
            value: What holds; for the shape of a body its betas, for wind to the left and forward [m/s].
        """
        several = {"betas": self.betas, "wind": self.breeze}
        if name in several:
            for slider, one in zip(several[name], value, strict=False):
                slider.value = _on_slider(one) if name == "betas" else one
        elif name in self._hands:
            self._hands[name].value = value

    def windy(self, windy: bool) -> None:
        """Whether there are sliders for wind."""
        self.wind.visible = windy

    def _breeze(self, gui: Any) -> None:
        self.wind = gui.add_folder("Wind", expand_by_default=False)
        with self.wind:
            self.breeze = [
                gui.add_slider(label, -BREEZE, BREEZE, 0.5, 0.0) for label in ("To its left, m/s", "Forward, m/s")
            ]
        for slider in self.breeze:
            slider.on_update(self._blown)

    def _hand(self, name: str, control: Any) -> Any:
        """A control whose value is a wish where a hand, not the program, set it."""
        self._hands[name] = control
        control.on_update(lambda event: event.client is not None and self._wish(name, event.target.value))
        return control

    def _shaped(self, event: Any) -> None:
        if event.client is not None:
            self._wish("betas", tuple(slider.value for slider in self.betas))

    def _blown(self, event: Any) -> None:
        if event.client is not None:
            self._wish("wind", tuple(slider.value for slider in self.breeze))


def _on_slider(beta: float) -> float:
    """A beta, as a slider can show it."""
    return min(max(round(beta, 1), -BETA), BETA)
