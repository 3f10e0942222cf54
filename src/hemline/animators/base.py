"""The contract of an animator: what `play`, `evaluate` and a game loop may rely on."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, Self, runtime_checkable

import numpy as np

from hemline.arrays import Int, Vertices

if TYPE_CHECKING:
    from hemline.bodies.body import PosedBody, ShapedBody
    from hemline.garments.garment import Garment
    from hemline.garments.material import Material

    from .teleport import RigidTransform

Progress = Callable[[str, int, int], None]
"""Called with the stage of a fit, the steps done and the steps in all."""


@runtime_checkable
class Animator(Protocol):
    """Fitted parameters that turn a moving body into a moving garment.

    Parameters are frozen; all that moves is in the State: plain arrays in a dataclass, never changed in place, so that
    keeping an old State is a rollback. The same input gives the same bits on one machine. What only some animators can
    do is asked for with `isinstance`: `Driven`, `Settled`, `Bounded`, `MaterialAware`,
    `Detailed`, `Movable`.
    """

    @property
    def name(self) -> str:
        """Name of its kind: in the registry, in model files, on the command line."""
        ...

    @property
    def garment(self) -> "Garment":
        """The garment, mesh and all."""
        ...

    @property
    def body_name(self) -> str:
        """Name of the body that the garment was fitted on."""
        ...

    @property
    def body_hash(self) -> str:
        """Hash of that body; another one is refused."""
        ...

    @property
    def figures(self) -> Mapping[str, float]:
        """What the fit reached, unit in the name."""
        ...

    def start(self, posed: "PosedBody") -> Any:
        """The State at rest on a body, of any shape, in its first pose; raises BadInput for another body."""
        ...

    def step(self, state: Any, posed: "PosedBody", dt: float) -> tuple[Any, Vertices]:
        """Advance by `dt` seconds to the pose given; the next State and the vertices beside the body [m], float32.

        A `Player` asks for times from 0.1 ms to 0.25 s.
        """
        ...

    def save(self, path: str | Path) -> None:
        """Write a model file, whole or not at all."""
        ...


@runtime_checkable
class Movable(Protocol):
    """An animator whose States can be put elsewhere: a `Player` plays it near the body, however far that has gone.

    One whose States hold no places of the world returns them as they are. Without `moved_along` positions are counted
    from where the body started: right everywhere, but coarser and slower kilometres away from there.
    """

    def relocate(self, state: Any, shaped: "ShapedBody", way: "Rigid") -> Any:
        """The State where all of it, the body and its past too, is turned about the vertical and shifted by `way`.

        `shaped` is the body that wears the garment. The State that was given is not changed.
        """
        ...


@runtime_checkable
class Driven(Protocol):
    """An animator that can be driven by ground truth, to judge what comes after its own dynamics."""

    def follow(self, state: Any, posed: "PosedBody", dt: float, truth: Vertices) -> tuple[Any, Vertices]:
        """As `step`, driven by what can be seen of simulated vertices (verts, 3) [m]."""
        ...


@runtime_checkable
class Settled(Protocol):
    """An animator that blends settled garments: each is stretched as far as the body under it asks.

    What keeps other animators' cloth in one piece would draw such a garment into the body. The player only shortens
    edges that are much longer than at rest on that body.
    """

    def settled(self, posed: "PosedBody") -> Vertices:
        """The garment as it would settle in a pose, without a past (verts, 3) [m]."""
        ...

    def at_rest(self, state: Any) -> Vertices:
        """The garment in the rest pose of the body of a State (verts, 3) [m]."""
        ...

    def reshaped(self, state: Any, shaped: "ShapedBody") -> Any:
        """The State on a body of another shape, its past kept; raises BadInput for another body."""
        ...


@runtime_checkable
class Redressing(Protocol):
    """An animator that knows what the shape of a body does to its garment, whatever moves it on the mean shape."""

    def redress(
        self, state: Any, posed: "PosedBody", dt: float, worn: Vertices, nominal: "PosedBody"
    ) -> tuple[Any, Vertices]:
        """As `step`; in the place of its own pose model stands the garment worn by the body of the fit.

        `nominal` is that body in the same pose, `worn` the garment there (verts, 3) [m]: simulated, played by another
        animator, made by hand. Raises BadInput where `nominal` is not the body of the fit.
        """
        ...


@runtime_checkable
class Bounded(Protocol):
    """An animator that knows how far a body is from those of its fit. It plays what is beyond, and errs more there."""

    @property
    def beta_range(self) -> tuple[float, float]:
        """From where to where it can be believed in each of the body's betas."""
        ...

    @property
    def novelty_limit(self) -> float:
        """The novelty above which a pose is unlike all poses of the fit."""
        ...

    def novelty(self, state: Any) -> float:
        """How far the pose that led to a State is from the nearest one of the fit; 1: as far as these are apart."""
        ...


