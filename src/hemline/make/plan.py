"""Divides the time that is left between simulated clips and settled drapes."""

from dataclasses import asdict, dataclass
from typing import Any, Self

from .clock import time_text

DRAPE_FRAMES, BODY_FRAMES, DERIVATIVE_FRAMES, POSE_FRAMES = 25.0, 135.0, 45.0, 9.0
"""Cost of settling the garment in a pose, of settling it at rest on one more body, of its derivatives by all joints,
and of a pose of a tour, in simulated frames of the same garment."""
ROPES_START_S, ROPES_FRAME_S = 15.0, 0.035
"""Time of a fit of rope chains, at the start and for each frame, at slowness 1 [s]."""
AGENTDRESS_DRAPE_S = 0.12
"""Time that the fit of AgentDress takes for each drape, at slowness 1 [s]."""
TRIAL_S, REPORT_S = 20.0, 25.0
"""Time of playing one method on the clip that is kept back, and of writing the report, at slowness 1 [s]."""
RESERVE = 0.15
"""Fraction of the time that is not planned, since other programs may slow the machine down."""
LEAST_HANGING, LEAST_CLOSE = 0.15, 0.4
"""Fraction of a garment's area that must hang for rope chains, and lie close for AgentDress."""
FEWEST_FRAMES = 150
"""Number of simulated frames below which rope chains are not fitted."""
BODIES = 17
"""Number of bodies on which an anchor is settled."""
FIRST_FRAMES = BODY_FRAMES + DERIVATIVE_FRAMES + DRAPE_FRAMES
"""Cost of the T-pose on the mean body, which one process settles before the tour, in simulated frames."""
FEWEST_ANCHORS, MOST_ANCHORS = 4, 150
"""Number of anchors below which there are none and the garment follows the skin on other bodies, and the paper's."""
FEWEST_POSES, ENOUGH_POSES, MOST_POSES = 80, 200, 400
"""Number of poses of the tour below which AgentDress is not fitted, above which time goes to anchors first, and largest
number: the fit takes the third power of it."""
SHAPES_SHARE, ANCHORS_SHARE = 0.6, 0.6
"""Share of the time beyond `ENOUGH_POSES` that goes to bodies of other shapes, and share of that for anchors; the rest
is for random bodies."""
SPEEDS = (1.0, 0.8, 1.25, 0.65)
"""Factors of the speed of clips, used one after another until there are enough frames."""


@dataclass(frozen=True)
class DataPlan:
    """What is simulated and settled, and which methods are compared.

    Attributes:
        methods: Animators to compare.
        frames: Number of frames to simulate for rope chains; 0 for none.
        poses: Number of poses of the tour on the mean body for AgentDress; 0 for none.
        anchors: Number of poses to settle on seventeen bodies; with 0 the garment follows the skin on other bodies.
        random: Number of random bodies, each settled in one pose.
        left_out: Reason for each method that is not tried, as a sentence.
    """

    methods: tuple[str, ...]
    frames: int
    poses: int
    anchors: int
    random: int
    left_out: tuple[str, ...]

    @property
    def drapes(self) -> int:
        """Number of drapes, those in the T-pose included."""
        if self.poses == 0:
            return 0
        return self.poses + (BODIES * (self.anchors + 1) + self.random if self.anchors else 1)

    def seconds(self, frame_s: float, jobs: int, slowness: float) -> dict[str, float]:
        """Returns the time that simulation, drapes and fits will take [s].

        Args:
            frame_s: Time of one simulated frame in one process [s].
            jobs: Number of processes.
            slowness: Slowness of this machine, see `measure_slowness`.
        """
        ropes = ropes_seconds(self.frames, slowness) if self.frames else 0.0
        return {
            "simulate": frame_s * self.frames / jobs,
            "drape": frame_s * self._drape_frames(jobs) / jobs,
            "fit": ropes + agentdress_seconds(self.drapes, slowness),
        }

    def _drape_frames(self, jobs: int) -> float:
        """Returns the cost of all drapes, in simulated frames."""
        if self.poses == 0:
            return 0.0
        total = FIRST_FRAMES * jobs + POSE_FRAMES * self.poses
        if self.anchors:
            settled = BODIES * (self.anchors + 1) + self.random
            total += _t_pose_frames(jobs, self.anchors) + DRAPE_FRAMES * settled + BODY_FRAMES * self.random
        return total

    def entries(self) -> dict[str, Any]:
        """Returns the plan as JSON-like values."""
        return {name: list(value) if isinstance(value, tuple) else value for name, value in asdict(self).items()}

    @classmethod
    def of_entries(cls, entries: dict[str, Any]) -> Self:
        """Returns the plan that `entries` returned."""
        return cls(**{name: tuple(value) if isinstance(value, list) else value for name, value in entries.items()})


