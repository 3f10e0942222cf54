"""The interface of an animator, and what else an animator may be able to do."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, Self, runtime_checkable

import numpy as np

from hemline.arrays import Int, Vertices

if TYPE_CHECKING:
    from hemline.bodies.body import PosedBody, ShapedBody
    from hemline.garments.garment import Garment
    from hemline.garments.material import Material

    from .rigid_transform import RigidTransform

Progress = Callable[[str, int, int], None]
"""Called with the stage of a fit, the steps done and the number of steps."""


@runtime_checkable
class Animator(Protocol):
    """Fitted parameters that turn a moving body into a moving garment.

    The parameters are frozen. Everything that moves is in the State: plain arrays in a dataclass that is never changed
    in place, so that keeping an old State allows a rollback. The same input gives the same bits on one machine. Ask
    with `isinstance` what else an animator can do: `Movable`, `Driven`, `CloseFitting`, `Settled`, `Redressing`,
    `Bounded`, `MaterialAware`, `Windy`, `Related`, `Detailed`.
    """

    @property
    def name(self) -> str:
        """Name of the kind of animator: in the registry, in model files, on the command line."""
        ...

    @property
    def garment(self) -> "Garment":
        """The garment with its mesh."""
        ...

    @property
    def body_name(self) -> str:
        """Name of the body that the garment was fitted on."""
        ...

    @property
    def body_hash(self) -> str:
        """Hash of the body that the garment was fitted on; any other body is refused."""
        ...

    @property
    def figures(self) -> Mapping[str, float]:
        """Figures of the fit, with their units in the names."""
        ...

    def start(self, posed: "PosedBody") -> Any:
        """Returns the State at rest on a body of any shape in its first pose; raises BadInput on another body."""
        ...

    def step(self, state: Any, posed: "PosedBody", dt: float) -> tuple[Any, Vertices]:
        """Advances by `dt` seconds to a pose; returns the State after and the vertices (verts, 3) [m], float32.

        A `Player` asks for times from 0.1 ms to 0.25 s.
        """
        ...

    def save(self, path: str | Path) -> None:
        """Writes a model file, whole or not at all."""
        ...


@runtime_checkable
class Movable(Protocol):
    """An animator whose States can be moved as a whole, so that a `Player` can play it near the origin.

    An animator whose States hold no places in the world returns them unchanged. Without `relocate` positions are
    counted from where the body started: right everywhere, but coarser and slower kilometres away from there.
    """

    def relocate(self, state: Any, shaped: "ShapedBody", transform: "RigidTransform") -> Any:
        """Returns the State with everything in it, the past too, turned about the vertical and shifted by `transform`.

        `shaped` is the body that wears the garment. The given State is not changed.
        """
        ...


@runtime_checkable
class Driven(Protocol):
    """An animator that ground truth can drive in the place of its own dynamics, to evaluate what comes after them."""

    def follow(self, state: Any, posed: "PosedBody", dt: float, truth: Vertices) -> tuple[Any, Vertices]:
        """Advances like `step`, driven by what is observed of simulated vertices (verts, 3) [m]."""
        ...


@runtime_checkable
class CloseFitting(Protocol):
    """An animator whose garment may lie close to the body as a whole.

    The length limits that keep other cloth in one piece would draw such a garment into the body. The player only
    shortens edges that are longer than at rest on that body, and keeps the garment near the skin in the same step.
    """

    @property
    def stretch_limit(self) -> float:
        """Longest length of an edge, over the longer of those on the pattern and at rest on the body; 0 for a garment
        that does not lie close as a whole."""
        ...

    def at_rest(self, state: Any, shaped: "ShapedBody") -> Vertices:
        """Returns the garment in the rest pose of the body that wears it (verts, 3) [m]."""
        ...


@runtime_checkable
class Settled(CloseFitting, Protocol):
    """An animator that blends settled garments, which are stretched as far as the body under them needs."""

    def drape(self, posed: "PosedBody") -> Vertices:
        """Predicts the garment settled in a pose, without history (verts, 3) [m]."""
        ...

    def reshape(self, state: Any, shaped: "ShapedBody") -> Any:
        """Returns the State on a body of another shape with its past kept; raises BadInput for another body."""
        ...


@runtime_checkable
class Redressing(Protocol):
    """An animator that knows how the body's shape changes its garment, whatever moves the garment on the mean shape."""

    def redress(
        self, state: Any, posed: "PosedBody", dt: float, worn: Vertices, nominal: "PosedBody"
    ) -> tuple[Any, Vertices]:
        """Advances like `step`, with given vertices in the place of the animator's own pose model.

        `nominal` is the body of the fit in the same pose. `worn` are the vertices of the garment on it (verts, 3) [m],
        simulated, played by another animator or made by hand. Raises BadInput if `nominal` is not the body of the fit.
        """
        ...


