"""Fig. 3: a coarse net hung from five nodes, as masses and springs and as rope chains."""

from pathlib import Path

import numpy as np

from hemline.animators.ropes.mechanics.constants import RopeConstants
from hemline.animators.ropes.mechanics.dynamics import RopeChains
from papers.rope_chains.baselines.mass_spring import Springs
from papers.rope_chains.drawing.figure import FigureEntry, axes, save_sheet
from papers.rope_chains.drawing.moving import GRAVITY, QUIET, simulate_chains

COUNT, GAP, MASS, GATHERED = 5, 0.1, 0.02, 0.5
STIFFNESSES = (2000.0, 40.0, 8.0)
"""Stiffnesses of the springs [N/m]."""


def sheet() -> np.ndarray:
    """Returns the nodes (25, 3) of a plane sheet, row by row from the rim [m]."""
    rows, columns = np.meshgrid(np.arange(COUNT), np.arange(COUNT), indexing="ij")
    return np.stack([GAP * columns, -GAP * rows, 0.0 * rows], axis=-1).reshape(-1, 3)


def gathered_sheet() -> np.ndarray:
    """Returns the sheet with its rim gathered to half its width, and displaced slightly out of its plane [m]."""
    start = sheet() + 0.01 * np.random.default_rng(0).normal(size=(COUNT**2, 3))
    start[:COUNT] = sheet()[:COUNT] * [GATHERED, 1, 1] + [0.5 * (1 - GATHERED) * GAP * (COUNT - 1), 0, 0]
    return start


def links() -> np.ndarray:
    """Returns springs along columns, rows, and one diagonal of each cell (springs, 2)."""
    number = np.arange(COUNT**2).reshape(COUNT, COUNT)
    pairs = (number[:-1], number[1:]), (number[:, :-1], number[:, 1:]), (number[:-1, :-1], number[1:, 1:])
    return np.concatenate([np.stack([one.ravel(), two.ravel()], axis=1) for one, two in pairs])


def net(stiffness: float) -> np.ndarray:
    """Returns the net in its steady state [m]."""
    ends, x, dt = links(), gathered_sheet(), 0.05
    springs = Springs(ends, np.linalg.norm(np.diff(sheet()[ends], axis=1)[:, 0], axis=1), stiffness)
    free = np.arange(COUNT, COUNT**2)
    for _ in range(300):  # without memory of velocities
        aim = x.copy()
        aim[free] -= [0, GRAVITY * dt**2, 0]
        x = springs.step(x, aim, np.full(len(x), MASS), free, dt)
    return x


def ropes() -> np.ndarray:
    """Returns the nodes of chains with weak springs across, at rest [m]."""
    lines = gathered_sheet().reshape(COUNT, COUNT, 3).transpose(1, 0, 2)
    options = QUIET | {"drag": 3.0, "bend_damping": 20.0, "lateral": 5.0}
    flat = sheet().reshape(COUNT, COUNT, 3).transpose(1, 0, 2)
    chains = RopeChains.free(list(flat), RopeConstants(**options))
    path, _ = simulate_chains(chains, lines.reshape(-1, 3), 1 / 60, 900)
    return path[-1].reshape(COUNT, COUNT, 3).transpose(1, 0, 2).reshape(-1, 3)


def steady_states() -> dict[str, np.ndarray]:
    """Returns steady states by name."""
    return {f"springs of {k:g} N/m": net(k) for k in STIFFNESSES} | {"rope chains": ropes()}


def figures() -> dict[str, tuple[float, float]]:
    """Returns the length of the sheet relative to its cut, and the width of its hem relative to the rim [percent]."""
    found = {}
    for name, x in steady_states().items():
        long = -x[-COUNT:, 1].mean() / (GAP * (COUNT - 1))
        found[name] = (100 * long, 100 * float(np.ptp(x[-COUNT:, 0]) / np.ptp(x[:COUNT, 0])))
    return found


def draw(folder: Path) -> FigureEntry:
    """Draws the figure."""
    states = steady_states()
    page, (row,) = axes(1, len(states), width=2.3, height=2.8)
    for axis, (name, x) in zip(row, states.items(), strict=True):
        for a, b in links():
            axis.plot(*x[[a, b], :2].T, lw=0.8, color="green" if "rope" in name else "grey")
        axis.plot(*x[:COUNT, :2].T, "o", color="red")
        axis.set(title=name, xlim=(-0.15, 0.55), ylim=(-0.75, 0.08), aspect="equal")
    found = figures()
    lengths = [long for long, _ in found.values()]
    stated = "; ".join(
        f"{name}: {long:.0f} % long, hem {wide:.0f} % of the rim" for name, (long, wide) in found.items()
    )
    return FigureEntry(
        "3", "Locking and overstretching",
        "Mass-spring simulations lock with stiffer springs and overstretch with weaker ones; rope chains do neither.",
        stated + ".",
        "Holds." if lengths[2] > 115 and lengths[3] <= 100.1 and lengths[0] < 103 else "Holds only in part.",
        save_sheet(page, folder, "fig03.png"),
    )  # fmt: skip