def ropes_seconds(frames: int, slowness: float) -> float:
    """Returns the time that a fit of rope chains to so many frames takes [s], at this slowness."""
    return slowness * (ROPES_START_S + frames * ROPES_FRAME_S)


def agentdress_seconds(drapes: int, slowness: float) -> float:
    """Returns the time that a fit of AgentDress to so many drapes takes [s], at this slowness."""
    return slowness * AGENTDRESS_DRAPE_S * drapes


def _t_pose_frames(jobs: int, anchors: int) -> float:
    """Returns the cost of derivatives, and of settling the garment at rest on the bodies of the anchors.

    Each process settles it for itself on each body that it meets.
    """
    return BODIES * (BODY_FRAMES * min(jobs, anchors + 1) + DERIVATIVE_FRAMES)


def plan_data(
    methods: tuple[str, ...],
    hanging: float,
    frame_s: float,
    seconds_left: float,
    jobs: int,
    *,
    slowness: float,
    most_frames: int,
    most_poses: int,
) -> DataPlan:
    """Returns what can be simulated and settled in the time that is left.

    Args:
        methods: Animators that may be compared.
        hanging: Fraction of the garment's area that hangs.
        frame_s: Measured time of one simulated frame in one process [s].
        seconds_left: Time left for data and fits [s].
        jobs: Number of processes.
        slowness: Slowness of this machine, see `measure_slowness`.
        most_frames: Number of frames of all clips at all `SPEEDS`.
        most_poses: Number of different poses in the clips; no more anchors, further poses or random bodies are planned.
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
    budget = max(0.0, seconds_left) * (1 - RESERVE)
    frame_cost = frame_s / jobs + slowness * ROPES_FRAME_S
    drape_s = frame_s * DRAPE_FRAMES / jobs + slowness * AGENTDRESS_DRAPE_S
    random_s = drape_s + frame_s * BODY_FRAMES / jobs

    def frames_within(seconds: float) -> int:
        return min(most_frames, max(0, int((seconds - slowness * ROPES_START_S) / frame_cost)))

    pose_s = frame_s * POSE_FRAMES / jobs + slowness * AGENTDRESS_DRAPE_S
    first_s = frame_s * FIRST_FRAMES + slowness * AGENTDRESS_DRAPE_S
    least_s = first_s + FEWEST_POSES * pose_s
    # time is shared as the area is: hanging cloth is the part that rope chains play better
    frames = frames_within((hanging if close else 1.0) * budget) if ropes else 0
    if close and frames_within(budget - least_s) >= FEWEST_FRAMES:
        frames = min(frames, frames_within(budget - least_s))
    frames = frames if frames >= FEWEST_FRAMES else 0
    for_drapes = budget - (slowness * ROPES_START_S + frames * frame_cost if frames else 0.0)
    anchors = poses = random = 0
    if close and for_drapes >= least_s:
        most = min(most_poses, MOST_POSES)
        left_s = for_drapes - first_s - min(ENOUGH_POSES, most) * pose_s
        more_poses_s = max(0, most - ENOUGH_POSES) * pose_s
        shapes_s = max(SHAPES_SHARE * left_s, left_s - more_poses_s) - BODIES * drape_s
        wanted_s = ANCHORS_SHARE * (shapes_s - frame_s * _t_pose_frames(jobs, MOST_ANCHORS) / jobs)
        anchors = min(MOST_ANCHORS, most_poses, max(0, int(wanted_s / (BODIES * drape_s))))
        if anchors < FEWEST_ANCHORS:
            anchors = 0
        else:
            spent_s = frame_s * _t_pose_frames(jobs, anchors) / jobs + anchors * BODIES * drape_s
            random = min(most_poses, max(0, int((shapes_s - spent_s) / random_s)))
            for_drapes -= spent_s + BODIES * drape_s + random * random_s
        poses = min(most, int((for_drapes - first_s) / pose_s))
    if close and poses < FEWEST_POSES:
        close, anchors, poses, random = False, 0, 0, 0
        left_out.append(
            f"agentdress needs about {time_text(least_s)} of drapes for this garment, "
            f"and there are {time_text(for_drapes)}."
        )
        frames = frames_within(budget) if ropes else 0
    if ropes and frames < FEWEST_FRAMES:
        ropes = False
        need = slowness * ROPES_START_S + FEWEST_FRAMES * frame_cost
        left_out.append(f"ropes needs about {time_text(need)} of simulation and training.")
    kept = tuple(method for method in methods if (method != "ropes" or ropes) and (method != "agentdress" or close))
    return DataPlan(
        kept,
        frames if ropes else 0,
        poses,
        anchors,
        random,
        tuple(left_out),
    )
