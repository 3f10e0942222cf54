r"""The rule by which one of several methods is chosen.

A method is sound on the clip that is kept back if

- no vertex is inside the body,
- the 99th percentile of the stretch is at most `STRETCH_ABOVE` points above that of the simulation, and in its worst
  frame at most `WORST_ABOVE` points above that of the simulation's worst frame,
- at most `SKIN_SEEN` percent of the covered skin shows through,
- bones of limbs go through the cloth at most `THROUGH_ABOVE` points more often than in the simulation.

Of the sound methods whose frame takes at most the time limit, the one with the smallest error is chosen; an error
within `ALIKE` of the smallest counts as equal, and then the fastest is chosen. If no sound method is fast enough, a
sound one that is slower is chosen. If no method is sound, the error of each is multiplied by how far it is beyond the
limits, and the smallest product is chosen among those within the time limit.
"""

from collections.abc import Sequence

from .trial import Trial

STRETCH_ABOVE = 8.0
"""Points by which the 99th percentile of the stretch may exceed that of the simulation [percent]."""
WORST_ABOVE = 30.0
"""Points by which it may do so in the worst frame [percent]."""
SKIN_SEEN = 0.1
"""Largest mean fraction of covered skin that may show through [percent]."""
THROUGH_ABOVE = 0.5
"""Points by which limbs through the cloth may exceed those of the simulation [percent of limbs and frames]."""
ALIKE = 0.05
"""Relative difference of errors that counts as none."""


def faults(trial: Trial, truth: Trial) -> list[str]:
    """Returns one phrase for each limit that a method exceeds; none if it is sound.

    Args:
        trial: Figures of the method.
        truth: Figures of the simulation.
    """
    if trial.failed:
        return [trial.failed]
    found = []
    if trial.inside > 0:
        found.append(f"{trial.inside:.2f} % of the vertices are inside the body")
    if trial.stretch_p99 > truth.stretch_p99 + STRETCH_ABOVE:
        found.append(
            f"edges are stretched by {trial.stretch_p99:.0f} %, in the simulation by {truth.stretch_p99:.0f} %"
        )
    if trial.stretch_worst > truth.stretch_worst + WORST_ABOVE:
        found.append(
            f"in the worst frame by {trial.stretch_worst:.0f} %, in the simulation by {truth.stretch_worst:.0f} %"
        )
    if trial.skin_seen > SKIN_SEEN:
        found.append(f"{trial.skin_seen:.2f} % of the covered skin shows through")
    if trial.limbs_through > truth.limbs_through + THROUGH_ABOVE:
        found.append(f"limbs go through the cloth in {trial.limbs_through:.1f} % of the cases")
    return found


def excess(trial: Trial, truth: Trial) -> float:
    """Returns the factor by which a method is beyond the limits, at least 1."""
    stretch = max(0.0, trial.stretch_p99 - truth.stretch_p99 - STRETCH_ABOVE) / STRETCH_ABOVE
    worst = max(0.0, trial.stretch_worst - truth.stretch_worst - WORST_ABOVE) / WORST_ABOVE
    skin = max(0.0, trial.skin_seen - SKIN_SEEN) / SKIN_SEEN
    through = max(0.0, trial.limbs_through - truth.limbs_through - THROUGH_ABOVE) / THROUGH_ABOVE
    return (1 + stretch) * (1 + worst) * (1 + skin) * (1 + through) * (1 + trial.inside)


def choose(trials: Sequence[Trial], truth: Trial, limit_ms: float) -> Trial | None:
    """Returns the trial of the method to use; None if every method failed.

    Args:
        trials: Figures of each method.
        truth: Figures of the simulation.
        limit_ms: Longest time of a frame [ms].
    """
    played = [trial for trial in trials if not trial.failed]
    sound = [trial for trial in played if not faults(trial, truth)]
    fast = [trial for trial in sound if trial.frame_ms <= limit_ms]
    for group in (fast, sound):
        if group:
            least = min(trial.error_mm for trial in group)
            alike = [trial for trial in group if trial.error_mm <= (1 + ALIKE) * least]
            return min(alike, key=lambda trial: trial.frame_ms)
    quick = [trial for trial in played if trial.frame_ms <= limit_ms] or played
    return min(quick, key=lambda trial: trial.error_mm * excess(trial, truth), default=None)
