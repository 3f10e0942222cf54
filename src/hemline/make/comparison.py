"""Compares methods on the clip that is kept back: first those that need no fit, then the others if there is time."""

from dataclasses import dataclass, field

from hemline.animators import Progress
from hemline.datasets import Dataset, open_dataset
from hemline.metrics import model_mb

from .candidates import candidate_path, make_candidate, remove_unfinished, try_candidate
from .clock import OutOfTime, time_text
from .job import Job
from .plan import REPORT_S, TRIAL_S, agentdress_seconds, ropes_seconds
from .settings import FITTED, METHODS, UNFITTED
from .slowness import measure_slowness
from .trial import Played, Trial, run_trial


@dataclass
class Comparison:
    """The methods that were compared.

    Attributes:
        job: The run.
        check: Dataset of the clip that is kept back.
        played: Methods that played.
        failed: Methods that failed.
        late: The reason for each method that there was no time for, as a sentence.
        trial_s: Longest time that it took to play and measure a method [s].
    """

    job: Job
    check: Dataset
    played: list[Played] = field(default_factory=list)
    failed: list[Trial] = field(default_factory=list)
    late: list[str] = field(default_factory=list)
    trial_s: float = 0.0

    @property
    def trials(self) -> list[Trial]:
        """Figures of all methods, in the order of `settings.METHODS`."""
        found = [each.trial for each in self.played] + self.failed
        return sorted(found, key=lambda trial: METHODS.index(trial.method))

    def later_s(self, methods: tuple[str, ...]) -> float:
        """Returns the time to leave for trials of the fitted ones of some methods, and for the report [s]."""
        now = measure_slowness()
        return (self.trial_s or now * TRIAL_S) * sum(each in FITTED for each in methods) + now * REPORT_S

    def compare_unfitted(self, methods: tuple[str, ...]) -> None:
        """Compares those methods that need no fit, so that there is a model whatever happens later.

        The one that is usually nearest to the simulation comes first.
        """
        job = self.job
        for method in (each for each in UNFITTED if each in methods):
            job.clock.begin(f"comparing {method}", self.trial_s or None)
            before = job.work.spent_s
            self._compare(method, job.progress)
            self.trial_s = max(self.trial_s, job.work.spent_s - before)

    def compare_fitted(self, methods: tuple[str, ...]) -> None:
        """Fits and compares those methods that are fitted and for which there is time."""
        for method in (each for each in methods if each in FITTED):
            if candidate_path(self.job.work, method).exists():
                self.job.clock.begin(f"comparing {method}", None)
                self._compare(method, self.job.progress)
            else:
                self._fit(method)

    def _fit(self, method: str) -> None:
        """Fits and compares a method, if there is time."""
        job, clock = self.job, self.job.clock
        left_s, now = clock.remaining_s - self.later_s((method,)), measure_slowness()
        data = open_dataset(job.work.folder / ("takes" if method == "ropes" else "drapes"))
        if method == "ropes":
            needed_s = ropes_seconds(sum(row.clip_frames for row in data.clips()), now)
        else:
            needed_s = agentdress_seconds(len(data.rows()), now)
        if left_s < needed_s:
            self._leave_out(
                f"{method} needs about {time_text(needed_s)} for a fit, and {time_text(max(0, left_s))} are left."
            )
            return
        clock.begin(f"fitting and comparing {method}", needed_s + self.trial_s)
        try:
            self._compare(method, clock.stop_late(job.progress, left_s))
        except OutOfTime:
            remove_unfinished(job.work, method)
            self._leave_out(f"{method} was not fitted within {time_text(left_s)}; give the run more --minutes.")

    def _leave_out(self, reason: str) -> None:
        self.late.append(reason)
        self.job.clock.say(f"Not compared: {reason}")

    def _compare(self, method: str, progress: Progress) -> None:
        """Makes the model of a method and plays it."""
        job = self.job
        made = try_candidate(
            lambda: make_candidate(method, job.work, job.garment, job.body, job.settings.seed, progress)
        )
        if isinstance(made, str):
            self.failed.append(Trial(method, failed=made))
            return
        animator, file = made
        self.played.append(run_trial(animator, job.body, job.check, self.check, model_mb(file)))