@runtime_checkable
class MaterialAware(Protocol):
    """An animator, or a `Wearable`, whose garment may be made of another material."""

    @property
    def known_materials(self) -> Sequence[str]:
        """Names of the materials that it need not guess, that of the fit first."""
        ...

    def in_material(self, material: "Material | str") -> Self:
        """The same with its garment made of a material, or of the name of one.

        Raises BadGarment for a material that is none, BadInput where the animator knows too little of it.
        """
        ...


@runtime_checkable
class Related(Protocol):
    """An animator of a garment that it was not fitted to, and that knows which of those of its fit are most like it."""

    @property
    def relatives(self) -> Sequence[tuple[str, float]]:
        """Their names, the nearest first, and how far each is; 1: as far as one of them is from its nearest one."""
        ...


@runtime_checkable
class Detailed(Protocol):
    """An animator that can play with fewer vertices, for a garment that is far from the camera."""

    def at_detail(self, detail: float) -> Animator:
        """The level with that share of the vertices, above 0 and at most 1; below 1 it is a `QualityLevel`, too.

        Asked again it gives the same one. States of all levels are of one kind: a State of one can be stepped by
        another. Raises BadInput for a share that
        is out of range, or that leaves too few vertices.
        """
        ...


@runtime_checkable
class Level(Animator, Protocol):
    """An animator at a lower level of detail."""

    @property
    def full(self) -> Animator:
        """The one with all vertices."""
        ...

    @property
    def kept(self) -> Int[np.ndarray, " kept"]:
        """Which vertex of the full garment each of this one's is."""
        ...


@runtime_checkable
class Wearable(Protocol):
    """Fitted on many garments at once: it becomes an animator when it is given one to wear."""

    @property
    def name(self) -> str:
        """Name of its kind, as of an `Animator`."""
        ...

    @property
    def figures(self) -> Mapping[str, float]:
        """What the fit reached, unit in the name."""
        ...

    def animator_for(self, garment: "Garment", body: "ShapedBody") -> Animator:
        """The animator of one garment on one body."""
        ...

    def save(self, path: str | Path) -> None:
        """Write a model file, whole or not at all."""
        ...


@runtime_checkable
class AnimatorKind(Protocol):
    """What the registry knows by a name: how an animator is fitted, and how it is read back.

    A class with class attributes and classmethods will do, the animator's own too, or an object.
    """

    @property
    def name(self) -> str:
        """The name."""
        ...

    @property
    def Config(self) -> type:
        """A frozen dataclass of options of the fit, all with defaults."""
        ...

    def fit(
        self,
        data: Any,
        config: Any = None,
        *,
        seed: int = 0,
        progress: Progress | None = None,
        checkpoints: Path | None = None,
    ) -> Animator | Wearable:
        """Learn from simulated takes or drapes; goes on from the folder `checkpoints` after a kill."""
        ...

    def of(self, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> Animator | Wearable:
        """Make one from what a model file holds; raises BadModel before anything runs."""
        ...
