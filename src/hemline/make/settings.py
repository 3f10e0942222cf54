"""Options of making a model of a garment mesh."""

from dataclasses import dataclass

from hemline.errors import BadInput
from hemline.options import check_options, not_negative, positive

METHODS = ("agentdress", "ropes", "skinned", "lag", "swingar", "live")
"""Animators that are compared; each is the `--animator` of that name."""
FITTED = ("agentdress", "ropes")
"""Methods that are fitted to the garment."""
UNFITTED = ("live", "lag", "skinned", "swingar")
"""Methods that play any mesh, the one that is usually nearest to the simulation first."""

CHECK_S = 3.0
"""Length of the clip on which methods are compared in a run of ten minutes [s]."""


@dataclass(frozen=True)
class MakeSettings:
    """Options of making a model of a garment mesh.

    Raises:
        BadInput: An option is out of its range, or no method has the given name.
    """

    minutes: float = positive(10.0)
    """Time that the whole run may take [min]. A longer run simulates more poses and clips.
    One hour takes the same steps as ten minutes."""
    ms: float = positive(16.0)
    """Longest time that a frame of the model may take on this machine [ms]; 16 ms are a frame at 60 frames per second.
    A slower method is chosen only if no method below this limit plays the garment well."""
    animator: str = ""
    """Method to use: agentdress, ropes, skinned, lag, swingar or live. By default all suitable ones are compared."""
    seconds: float = not_negative(0.0)
    """Length of the clip on which methods are compared [s]; with 0 it is 3 s, and more in runs of over ten minutes.
    It is shorter where its simulation would take more than 15 % of the time."""
    seed: int = not_negative(0)
    """Seed of the fit and of the choice of poses. The same seed gives the same model on one machine."""

    def __post_init__(self) -> None:
        check_options(self)
        if self.animator and self.animator not in METHODS:
            raise BadInput("no such method", repr(self.animator), f"name one of {', '.join(METHODS)}, or none")

    @property
    def check_seconds(self) -> float:
        """Length of the clip on which methods are compared, as far as the clip is that long [s]."""
        return self.seconds or max(CHECK_S, CHECK_S * self.minutes / 10)
