"""Scenes with a garment on the shipped body: settled in its rest pose, and on a moving body."""

import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.judging.engines import Played
from benchmarks.judging.scene import JudgedScene
from hemline import bodies, garments, motions, sim
from hemline.bodies import ShapedBody
from hemline.datasets.take import Take
from hemline.garments import Garment
from hemline.sim import Elastic, Stepper

SKIRT = Path(__file__).parents[3] / "shared/data/garments/garmentcode_mit/skirt_circle_mean_all.obj"
"""Beside the checkout, where the large data lie; without it the skirt is left out, aloud."""


def without_air(garment: Garment) -> Garment:
    """The garment in still air that does not resist, which Blender and Newton do not have in our form."""
    return replace(garment, material=replace(garment.material, drag=0.0, lift=0.0))


def cape() -> Garment:
    """The light cape."""
    return without_air(garments.load("cape-light"))


def skirt() -> Garment:
    """The circle skirt of GarmentCode on the shipped body."""
    return without_air(garments.open_garment(SKIRT, body()))


def body() -> ShapedBody:
    """The shipped body in its mean shape."""
    return bodies.load("anny24").shaped()


def resting(garment: Garment, frames: int) -> JudgedScene:
    """The garment as it starts, in the rest pose."""
    shaped = body()
    posed = shaped.posed(shaped.rest_pose)
    return _scene(garment, f"{garment.name} in the rest pose", garment.vertices, [posed]).still(frames)


def rest_by_hemline(garment: Garment, settings: sim.SimSettings) -> Take:
    """The settled drape, as every take starts from it."""
    return sim.rest_drape(garment, body(), settings)


def running(garment: Garment, rest: Take, settings: sim.SimSettings, frames: int) -> tuple[JudgedScene, Played, int]:
    """The shipped run by our simulator, whole: bodies skinned, cloth, projection; the same frames as a scene.

    Args:
        garment: The garment.
        rest: Its settled drape.
        settings: Settings.
        frames: Frames of the clip, after the lead-in.

    Returns:
        The scene, what we made of it, and the number of frames that lead in.
    """
    shaped = body()
    motion = shaped.untangled_motion(shaped.placed(motions.load("run").resampled(settings.fps)))[:frames]
    stamps = []
    take = sim.simulate(
        garment, shaped, motion, settings, start=rest, progress=lambda *_: stamps.append(time.perf_counter())
    )
    ms = 1000 * np.diff(stamps, prepend=stamps[0])
    posed = [shaped.posed(take.motion[i]) for i in range(len(take.motion))]
    scene = _scene(garment, f"{garment.name} on a run", take.vertices[0], posed)
    options = {"substeps": settings.substeps, "residual_share": settings.residual_share}
    return scene, Played("hemline", take.vertices, ms, np.zeros(len(ms)), options), int(take.lead_in.sum())


def _scene(garment: Garment, name: str, start: np.ndarray, posed: list) -> JudgedScene:
    material = garment.material
    elastic = Elastic(
        density=material.density,
        young=material.young,
        poisson=material.poisson,
        bending=material.bending,
        damping=material.damping,
        friction=material.friction,
    )
    scene = JudgedScene(
        name,
        np.asarray(start, np.float64),
        garment.faces,
        garment.rest_edges,
        garment.vertices.astype(np.float64),
        elastic,
        np.array([garment.pins.on(each) for each in posed], np.float64),
        garment.pins.vertices,
        np.array([each.vertices for each in posed], np.float64),
        posed[0].faces,
        flat=garment.flat_rest,
    )
    return replace(scene, rest_vertices=unstrained(scene)) if garment.flat_rest else scene


def unstrained(scene: JudgedScene) -> np.ndarray:
    """A shape in space with the cloth's rest metric, as near as 200 steps without weight come to it."""
    sheet = replace(scene, flat=True, elastic=replace(scene.elastic, bending=1e-9)).sheet
    settings = sim.SimSettings(self_contact=False, gravity=(0.0, 0.0, 0.0), residual_share=0.002, solver_share=0.02)
    stepper = Stepper(sheet, settings=settings)
    state = stepper.start(scene.rest_vertices)
    nothing = sim.Scene(np.zeros((0, 3)))
    for _ in range(200):
        state, _ = stepper.advance(state, 1 / 30, lambda share: nothing)
        state = replace(state, velocities=0.9 * state.velocities)
    return state.positions
