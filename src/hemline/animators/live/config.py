"""Options of a garment that is simulated in real time."""

from dataclasses import dataclass
from typing import Literal

from hemline.animators.simulated_proxy import LEVELS, Level
from hemline.garments.proxy.proxy import ProxySize
from hemline.options import check_options, not_negative, positive
from hemline.sim.settings import SimSettings

Quality = Literal["budget", "fast", "good", "fine"]


@dataclass(frozen=True)
class LiveConfig:
    """Options of `live`.

    Nothing depends on a clock: what a budget buys is read from a table of costs. So the same input gives the same bits.

    Raises:
        BadInput: A value that makes no sense, such as an edge of length 0.
    """

    edge: float = positive(0.035)
    """Length of the edges of the garment that is simulated [m]."""
    fewest: int = positive(500)
    """Vertices that it has at least; all where the garment has no more."""
    most: int = positive(1500)
    """Vertices that it has at most."""
    quality: Quality = "budget"
    """`fast`, `good` or `fine`; `budget`: the best that the budget buys."""
    budget_ms: float = positive(33.0)
    """What a frame of 1/30 s may cost on two cores [ms]; only `budget` asks for it."""
    self_contact: bool = False
    """Whether the cloth meets itself."""
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Wind in the world [m/s]."""
    gusts: float = not_negative(0.0)
    """Standard deviation of each component of the wind; 0: it is constant [m/s]."""

    def __post_init__(self) -> None:
        check_options(self)

    @property
    def size(self) -> ProxySize:
        """Of the garment that is simulated."""
        return ProxySize(self.edge, self.fewest, self.most)

    def level(self, vertices: int) -> Level:
        """What a frame of a garment of so many vertices is simulated with."""
        if self.quality != "budget":
            return LEVELS[self.quality]
        bought = (each for each in LEVELS.values() if self.cost_ms(each, vertices) <= self.budget_ms)
        return next(bought, LEVELS["fast"])

    @staticmethod
    def cost_ms(level: Level, vertices: int) -> float:
        """What the table says that a frame costs [ms]."""
        return level.frame_ms + 1e-3 * level.vertex_us * vertices

    def settings(self, vertices: int) -> SimSettings:
        """Those of the simulator, for a garment of so many vertices."""
        return self.level(vertices).settings(self_contact=self.self_contact, wind=self.wind, gusts=self.gusts)
