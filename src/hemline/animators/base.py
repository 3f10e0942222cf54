"""The contract of an animator: what `play`, `evaluate` and a game loop may rely on."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, Self, runtime_checkable

import numpy as np

from hemline.arrays import Vertices

if TYPE_CHECKING:
    from hemline.bodies.posed import PosedBody
    from hemline.datasets import Dataset
    from hemline.garments.garment import Garment

Progress = Callable[[str, int, int], None]
"""Called with the stage of a fit, the steps done and the steps in all."""


@runtime_checkable
class Animator(Protocol):
    """Fitted parameters that turn a moving body into a moving garment.

    Parameters are frozen; all that moves is in the State: plain arrays in a dataclass, never changed in place, so that
    keeping an old State is a rollback. The same input gives the same bits on one machine.
    """

    Config: ClassVar[type]
    """A frozen dataclass of options of the fit; `Config()` is the default; it has a field `epochs`."""

    @property
    def garment(self) -> "Garment":
        """The garment, mesh and all."""
        ...

    @property
    def body_name(self) -> str:
        """Name of the body that the garment was fitted on."""
        ...

    @property
    def figures(self) -> Mapping[str, float]:
        """What the fit reached, unit in the name."""
        ...

    @classmethod
    def fit(
        cls,
        dataset: "Dataset",
        config: Any = None,
        *,
        seed: int = 0,
        progress: Progress | None = None,
        checkpoints: Path | None = None,
    ) -> Self:
        """Learn from simulated takes; goes on from `checkpoints` after a kill."""
        ...

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> Self:
        """Make one from what a model file holds; raises BadModel before anything runs."""
        ...

    def start(self, posed: "PosedBody | Sequence[PosedBody]", *, agents: int | None = None) -> Any:
        """The State at rest on a body in its first pose; with `agents`, one of each body in a sequence."""
        ...

    def step(self, state: Any, posed: "PosedBody | Sequence[PosedBody]", dt: float) -> tuple[Any, Vertices]:
        """Advance by `dt` seconds to the pose given; the next State and the vertices in the world [m]."""
        ...

    def follow(self, state: Any, posed: "PosedBody", dt: float, truth: Vertices) -> tuple[Any, Vertices]:
        """As `step`, driven by what is seen of simulated vertices [m] instead of by the animator's own dynamics."""
        ...

    def save(self, path: str | Path) -> None:
        """Write a model file, whole or not at all."""
        ...
