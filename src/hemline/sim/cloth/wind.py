"""Velocity of the wind over time and place: constant, in gusts, or a user's function. Its force is in `air_kernels`."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hemline.errors import BadInput
from hemline.motions.quaternions import to_matrix
from hemline.sim.settings import SimSettings

from .sheet import Positions
from .wind_kernels import plane_waves

Wind = Callable[[float, Positions], Positions]
"""Function from time [s] and positions [m] to the velocity of the wind at every vertex [m/s]."""

WAVE_FRAMES = 6
"""Number of rotated coordinate frames. Each axis carries two plane waves, so that gusts are equally strong in all
directions.
"""


@dataclass(frozen=True)
class Gusts:
    r"""Wind that changes smoothly in time and place; the same seed gives the same wind.

    The wind is a sum of random transverse plane waves (so that the air is not compressed), carried along by the mean
    wind:

    $$u(t, x) = U + \sum_w a_w \cos(k_w \cdot (x - U t) + \omega_w t + \varphi_w), \quad a_w \perp k_w$$

    Each component of $k_w$ is normal with deviation 1 / length, and $\omega_w$ is normal with deviation 1 / time. Each
    component of u has the standard deviation `strength`, exactly on average over all of time and space. Over seeds, the
    correlation of two places that move with the mean wind, on average over the three components, is
    $\exp(-r^2 / 2 L^2 - t^2 / 2 T^2)$.

    Source: Shinozuka, Deodatis, "Simulation of stochastic processes by spectral representation", 1991.
    Differs: a Gaussian spectrum with one length and one time, not that of the atmosphere, whose
    large eddies are no different from another mean wind for a garment.

    Example:
        >>> gusts = Gusts(mean=(2.0, 0.0, 0.0), strength=0.5, seed=1)
        >>> gusts(0.0, np.zeros((1, 3))).shape
        (1, 3)
    """

    mean: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Mean wind [m/s]."""
    strength: float = 1.0
    """Standard deviation of each component [m/s]."""
    length: float = 2.0
    """Distance over which gusts change [m]."""
    seconds: float = 1.0
    """Time in which gusts change, in air that moves with the mean wind [s]."""
    seed: int = 0
    """Seed of the random waves."""

    @cached_property
    def _waves(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        random = np.random.default_rng(self.seed)
        rotations = random.normal(size=(WAVE_FRAMES, 4))
        axes = to_matrix(rotations / np.linalg.norm(rotations, axis=1, keepdims=True)).reshape(-1, 3)
        number = np.linalg.norm(random.normal(size=(3 * WAVE_FRAMES, 3)), axis=1)
        frames = axes.reshape(WAVE_FRAMES, 3, 3)
        # the two other axes of the frame are across
        across = np.concatenate([np.roll(frames, shift, axis=1).reshape(-1, 3) for shift in (1, 2)])
        wave = np.tile(number[:, None] * axes, (2, 1))
        turn, phase = random.normal(size=len(wave)), random.uniform(0, 2 * np.pi, len(wave))
        return wave / self.length, turn / self.seconds, phase, self.strength / np.sqrt(WAVE_FRAMES) * across

    def __call__(self, seconds: float, positions: Positions) -> Positions:
        """Returns the velocity of the air at positions [m/s].

        Args:
            seconds: Time [s].
            positions: Positions [m].
        """
        wave, turn, phase, amplitude = self._waves
        mean = np.array(self.mean, np.float64)
        now = (phase + seconds * (turn - wave @ mean)) / (2 * np.pi)
        velocity = np.empty(positions.shape)
        plane_waves(
            positions,
            np.ascontiguousarray(wave.T) / (2 * np.pi),
            now,
            np.ascontiguousarray(amplitude.T),
            mean,
            velocity,
        )
        return velocity


def wind_of(settings: SimSettings) -> Wind:
    """Returns the wind that the settings describe."""
    if settings.gusts > 0:
        return Gusts(settings.wind, settings.gusts, settings.gust_length, settings.gust_seconds, settings.gust_seed)
    return lambda seconds, positions: np.tile(np.array(settings.wind, np.float64), (len(positions), 1))


def with_checks(wind: Wind) -> Wind:
    """Returns a user's wind with checks of its results.

    The function gets positions that it cannot change.

    Raises:
        BadInput: When called: the wind is not one finite velocity per vertex.
    """

    def velocity_at(seconds: float, positions: Positions) -> Positions:
        view = positions.view()
        view.flags.writeable = False
        answer = wind(seconds, view)
        try:
            velocity = np.array(answer, np.float64, order="C")
        except (TypeError, ValueError) as error:
            got = f"{type(answer).__name__} at {seconds:.4g} s"
            raise BadInput("wind must give velocities", got, "return an array of numbers") from error
        if velocity.shape != positions.shape:
            what = f"wind must give {len(positions)} velocities"
            raise BadInput(what, f"shape {velocity.shape} at {seconds:.4g} s", "return one a position, (verts, 3)")
        bad = np.flatnonzero(~np.isfinite(velocity).all(axis=1))
        if len(bad):
            got = f"NaN or infinity at {seconds:.4g} s for {len(bad)} of {len(velocity)} vertices, the first {bad[0]}"
            raise BadInput("wind must be finite", got, "check the function that was given as wind")
        return velocity

    return velocity_at
