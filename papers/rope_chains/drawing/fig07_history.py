"""Fig. 7: six particles and a ball that comes at them."""

from pathlib import Path

import numpy as np

from hemline.animators.ropes.mechanics.constants import RopeConstants
from hemline.animators.ropes.mechanics.dynamics import RopeChains
from hemline.collide.primitives.body_primitives import BodyPrimitives
from hemline.collide.primitives.distances import round_cone_shape
from papers.rope_chains.drawing.figure import FigureEntry, axes, save_sheet
from papers.rope_chains.drawing.moving import QUIET, simulate_chains

RADIUS, DT, FRAMES, STOPS, SPEED = 0.2, 1 / 30, 20, 16, 3.0
HEIGHTS = np.array([-0.15, -0.09, -0.03, 0.03, 0.09, 0.15])
PUSHES = {
    "gradient, gradient": ("gradient", "gradient"),
    "history, gradient": ("history", "gradient"),
    "history, history": ("history", "history"),
}
"""Push-outs of positions and of velocities."""


def centre(t: float) -> float:
    """Returns the place of the ball along x, which stops shortly before the end [m]."""
    return SPEED * min(t, STOPS * DT)


def particle_paths(ways: tuple[str, str]) -> np.ndarray:
    """Returns the paths (frames, particles, 2) of six beads on ropes that are too long to act [m]."""
    beads = np.column_stack([np.full(6, RADIUS + 0.03), HEIGHTS, 0 * HEIGHTS])
    start = np.stack([beads + [0, 0, 5.0], beads], axis=1)
    options = QUIET | {"gravity": (0.0, 0.0, 0.0), "substep": 1.0, "margin": 0.0}
    chains = RopeChains.free(list(start), RopeConstants(**options, position_push=ways[0], velocity_push=ways[1]))
    chains = type(chains)(**(vars(chains) | {"lengths": np.full(12, 50.0)}))
    primitives = BodyPrimitives.from_primitives(
        [(0, round_cone_shape(np.zeros(3), np.zeros(3), RADIUS, RADIUS))], np.zeros((1, 3))
    )

    def frames(t):
        return np.concatenate([np.eye(3), [[centre(t)], [0], [0]]], axis=1)[None].copy()

    path, _ = simulate_chains(chains, start.reshape(-1, 3), DT, FRAMES, primitives=primitives, frames=frames)
    return path[:, 1::2, :2]


def figures() -> dict[str, float]:
    """Returns the mean angle of the particles from the ball's front when it stops [degrees]."""
    found = {}
    for name, ways in PUSHES.items():
        away = particle_paths(ways)[STOPS] - [centre(STOPS * DT), 0]
        found[name] = float(np.degrees(np.abs(np.arctan2(away[:, 1], away[:, 0]))).mean())
    return found


def draw(folder: Path) -> FigureEntry:
    """Draws the figure."""
    shown = np.linspace(0, FRAMES, 6).astype(int)
    sheet, rows = axes(len(PUSHES), 6, width=1.7, height=1.6)
    turn = np.linspace(0, 2 * np.pi, 60)
    for row, (name, ways), colour in zip(rows, PUSHES.items(), ("red", "purple", "green"), strict=True):
        path = particle_paths(ways)
        for axis, frame in zip(row, shown, strict=True):
            x = centre(frame * DT)
            axis.plot(x + RADIUS * np.cos(turn), RADIUS * np.sin(turn), color="grey")
            axis.plot(path[frame, :, 0], path[frame, :, 1], "o", ms=4, color=colour)
            axis.set(xlim=(x - 0.4, x + 0.6), ylim=(-0.5, 0.5), aspect="equal", xticks=[], yticks=[])
        row[0].set_ylabel(name, fontsize=7)
    found = figures()
    held = found["history, history"] < found["history, gradient"] <= found["gradient, gradient"] + 1e-9
    return FigureEntry(
        "7", "History against gradient",
        "Pushed out along the gradient, particles quickly work their way around the sphere; along their history they "
        "keep a persistent contact until it stops.",
        "Mean angle from the ball's front when it stops (at the start "
        f"{np.degrees(np.abs(np.arcsin(HEIGHTS / (RADIUS + 0.03)))).mean():.0f}): "
        + ", ".join(f"{name} {value:.0f} degrees" for name, value in found.items()) + ".",
        "Holds." if held else "Holds only in part: see the numbers.",
        save_sheet(sheet, folder, "fig07.png"),
    )  # fmt: skip
