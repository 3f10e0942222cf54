"""The catalog from which a user of the page chooses: models, clips, and takes of datasets."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from hemline import motions
from hemline.animators import Animator, MaterialAware, Windy
from hemline.animators.own_body import own_body
from hemline.datasets import Dataset, Row
from hemline.errors import BadInput

from .source import FrameSource, PlayedClip, SimulatedClip

CLIP_FPS = 30.0
"""Frames per second at which clips are played."""
NO_MODEL = "the simulation alone"
"""Entry in the list of models with which the take itself is shown."""


@dataclass(frozen=True)
class Choice:
    """A choice of model, clip, shape and material."""

    model: str
    clip: str
    betas: tuple[float, ...] = ()
    material: str | None = None
    """Material of the garment; None: that of the model."""


@dataclass(eq=False)
class Catalog:
    """Models and clips, by the names under which the page lists them.

    Attributes:
        models: Loaders of the models; each is called when its model is first chosen.
        clips: Loaders of the clips, likewise.
        datasets: Datasets whose takes are offered as clips.

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
        """Names of the models, in the order of the list."""
        return (*self.models, *((NO_MODEL,) if self._takes else ()))

    @property
    def clip_names(self) -> tuple[str, ...]:
        """Names of the clips, takes first."""
        return (*self._takes, *(self.clips if self.models else ()))

    def first(self) -> Choice:
        """Returns the choice at the start: a take alone, or the first model in the first clip."""
        return Choice(NO_MODEL if self._takes else self.model_names[0], self.clip_names[0])

    def source(self, choice: Choice) -> FrameSource:
        """Returns the source of frames for a choice.

        Raises:
            BadInput: There is no such model or clip, the take is of another garment, or the body is of another kind.
        """
        for kind, name, names in (("model", choice.model, self.model_names), ("clip", choice.clip, self.clip_names)):
            if name not in names:
                raise BadInput(f"there is no {kind} of that name", f"'{name}'", f"choose one of {', '.join(names)}")
        if choice.clip in self._takes:
            return self._take_source(choice)
        if choice.model == NO_MODEL:
            raise BadInput("a clip alone moves no garment", f"'{choice.clip}'", "choose a model, or a take")
        animator = self._animator(choice.model)
        if choice.material is not None and isinstance(animator, MaterialAware):
            animator = animator.in_material(choice.material)
        body = own_body(animator).shaped(choice.betas)
        return PlayedClip.on(
            animator, body, self._load_once(f"clip {choice.clip}", self.clips[choice.clip]), fps=CLIP_FPS
        )

    def takes_wind(self, choice: Choice) -> bool:
        """Whether the chosen model takes wind."""
        return choice.model != NO_MODEL and isinstance(self._animator(choice.model), Windy)

    def materials(self, choice: Choice) -> tuple[str, ...]:
        """Returns the materials of the chosen model, its own first; empty for a take and for models of one material."""
        if choice.model == NO_MODEL or choice.clip in self._takes:
            return ()
        animator = self._animator(choice.model)
        known = tuple(animator.known_materials) if isinstance(animator, MaterialAware) else ()
        return known if len(known) > 1 else ()

    def _take_source(self, choice: Choice) -> FrameSource:
        dataset, row = self._takes[choice.clip]
        take, garment = dataset.take(row), dataset.garment
        body = dataset.body.shaped(take.betas)
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
        return self._load_once(f"model {name}", self.models[name])

    def _load_once(self, key: str, make: Callable[[], Any]) -> Any:
        if key not in self._loaded:
            self._loaded[key] = make()
        return self._loaded[key]
