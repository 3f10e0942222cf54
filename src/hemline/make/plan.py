"""Divides the time that is left between simulated clips and settled drapes."""

from dataclasses import asdict, dataclass
from typing import Any, Self

FRAMES_PER_DRAPE = 40.0
"""Cost of one settled drape, in simulated frames of the same garment."""
FITTED_FRAME = 0.8
"""Time that the fit of rope chains takes for each simulated frame, in one process, over that of the simulation."""
RESERVE = 0.25
"""Fraction of the time that is left for the other fits, the comparison and the report."""
LEAST_HANGING, LEAST_CLOSE = 0.15, 0.4
"""Fraction of a garment's area that must hang for rope chains, and lie close for AgentDress."""
FEWEST_FRAMES = 150
"""Number of simulated frames below which rope chains are not fitted."""
BODIES = 17
"""Number of bodies on which an anchor is settled."""
FEWEST_ANCHORS, MOST_ANCHORS = 2, 150
"""Number of anchors below which AgentDress is not fitted, and that of the paper."""
SPEEDS = (1.0, 0.8, 1.25, 0.65)
"""Factors of the speed of clips, used one after another until there are enough frames."""


@dataclass(frozen=True)
class DataPlan:
    """What is simulated and settled, and which methods are compared.

    Attributes:
        methods: Animators to compare.
        frames: Number of frames to simulate for rope chains; 0 for none.
        anchors: Number of poses to settle on seventeen bodies for AgentDress; 0 for none.
        poses: Number of further poses to settle on the mean body.
        random: Number of random bodies, each settled in one pose.
        left_out: Reason for each method that is not tried, as a sentence.
    """

    methods: tuple[str, ...]
    frames: int
    anchors: int
    poses: int
    random: int
    left_out: tuple[str, ...]

    @property
    def drapes(self) -> int:
        """Number of drapes to settle, those in the T-pose included."""
        return 0 if self.anchors == 0 else BODIES * (self.anchors + 1) + self.poses + self.random

    def seconds(self, frame_s: float, jobs: int) -> dict[str, float]:
        """Returns the time that simulation and drapes will take [s].

        Args:
            frame_s: Time of one simulated frame in one process [s].
            jobs: Number of processes.
        """
        return {
            "simulate": frame_s * self.frames / jobs,
            "fit": frame_s * self.frames * FITTED_FRAME,
            "drape": frame_s * FRAMES_PER_DRAPE * self.drapes / jobs,
        }

    def entries(self) -> dict[str, Any]:
        """Returns the plan as JSON-like values."""
        return {name: list(value) if isinstance(value, tuple) else value for name, value in asdict(self).items()}

    @classmethod
    def of_entries(cls, entries: dict[str, Any]) -> Self:
        """Returns the plan that `entries` returned."""
        return cls(**{name: tuple(value) if isinstance(value, list) else value for name, value in entries.items()})


def plan_data(methods: tuple[str, ...], hanging: float, frame_s: float, seconds_left: float, jobs: int) -> DataPlan:
    """Returns what can be simulated and settled in the time that is left.

    Args:
        methods: Animators that may be compared.
        hanging: Fraction of the garment's area that hangs.
        frame_s: Measured time of one simulated frame in one process [s].
        seconds_left: Time left for everything [s].
        jobs: Number of processes.
    """
    left_out: list[str] = []
    ropes, close = "ropes" in methods, "agentdress" in methods
    alone = len(methods) == 1
    if ropes and hanging < LEAST_HANGING and not alone:
        ropes = False
        left_out.append(f"ropes is for cloth that hangs, and {100 * hanging:.0f} % of this garment does.")
    if close and hanging > 1 - LEAST_CLOSE and not alone:
        close = False
        left_out.append(
            f"agentdress is for cloth that lies close, and {100 * (1 - hanging):.0f} % of this garment does."
        )
    budget = max(0.0, seconds_left) * (1 - RESERVE) / frame_s
    frame_cost, drape_cost = 1 / jobs + FITTED_FRAME, FRAMES_PER_DRAPE / jobs
    part = {(True, True): 0.4, (True, False): 1.0}.get((ropes, close), 0.0)
    frames = int(part * budget / frame_cost)
    drapes = int((1 - part) * budget / drape_cost) if close else 0
    anchors = min(MOST_ANCHORS, max(0, round(0.55 * drapes / BODIES) - 1))
    if close and anchors < FEWEST_ANCHORS:
        close = False
        need = (FEWEST_ANCHORS + 1) * BODIES / 0.55 * drape_cost * frame_s
        left_out.append(f"agentdress needs about {need / 60:.0f} minutes of drapes for this garment.")
        frames = int(budget / frame_cost) if ropes else 0
    if ropes and frames < FEWEST_FRAMES:
        ropes = False
        left_out.append(f"ropes needs about {FEWEST_FRAMES * frame_cost * frame_s / 60:.0f} minutes of simulation.")
    rest = max(0, drapes - BODIES * (anchors + 1))
    poses = round(0.75 * rest)
    kept = tuple(method for method in methods if (method != "ropes" or ropes) and (method != "agentdress" or close))
    return DataPlan(
        kept,
        frames if ropes else 0,
        anchors if close else 0,
        poses if close else 0,
        rest - poses if close else 0,
        tuple(left_out),
    )
