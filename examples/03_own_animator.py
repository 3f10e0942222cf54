"""Defines an animator, fits it to simulated takes, saves and plays it; `docs/tutorials/animator.md` explains it.

It moves the garment with a joint of the body and lets each vertex lag behind on a damped spring. The fit selects the
spring with the smallest error. Run it: `python examples/03_own_animator.py`.
"""

import tempfile
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

import numpy as np

import hemline
from hemline import bodies, datasets, garments, motions, sim
from hemline.animators.model_file import garment_of, save_model
from hemline.errors import BadModel
from hemline.files.contents import array_of, entry
from hemline.motions import JOINT_NAMES
from hemline.options import check_options, options_of, positive


@dataclass(frozen=True)
class LaggingConfig:
    damping: float = positive(0.4)
    """Damping of the springs, as a fraction of critical damping."""

    def __post_init__(self):
        check_options(self)


@dataclass(frozen=True)
class LaggingState:
    vertices: np.ndarray  # (verts, 3) [m]
    velocities: np.ndarray  # [m/s]


@dataclass(frozen=True, eq=False)
class AnimatorLagging:
    garment: object
    body_name: str
    body_hash: str
    rest: np.ndarray  # the settled drape (verts, 3) [m]
    stiffness: np.ndarray  # spring stiffness of each vertex for unit mass (verts,) [1/s^2]
    config: LaggingConfig = LaggingConfig()
    figures: dict = field(default_factory=dict)
    name, Config = "lagging", LaggingConfig

    def rigid(self, posed):
        """Returns the drape as it follows the key joint rigidly."""
        key = posed.transforms[JOINT_NAMES.index(self.garment.key_joint)]
        return (self.rest @ key[:, :3].T + key[:, 3]).astype(np.float32)

    def start(self, posed):
        place = self.rigid(posed)
        return LaggingState(place, np.zeros_like(place))

    def step(self, state, posed, dt):
        k = self.stiffness[:, None]
        pull = k * (self.rigid(posed) - state.vertices) - 2 * self.config.damping * np.sqrt(k) * state.velocities
        velocities = state.velocities + pull * dt / (1 + k * dt * dt)  # implicit in the spring, so any dt is stable
        vertices = (state.vertices + dt * velocities).astype(np.float32)
        return LaggingState(vertices, velocities.astype(np.float32)), vertices

    @classmethod
    def fit(cls, data, config=None, *, seed=0, progress=None, checkpoints=None):
        garment, config = data.garment, config or LaggingConfig()
        body = bodies.load(garment.body_name)
        rest = data.rest(garment.body_betas).vertices[0]
        pins = rest[garment.pins.vertices]
        to_pin = np.linalg.norm(rest[:, None] - pins, axis=2).min(axis=1)  # distance to the nearest pin [m]
        takes = [data.take(row) for row in data.rows() if row.kind == "clip"]
        candidates = {}
        for hertz in (0.5, 1.0, 2.0, 4.0):  # frequency of a vertex half a metre below the pins
            stiffness = np.float32((2 * np.pi * hertz) ** 2 * 0.5 / np.maximum(to_pin, 0.01))
            candidates[hertz] = cls(garment, garment.body_name, body.hash, rest, stiffness, config)
        errors = {
            hertz: np.mean([error_mm(model, body, take) for take in takes]) for hertz, model in candidates.items()
        }
        best = min(errors, key=errors.get)
        return replace(candidates[best], figures={"hertz": best, "error_mm": float(errors[best])})

    @classmethod
    def of(cls, arrays, metadata):  # damaged files are refused here
        garment, body = garment_of(arrays, metadata), entry(metadata, "body", dict)
        count = len(garment.vertices)
        return cls(
            garment,
            entry(body, "name", str),
            entry(body, "hash", str),
            array_of(arrays, "rest", "float32", (count, 3)),
            array_of(arrays, "stiffness", "float32", (count,)),
            options_of(LaggingConfig, entry(metadata, "config", dict), error=BadModel),
            entry(metadata, "figures", dict),
        )

    def save(self, path):
        save_model(
            path,
            self.name,
            {"rest": self.rest, "stiffness": self.stiffness},
            garment=self.garment,
            body={"name": self.body_name, "hash": self.body_hash},
            config=asdict(self.config),
            figures=self.figures,
            licences=[],
            extra={},
        )


def error_mm(animator, body, take):
    """Returns the mean distance from a simulated take, without the player's projection [mm]."""
    shaped, dt = body.shaped(take.betas), 1 / take.motion.fps
    state, distances = animator.start(shaped.posed(take.motion[0])), []
    for number, truth in enumerate(take.vertices):
        state, vertices = animator.step(state, shaped.posed(take.motion[number]), dt)
        distances.append(np.linalg.norm(vertices - truth, axis=1).mean())
    return 1000 * float(np.mean(distances))


if __name__ == "__main__":
    body = bodies.load("anny24").shaped()
    cape = garments.make_cape(body, rows=12, columns=24, name="small cape")
    settings = sim.SimSettings()
    run = motions.load("run").resample(settings.fps)[:24]
    with tempfile.TemporaryDirectory() as folder:
        takes = datasets.create(Path(folder) / "takes", cape)
        takes.add(sim.rest_drape(cape, body, settings))
        takes.add(sim.simulate(cape, body, body.placed(run), settings))
        model = AnimatorLagging.fit(takes)
        model.save(Path(folder) / "lagging.safetensors")
    print(f"{model.figures['hertz']} Hz, {model.figures['error_mm']:.1f} mm from the simulation")
    frames = list(hemline.play(model, body, run, fps=30))
    print(
        f"{len(frames)} frames; {sum(frame.report.moved for frame in frames)} vertices have been moved out of the body"
    )