@runtime_checkable
class Bounded(Protocol):
    """An animator that knows the range of its fit. It plays bodies and poses beyond it with larger errors."""

    @property
    def beta_range(self) -> tuple[float, float]:
        """Lowest and highest value of each beta for which the fit is valid."""
        ...

    @property
    def novelty_limit(self) -> float:
        """Novelty above which a pose is unlike all poses of the fit."""
        ...

    def novelty(self, state: Any) -> float:
        """Returns the distance of a State's pose from the nearest pose of the fit; 1 is the spacing of those poses."""
        ...


@runtime_checkable
class MaterialAware(Protocol):
    """An animator or a `Wearable` whose garment may be made of another material."""

    @property
    def known_materials(self) -> Sequence[str]:
        """Names of the materials that the animator does not have to guess; that of the fit comes first."""
        ...

    def in_material(self, material: "Material | str") -> Self:
        """Returns the animator with its garment made of a material, given as such or by name.

        Raises BadGarment for an impossible material, BadInput if the animator knows too little of it.
        """
        ...


@runtime_checkable
class Windy(Protocol):
    """An animator or a `Wearable` whose garment is moved by wind."""

    def in_wind(self, wind: tuple[float, float, float]) -> Self:
        """Returns the animator in a wind of the world along x, y and z [m/s]. It can step the States of this one."""
        ...


@runtime_checkable
class Related(Protocol):
    """An animator of a garment that it was not fitted to, which knows the most similar garments of its fit."""

    @property
    def relatives(self) -> Sequence[tuple[str, float]]:
        """Names and distances of those garments, nearest first; 1 is the spacing of the garments of the fit."""
        ...


@runtime_checkable
class Detailed(Protocol):
    """An animator that can play with fewer vertices, for a garment that is far from the camera."""

    def at_detail(self, detail: float) -> Animator:
        """Returns the level with that fraction of the vertices, above 0 and at most 1; below 1 it is a `Level` too.

        The same fraction gives the same object. All levels share one kind of State: a level can step the States of
        another. Raises BadInput for a fraction that is out of range or leaves too few vertices.
        """
        ...


@runtime_checkable
class Level(Animator, Protocol):
    """An animator at a lower level of detail."""

    @property
    def full(self) -> Animator:
        """The animator with all vertices."""
        ...

    @property
    def vertex_ids(self) -> Int[np.ndarray, " kept"]:
        """Index in the full garment of each vertex of this one."""
        ...


@runtime_checkable
class Wearable(Protocol):
    """A model that was fitted on many garments. It becomes an animator when it is given one."""

    @property
    def name(self) -> str:
        """Name of the kind of animator."""
        ...

    @property
    def figures(self) -> Mapping[str, float]:
        """Figures of the fit, with their units in the names."""
        ...

    def animator_for(self, garment: "Garment", body: "ShapedBody") -> Animator:
        """Returns the animator of one garment on one body."""
        ...

    def save(self, path: str | Path) -> None:
        """Writes a model file, whole or not at all."""
        ...


@runtime_checkable
class AnimatorKind(Protocol):
    """An entry of the registry: how an animator is fitted and how it is read back.

    A class with class attributes and classmethods will do, for example the animator's own class. `LazyKind` is one
    that imports its code on first use.
    """

    @property
    def name(self) -> str:
        """Name of the kind of animator."""
        ...

    @property
    def Config(self) -> type:
        """Class of the options of the fit, a frozen dataclass in which all options have defaults."""
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
        """Fits an animator to simulated takes or drapes; continues from the folder `checkpoints` after a kill."""
        ...

    def of(self, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> Animator | Wearable:
        """Reads an animator from the contents of a model file; raises BadModel before anything runs."""
        ...
