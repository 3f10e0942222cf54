"""Options of a garment that is simulated in real time."""

from dataclasses import dataclass
from typing import Literal

from hemline.animators.simulated_proxy import QUALITY_LEVELS, QualityLevel
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
    """Edge length of the simulated mesh [m]."""
    fewest: int = positive(500)
    """Minimum number of vertices of the simulated mesh. A garment with fewer vertices is simulated with all of them."""
    most: int = positive(1500)
    """Maximum number of vertices of the simulated mesh."""
    quality: Quality = "budget"
    """Quality of the simulation: fast, good, fine, or the best within --budget-ms (budget)."""
    budget_ms: float = positive(33.0)
    """Time that a frame of 1/30 s may take on two cores [ms], for --quality budget."""
    self_contact: bool = False
    """Simulate contact of the cloth with itself."""
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Mean wind velocity along x, y (up) and z [m/s]."""
    gusts: float = not_negative(0.0)
    """Standard deviation of each component of the wind [m/s]. With 0 the wind is constant."""

    def __post_init__(self) -> None:
        check_options(self)

    @property
    def size(self) -> ProxySize:
        """Of the garment that is simulated."""
        return ProxySize(self.edge, self.fewest, self.most)

    def level(self, vertices: int) -> QualityLevel:
        """What a frame of a garment of so many vertices is simulated with."""
        if self.quality != "budget":
            return QUALITY_LEVELS[self.quality]
        bought = (each for each in QUALITY_LEVELS.values() if self.cost_ms(each, vertices) <= self.budget_ms)
        return next(bought, QUALITY_LEVELS["fast"])

    @staticmethod
    def cost_ms(level: QualityLevel, vertices: int) -> float:
        """What the table says that a frame costs [ms]."""
        return level.frame_ms + 1e-3 * level.vertex_us * vertices

    def settings(self, vertices: int) -> SimSettings:
        """Those of the simulator, for a garment of so many vertices."""
        return self.level(vertices).settings(self_contact=self.self_contact, wind=self.wind, gusts=self.gusts)
