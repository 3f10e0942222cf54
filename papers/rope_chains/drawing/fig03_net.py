"""Fig. 3: a coarse net hung from five nodes, as masses and springs and as rope chains."""

from pathlib import Path

import numpy as np

from hemline.animators.ropes.mechanics.constants import RopeConstants
from hemline.animators.ropes.mechanics.dynamics import RopeChains
from papers.rope_chains.baselines.mass_spring import Springs
from papers.rope_chains.drawing.figure import Drawn, axes, keep
from papers.rope_chains.drawing.moving import GRAVITY, QUIET, moved

COUNT, GAP, MASS, GATHERED = 5, 0.1, 0.02, 0.5
STIFFNESSES = (2000.0, 40.0, 8.0)
"""Of the springs [N/m]."""


def sheet() -> np.ndarray:
    """Nodes (25, 3) of a level sheet, row by row from the rim [m]."""
    rows, columns = np.meshgrid(np.arange(COUNT), np.arange(COUNT), indexing="ij")
    return np.stack([GAP * columns, -GAP * rows, 0.0 * rows], axis=-1).reshape(-1, 3)


def begun() -> np.ndarray:
    """The sheet with its rim gathered to half its width, and out of its plane a little [m]."""
    start = sheet() + 0.01 * np.random.default_rng(0).normal(size=(COUNT**2, 3))
    start[:COUNT] = sheet()[:COUNT] * [GATHERED, 1, 1] + [0.5 * (1 - GATHERED) * GAP * (COUNT - 1), 0, 0]
    return start


def links() -> np.ndarray:
    """Springs along columns, rows, and one diagonal of each cell (springs, 2)."""
    number = np.arange(COUNT**2).reshape(COUNT, COUNT)
    pairs = (number[:-1], number[1:]), (number[:, :-1], number[:, 1:]), (number[:-1, :-1], number[1:, 1:])
    return np.concatenate([np.stack([one.ravel(), two.ravel()], axis=1) for one, two in pairs])


def net(stiffness: float) -> np.ndarray:
    """The net in its steady state [m]."""
    ends, x, dt = links(), begun(), 0.05
    springs = Springs(ends, np.linalg.norm(np.diff(sheet()[ends], axis=1)[:, 0], axis=1), stiffness)
    free = np.arange(COUNT, COUNT**2)
    for _ in range(300):  # without memory of velocities
        aim = x.copy()
        aim[free] -= [0, GRAVITY * dt**2, 0]
        x = springs.stepped(x, aim, np.full(len(x), MASS), free, dt)
    return x


def ropes() -> np.ndarray:
    """The same nodes as chains, with weak springs across, come to rest [m]."""
    lines = begun().reshape(COUNT, COUNT, 3).transpose(1, 0, 2)
    options = QUIET | {"drag": 3.0, "bend_damping": 20.0, "lateral": 5.0}
    flat = sheet().reshape(COUNT, COUNT, 3).transpose(1, 0, 2)
    chains = RopeChains.free(list(flat), RopeConstants(**options))
    path, _ = moved(chains, lines.reshape(-1, 3), 1 / 60, 900)
    return path[-1].reshape(COUNT, COUNT, 3).transpose(1, 0, 2).reshape(-1, 3)


def drawn() -> dict[str, np.ndarray]:
    """Steady states by name."""
    return {f"springs of {k:g} N/m": net(k) for k in STIFFNESSES} | {"rope chains": ropes()}


def figures() -> dict[str, tuple[float, float]]:
    """Length of the sheet over its cut, and width of its hem over that of its rim [percent]."""
    found = {}
    for name, x in drawn().items():
        long = -x[-COUNT:, 1].mean() / (GAP * (COUNT - 1))
        found[name] = (100 * long, 100 * float(np.ptp(x[-COUNT:, 0]) / np.ptp(x[:COUNT, 0])))
    return found


def draw(folder: Path) -> Drawn:
    """Draw it."""
    states = drawn()
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
    return Drawn(
        "3", "Locking and overstretching",
        "Mass-spring simulations lock with stiffer springs and overstretch with weaker ones; rope chains do neither.",
        stated + ".",
        "Holds." if lengths[2] > 115 and lengths[3] <= 100.1 and lengths[0] < 103 else "Holds only in part.",
        keep(page, folder, "fig03.png"),
    )  # fmt: skip
