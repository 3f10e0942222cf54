"""Options of `live`, which simulates a garment in real time."""

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

    The quality for a budget is read from a table of costs, not measured, so that the same input gives the same bits.

    Raises:
        BadInput: An option is out of its range, such as an edge of length 0.
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
        """Limits of the size of the simulated mesh."""
        return ProxySize(self.edge, self.fewest, self.most)

    def level(self, vertices: int) -> QualityLevel:
        """Returns the quality level for a garment with this number of vertices."""
        if self.quality != "budget":
            return QUALITY_LEVELS[self.quality]
        within = (level for level in QUALITY_LEVELS.values() if self.cost_ms(level, vertices) <= self.budget_ms)
        return next(within, QUALITY_LEVELS["fast"])

    @staticmethod
    def cost_ms(level: QualityLevel, vertices: int) -> float:
        """Returns the cost of a frame according to the table [ms]."""
        return level.frame_ms + 1e-3 * level.vertex_us * vertices

    def settings(self, vertices: int) -> SimSettings:
        """Returns the simulator settings for a garment with this number of vertices."""
        return self.level(vertices).settings(self_contact=self.self_contact, wind=self.wind, gusts=self.gusts)
