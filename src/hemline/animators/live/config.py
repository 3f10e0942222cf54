"""Options of a garment that is simulated in real time."""

from dataclasses import dataclass
from typing import Literal, NamedTuple

from hemline.garments.proxy import ProxySize
from hemline.options import check_options, not_negative, positive
from hemline.sim.settings import SimSettings

Quality = Literal["budget", "fast", "good", "fine"]


HALVINGS = 3
"""How often a step that fails is halved, before the cloth is carried along instead."""


class Level(NamedTuple):
    """What a quality means."""

    substeps: int
    """Steps of backward Euler in a frame of 1/30 s."""
    newton_steps: int
    """Newton steps in each, at most."""
    residual_share: float
    """Fewer, where the mean residual force is below this share of a vertex's mean weight."""
    frame_ms: float
    """What a frame costs however few vertices there are [ms]."""
    vertex_us: float
    """What each vertex adds [us]."""


LEVELS = {
    "fine": Level(4, 6, 0.25, 12.0, 24.0),
    "good": Level(2, 6, 0.6, 6.0, 11.0),
    "fast": Level(2, 4, 0.9, 5.0, 9.0),
}
"""From the best on. Costs are estimates from the light skirt at 1,000 vertices (README), without self-contact."""


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
        level = self.level(vertices)
        return SimSettings(
            substeps=level.substeps,
            newton_steps=level.newton_steps,
            residual_share=level.residual_share,
            self_contact=self.self_contact,
            wind=self.wind,
            gusts=self.gusts,
            halvings=HALVINGS,
        )
