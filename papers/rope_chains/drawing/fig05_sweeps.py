"""Fig. 5: one swinging chain with few sweeps and many."""

from pathlib import Path

import numpy as np

from hemline.animators.ropes.mechanics.constants import RopeConstants
from hemline.animators.ropes.mechanics.dynamics import RopeChains
from papers.rope_chains.drawing.figure import FigureEntry, axes, save_sheet
from papers.rope_chains.drawing.moving import GRAVITY, QUIET, simulate_chains

NODES, ROPE, DT, SECONDS = 11, 0.1, 1 / 120, 6.0
SOLVERS = {"1 sweep": 1, "5 sweeps": 5, "10 sweeps": 10, "1000 sweeps (to 1e-6)": 1000, "solved directly": 0}


def simulate_chain(sweeps: int) -> tuple[np.ndarray, np.ndarray]:
    """Returns path (frames, nodes, 3) [m] and energy (frames,) of a released chain, relative to its initial energy."""
    start = ROPE * np.arange(NODES)[:, None] * np.array([[np.cos(0.6), -np.sin(0.6), 0.0]])
    constants = RopeConstants(**QUIET, tension_sweeps=sweeps, impulse_sweeps=sweeps)
    path, speeds = simulate_chains(RopeChains.free([start], constants), start, DT, round(SECONDS / DT))
    energy = (GRAVITY * path[:, 1:, 1] + 0.5 * (speeds[:, 1:] ** 2).sum(2)).sum(1)
    hung = -GRAVITY * ROPE * np.arange(1, NODES).sum()
    return path, (energy - hung) / (energy[0] - hung)


def figures() -> dict[str, float]:
    """Returns the energy left in the end by solver [percent of that at the start]."""
    return {name: 100 * float(simulate_chain(sweeps)[1][-30:].mean()) for name, sweeps in SOLVERS.items()}


def draw(folder: Path) -> FigureEntry:
    """Draws the figure."""
    sheet, (row,) = axes(1, len(SOLVERS) + 1, width=2.4, height=2.8)
    kept = {}
    for axis, (name, sweeps) in zip(row, SOLVERS.items(), strict=False):
        path, energy = simulate_chain(sweeps)
        kept[name] = 100 * float(energy[-30:].mean())
        for frame in path[: round(1.5 / DT) : 12]:
            axis.plot(frame[:, 0], frame[:, 1], lw=0.7, color="tab:green")
        axis.set(title=name, xlim=(-1.05, 1.05), ylim=(-1.1, 0.4), aspect="equal")
        row[-1].plot(DT * np.arange(len(energy)), energy, label=name)
    row[-1].set(title="energy left", xlabel="s")
    row[-1].legend(fontsize=6)
    order = list(kept.values())[:4]
    return FigureEntry(
        "5", "Sweeps of Gauss-Seidel",
        "With more iterations, the rope chain is less damped.",
        f"Energy left after {SECONDS:.0f} s: " + ", ".join(f"{name} {left:.0f} %" for name, left in kept.items()) + ".",
        "Holds." if order == sorted(order) else "Holds only in part: see the numbers.",
        save_sheet(sheet, folder, "fig05.png"),
    )  # fmt: skip
