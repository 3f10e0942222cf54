"""Scenes with a garment on the shipped body: settled in the rest pose, and on a moving body."""

import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.engines.play import EngineRun
from benchmarks.engines.scene import EngineScene
from hemline import bodies, garments, motions, sim
from hemline.bodies import ShapedBody
from hemline.datasets.take import Take
from hemline.garments import Garment
from hemline.sim import Elastic, Stepper
from hemline.tryon import open_garment

SKIRT = Path(__file__).parents[3] / "shared/data/garments/garmentcode_mit/skirt_circle_mean_all.obj"
"""Mesh in the shared data folder beside the checkout, needed by `--skirt`."""


def without_air(garment: Garment) -> Garment:
    """Returns the garment without air drag, which Blender and Newton do not model in our form."""
    return replace(garment, material=replace(garment.material, drag=0.0, lift=0.0))


def cape() -> Garment:
    """Loads the light cape."""
    return without_air(garments.load("cape-light"))


def skirt() -> Garment:
    """Loads the circle skirt of GarmentCode on the shipped body."""
    return without_air(open_garment(SKIRT, body(), tryon="never"))


def body() -> ShapedBody:
    """Loads the shipped body in its mean shape."""
    return bodies.load("anny24").shaped()


def rest_scene(garment: Garment, frames: int) -> EngineScene:
    """Returns a scene of the unsettled garment in the rest pose."""
    shaped = body()
    posed = shaped.posed(shaped.rest_pose)
    return _scene(garment, f"{garment.name} in the rest pose", garment.vertices, [posed]).still(frames)


def settle(garment: Garment, settings: sim.SimSettings) -> Take:
    """Settles the garment, as at the start of every take."""
    return sim.rest_drape(garment, body(), settings)


def run_scene(
    garment: Garment, rest: Take, settings: sim.SimSettings, frames: int
) -> tuple[EngineScene, EngineRun, int]:
    """Simulates the shipped run with hemline, projection included, and returns its frames as a scene, too.

    Args:
        garment: The garment.
        rest: Settled drape.
        settings: Settings of the simulation.
        frames: Number of frames after the lead-in.

    Returns:
        The scene, the run of hemline, and the number of lead-in frames.
    """
    shaped = body()
    motion = shaped.untangle_motion(shaped.placed(motions.load("run").resample(settings.fps)))[:frames]
    stamps = []
    take = sim.simulate(
        garment, shaped, motion, settings, start=rest, progress=lambda *_: stamps.append(time.perf_counter())
    )
    ms = 1000 * np.diff(stamps, prepend=stamps[0])
    posed = [shaped.posed(take.motion[i]) for i in range(len(take.motion))]
    scene = _scene(garment, f"{garment.name} on a run", take.vertices[0], posed)
    options = {"substeps": settings.substeps, "residual_share": settings.residual_share}
    return scene, EngineRun("hemline", take.vertices, ms, np.zeros(len(ms)), options), int(take.lead_in.sum())


def _scene(garment: Garment, name: str, start: np.ndarray, posed: list) -> EngineScene:
    material = garment.material
    elastic = Elastic(
        density=material.density,
        young=material.young,
        poisson=material.poisson,
        bending=material.bending,
        damping=material.damping,
        friction=material.friction,
    )
    scene = EngineScene(
        name,
        np.asarray(start, np.float64),
        garment.faces,
        garment.rest_edges,
        garment.vertices.astype(np.float64),
        elastic,
        np.array([garment.pins.on(body) for body in posed], np.float64),
        garment.pins.vertices,
        np.array([body.vertices for body in posed], np.float64),
        posed[0].faces,
        flat=garment.flat_rest,
    )
    return replace(scene, rest_vertices=find_unstrained_shape(scene)) if garment.flat_rest else scene


def find_unstrained_shape(scene: EngineScene) -> np.ndarray:
    """Returns a shape in space that approximates the rest metric, found by 200 steps without gravity."""
    sheet = replace(scene, flat=True, elastic=replace(scene.elastic, bending=1e-9)).sheet
    settings = sim.SimSettings(self_contact=False, gravity=(0.0, 0.0, 0.0), residual_share=0.002, solver_share=0.02)
    stepper = Stepper(sheet, settings=settings)
    state = stepper.start(scene.rest_vertices)
    empty = sim.StepScene(np.zeros((0, 3)))
    for _ in range(200):
        state, _ = stepper.advance(state, 1 / 30, lambda fraction: empty)
        state = replace(state, velocities=0.9 * state.velocities)
    return state.positions
