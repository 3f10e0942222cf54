"""What all steps of making a model need."""

from collections.abc import Sequence
from dataclasses import dataclass

from hemline import sim
from hemline.animators import Progress
from hemline.bodies import ShapedBody
from hemline.datasets import Dataset, open_dataset
from hemline.garments import Garment
from hemline.motions import Motion

from .clock import Clock
from .settings import MakeSettings
from .work_folder import WorkFolder


@dataclass(frozen=True)
class Job:
    """What all steps need.

    Attributes:
        settings: Options.
        jobs: Number of processes.
        scheduler: Address of a dask scheduler whose workers simulate instead.
        clips: Clips to simulate.
        check: The clip that methods are compared on.
        body: The body.
        garment: The garment, tried on.
        work: The folder of the run.
        clock: The time of the run.
        progress: Called with the stage, the steps done and the total number of steps.
    """

    settings: MakeSettings
    jobs: int
    scheduler: str | None
    clips: list[Motion]
    check: Motion
    body: ShapedBody
    garment: Garment
    work: WorkFolder
    clock: Clock
    progress: Progress

    def produce(self, name: str, clips: Sequence[sim.ClipRequest], progress: Progress) -> Dataset:
        """Simulates clips into a dataset of the folder; existing takes are kept."""
        folder = self.work.folder / name
        sim.produce(folder, self.garment, clips, jobs=self.jobs, scheduler=self.scheduler, report=progress)
        return open_dataset(folder)
