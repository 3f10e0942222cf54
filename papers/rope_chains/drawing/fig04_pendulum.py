"""Fig. 4: one rope against the exact pendulum."""

from pathlib import Path

import numpy as np
from scipy.special import ellipj, ellipk

from hemline.animators.ropes.mechanics.constants import RopeConstants
from hemline.animators.ropes.mechanics.dynamics import RopeChains
from papers.rope_chains.drawing.figure import FigureEntry, axes, save_sheet
from papers.rope_chains.drawing.moving import GRAVITY, QUIET, simulate_chains

ANGLE, LENGTH, DT, SECONDS = np.radians(60), 1.0, 1 / 60, 60.0


def exact(times: np.ndarray) -> np.ndarray:
    """Returns the angle of a pendulum released at `ANGLE`, by Jacobi's elliptic functions [rad]."""
    k = np.sin(ANGLE / 2)
    return 2 * np.arcsin(k * ellipj(ellipk(k * k) - np.sqrt(GRAVITY / LENGTH) * times, k * k)[0])


def simulate_pendulum() -> tuple[np.ndarray, np.ndarray]:
    """Returns times [s] and angles [rad] of the rope."""
    start = LENGTH * np.array([[0, 0, 0], [np.sin(ANGLE), -np.cos(ANGLE), 0]])
    path, _ = simulate_chains(RopeChains.free([start], RopeConstants(**QUIET)), start, DT, round(SECONDS / DT))
    return DT * np.arange(len(path)), np.arctan2(path[:, 1, 0], -path[:, 1, 1])


def figures() -> dict[str, float]:
    """Returns the errors of period and amplitude [percent]."""
    times, angles = simulate_pendulum()
    down = np.flatnonzero((angles[:-1] > 0) & (angles[1:] <= 0))
    crossings = times[down] + DT * angles[down] / (angles[down] - angles[down + 1])
    period = 4 * np.sqrt(LENGTH / GRAVITY) * ellipk(np.sin(ANGLE / 2) ** 2)
    last = np.abs(angles[-round(1.05 * period / DT) :]).max()
    return {
        "period": 100 * float(np.diff(crossings).mean() / period - 1),
        "amplitude": 100 * float(last / ANGLE - 1),
    }


def draw(folder: Path) -> FigureEntry:
    """Draws the figure."""
    times, angles = simulate_pendulum()
    sheet, (row,) = axes(1, 2, width=4.6)
    for axis, (first, last) in zip(row, ((0, 4), (SECONDS - 4, SECONDS)), strict=True):
        shown = (times >= first) & (times <= last)
        axis.plot(times[shown], np.degrees(exact(times[shown])), label="exact")
        axis.plot(times[shown], np.degrees(angles[shown]), "--", label="rope, dt 1/60 s")
        axis.set(xlabel="s", ylabel="degrees")
    row[0].legend()
    found = figures()
    return FigureEntry(
        "4", "A pendulum",
        "The results compare well to the analytic solution for shorter and for longer times.",
        f"From 60 degrees, rope of 1 m, dt 1/60 s: period {found['period']:+.3f} %, amplitude after a minute "
        f"{found['amplitude']:+.3f} %.",
        "Holds." if abs(found["period"]) < 0.5 and abs(found["amplitude"]) < 1 else "Does not hold.",
        save_sheet(sheet, folder, "fig04.png"),
    )  # fmt: skip
