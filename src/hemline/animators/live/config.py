"""Options of `live`, which simulates a garment in real time."""

from dataclasses import dataclass
from typing import Literal, NamedTuple

from hemline.animators.newton_solver import newton_settings
from hemline.errors import BadInput
from hemline.garments.proxy.proxy import ProxySize
from hemline.options import check_options, not_negative, positive
from hemline.sim.settings import SimSettings

Quality = Literal["budget", "fast", "good", "fine", "exact"]


class QualityLevel(NamedTuple):
    """Steps and cost of a quality level that simulates in small steps."""

    substeps: int
    """Steps in a frame of 1/30 s."""
    frame_ms: float
    """Cost of a frame without vertices [ms]."""
    vertex_us: float
    """Cost of each vertex [us]."""


QUALITY_LEVELS = {
    "fine": QualityLevel(64, 1.5, 4.0),
    "good": QualityLevel(48, 1.5, 3.2),
    "fast": QualityLevel(32, 1.5, 2.4),
}
"""Quality levels that simulate in small steps, best first. Costs are estimates for a dress, on one core."""


@dataclass(frozen=True)
class LiveConfig:
    """Options of `live`.

    The quality for a budget is read from a table of costs, not measured, so that the same input gives the same bits.

    Raises:
        BadInput: An option is out of its range, such as an edge of length 0, or self-contact is asked of a quality that
            does not have it.
    """

    edge: float = positive(0.035)
    """Edge length of the simulated mesh [m]."""
    fewest: int = positive(500)
    """Minimum number of vertices of the simulated mesh. A garment with fewer vertices is simulated with all of them."""
    most: int = positive(1500)
    """Maximum number of vertices of the simulated mesh."""
    quality: Quality = "budget"
    """Quality of the simulation: fast, good, fine, the best of these within --budget-ms (budget), or exact.
    The last one is the offline simulator, at four to six times the cost of fine."""
    budget_ms: float = positive(33.0)
    """Time that a frame of 1/30 s may take on one core [ms], for --quality budget."""
    self_contact: bool = False
    """Simulate contact of the cloth with itself, by quality exact."""
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Mean wind velocity along x, y (up) and z [m/s]."""
    gusts: float = not_negative(0.0)
    """Standard deviation of each component of the wind [m/s]. With 0 the wind is constant."""

    def __post_init__(self) -> None:
        check_options(self)
        if self.self_contact and self.quality in QUALITY_LEVELS:
            raise BadInput(
                "self-contact is simulated by quality 'exact' alone",
                f"quality '{self.quality}'",
                "leave out one of the two options",
            )

    @property
    def size(self) -> ProxySize:
        """Limits of the size of the simulated mesh."""
        return ProxySize(self.edge, self.fewest, self.most)

    @property
    def exact(self) -> bool:
        """Whether the offline simulator simulates."""
        return self.self_contact or self.quality == "exact"

    def level(self, vertices: int) -> QualityLevel:
        """Returns the quality level for a garment with this number of vertices, where small steps simulate."""
        if self.quality in QUALITY_LEVELS:
            return QUALITY_LEVELS[self.quality]
        within = (level for level in QUALITY_LEVELS.values() if self.cost_ms(level, vertices) <= self.budget_ms)
        return next(within, QUALITY_LEVELS["fast"])

    @staticmethod
    def cost_ms(level: QualityLevel, vertices: int) -> float:
        """Returns the cost of a frame according to the table [ms]."""
        return level.frame_ms + 1e-3 * level.vertex_us * vertices

    def settings(self, vertices: int) -> SimSettings:
        """Returns the simulator settings for a garment with this number of vertices."""
        if self.exact:
            return newton_settings(exact=True, self_contact=self.self_contact, wind=self.wind, gusts=self.gusts)
        substeps = self.level(vertices).substeps
        return SimSettings(substeps=substeps, self_contact=False, wind=self.wind, gusts=self.gusts)
