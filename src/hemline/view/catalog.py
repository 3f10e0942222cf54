"""What can be chosen: models, clips, and takes of datasets."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from hemline import bodies, motions
from hemline.animators import Animator, MaterialAware
from hemline.datasets import Dataset, Row
from hemline.errors import BadInput

from .source import PlayedClip, SimulatedClip, FrameSource
from .wind import takes_wind

CLIP_FPS = 30.0
"""Frames a second at which clips are played."""
NO_MODEL = "the simulation alone"
"""In the list of models: the take itself is shown."""


@dataclass(frozen=True)
class Choice:
    """What is played."""

    model: str
    clip: str
    betas: tuple[float, ...] = ()
    material: str | None = None
    """What the garment is made of; None: of what the model says."""


@dataclass(eq=False)
class Catalog:
    """Models and clips by the names under which the page lists them.

    Attributes:
        models: Each is loaded when it is first chosen.
        clips: The same of clips.
        datasets: Their takes are clips, too.

    Raises:
        BadInput: There is nothing to play.
    """

    models: Mapping[str, Callable[[], Animator]]
    clips: Mapping[str, Callable[[], motions.Motion]]
    datasets: tuple[Dataset, ...] = ()
    _loaded: dict[str, Any] = field(default_factory=dict, init=False, repr=False)
    _takes: dict[str, tuple[Dataset, Row]] = field(default_factory=dict, init=False, repr=False)

    def __post_init__(self) -> None:
        for dataset in self.datasets:
            for row in dataset.clips():
                shape = ", ".join(f"{beta:g}" for beta in row.betas)
                name = f"take: {dataset.folder.name}/{row.clip}" + (f" part {row.part}" if row.part else "")
                self._takes[name + (f" [{shape}]" if any(row.betas) else "")] = dataset, row
        if not self.clip_names or not (self.models or self._takes):
            raise BadInput("there is nothing to play", "no model and no take", "name a model, such as cape")

    @property
    def model_names(self) -> tuple[str, ...]:
        """In the order in which they are listed."""
        return (*self.models, *((NO_MODEL,) if self._takes else ()))

    @property
    def clip_names(self) -> tuple[str, ...]:
        """Takes first."""
        return (*self._takes, *(self.clips if self.models else ()))

    def first(self) -> Choice:
        """What is shown at the start: a take alone, or the first model in the first clip."""
        return Choice(NO_MODEL if self._takes else self.model_names[0], self.clip_names[0])

    def source(self, choice: Choice) -> FrameSource:
        """Make ready what was chosen.

        Raises:
            BadInput: No such model or clip; a take without its garment; a body of another kind.
        """
        for kind, name, names in (("model", choice.model, self.model_names), ("clip", choice.clip, self.clip_names)):
            if name not in names:
                raise BadInput(f"there is no {kind} of that name", f"'{name}'", f"choose one of {', '.join(names)}")
        if choice.clip in self._takes:
            return self._of_take(choice)
        if choice.model == NO_MODEL:
            raise BadInput("a clip alone moves no garment", f"'{choice.clip}'", "choose a model, or a take")
        animator = self._animator(choice.model)
        if choice.material is not None and isinstance(animator, MaterialAware):
            animator = animator.in_material(choice.material)
        body = bodies.load(animator.body_name).shaped(choice.betas)
        return PlayedClip.on(animator, body, self._once(f"clip {choice.clip}", self.clips[choice.clip]), fps=CLIP_FPS)

    def windy(self, choice: Choice) -> bool:
        """Whether the chosen model takes wind."""
        return choice.model != NO_MODEL and takes_wind(self._animator(choice.model))

    def materials(self, choice: Choice) -> tuple[str, ...]:
        """Materials that the chosen model knows, its own first; none where it plays a take, or knows no others."""
        if choice.model == NO_MODEL or choice.clip in self._takes:
            return ()
        animator = self._animator(choice.model)
        known = tuple(animator.known_materials) if isinstance(animator, MaterialAware) else ()
        return known if len(known) > 1 else ()

    def _of_take(self, choice: Choice) -> FrameSource:
        dataset, row = self._takes[choice.clip]
        take, garment = dataset.take(row), dataset.garment
        body = bodies.load(garment.body_name).shaped(take.betas)
        if choice.model == NO_MODEL:
            return SimulatedClip(take, garment, body)
        animator = self._animator(choice.model)
        if len(animator.garment.vertices) != take.vertices.shape[1]:
            raise BadInput(
                f"model '{choice.model}' wears another garment than this take",
                f"{len(animator.garment.vertices)} vertices for {take.vertices.shape[1]}",
                f"choose a model of '{garment.name}', or '{NO_MODEL}'",
            )
        return PlayedClip.on(animator, body, take.motion, fps=take.motion.fps, take=take)

    def _animator(self, name: str) -> Animator:
        return self._once(f"model {name}", self.models[name])

    def _once(self, key: str, make: Callable[[], Any]) -> Any:
        if key not in self._loaded:
            self._loaded[key] = make()
        return self._loaded[key]
