"""What all steps of making a model need."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from hemline import sim
from hemline.animators import Progress
from hemline.arrays import Vertices
from hemline.bodies import ShapedBody
from hemline.datasets import Dataset, open_dataset
from hemline.errors import SimulationFailed
from hemline.garments import Garment
from hemline.motions import Motion

from .clock import Clock
from .data_mesh import DataMesh
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
        mesh: The mesh that is simulated to get data for fits.
        simulation: Settings of the simulator.
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
    mesh: DataMesh
    simulation: sim.SimSettings
    work: WorkFolder
    clock: Clock
    progress: Progress

    def simulate(self, name: str, clips: Sequence[sim.ClipRequest], progress: Progress) -> Dataset:
        """Simulates the garment itself on clips, into a dataset of the folder; existing takes are kept."""
        folder = self.work.folder / name
        self.produce(folder, self.garment, clips, progress)
        return open_dataset(folder)

    def produce(self, folder: Path, mesh: Garment, clips: Sequence[sim.ClipRequest], progress: Progress) -> None:
        """Simulates a mesh on clips into a dataset; existing takes are kept."""
        how = {"settings": self.simulation, "jobs": self.jobs, "scheduler": self.scheduler}
        sim.produce(folder, mesh, clips, report=progress, **how)

    def settled(self) -> Vertices:
        """Returns the garment settled on the body (verts, 3) [m]; it settles once, in the dataset `check`.

        Raises:
            SimulationFailed: The garment does not come to rest.
        """
        folder, betas = self.work.folder / "check", self.garment.body_betas
        (rest,) = sim.produce_rests(folder, self.garment, [tuple(betas)], settings=self.simulation)
        if isinstance(rest, str):
            raise SimulationFailed(f"{self.garment.name} cannot be simulated: {rest}")
        return rest.vertices[0]

    def adapt_simulation(self) -> "Job":
        """Returns the run with settings with which the garment comes to rest: without self-contact if it is tangled.

        Raises:
            SimulationFailed: It does not come to rest without self-contact either.
        """
        plain = replace(self, simulation=replace(self.simulation, self_contact=False))
        if self.work.state.get("self_contact", True) is False:  # found by the run that is continued
            return plain
        try:
            self.settled()
        except SimulationFailed as reason:
            plain.settled()
            self.work.note(self_contact=False)
            self.clock.say(f"{reason}. It is simulated without contact of the cloth with itself.")
            return plain
        return self

    def collect(self, name: str, make: Callable[[Path, Garment], object]) -> None:
        """Makes a dataset of the mesh that is simulated, and from it the one of the garment in the folder.

        What was made is kept if `make` stops with an error.

        Args:
            name: Name of the dataset.
            make: Makes it, given its folder and the mesh.
        """
        folder, mesh = self.work.folder / name, self.mesh
        mesh.remove_others(folder)
        if not mesh.is_coarser:
            make(folder, self.garment)
            return
        coarse = self.work.folder / "coarse" / f"{len(mesh.vertex_ids)}" / name
        try:
            make(coarse, mesh.simulated)
        finally:
            if (coarse / "garment.safetensors").exists():
                mesh.carry(open_dataset(coarse), folder, self.settled())
