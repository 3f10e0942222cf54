"""Figs. 15 and 16: ropes, skinning network, shape network and simulation, frame by frame."""

from dataclasses import replace
from pathlib import Path

import numpy as np

import hemline
from hemline import pictures
from hemline.learning.key_frame import to_key_frame
from papers.rope_chains.drawing.figure import FigureEntry
from papers.rope_chains.hem import BANDS, power_by_band

FRAMES, SIZE, ROPE, PAIR = 6, (330, 400), 0.006, 0.003
"""Number of frames, size of each picture [pixels], radii of the tubes of ropes and lateral springs [m]."""
CLIPS = {"cape": "run", "skirt": "dance"}
ALIKE = 1.5
"""Largest factor between the powers of ropes and simulation in a band that counts as equally good dynamics."""


def tubes(points: np.ndarray, ends: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Returns thin three-sided tubes from node to node: vertices [m] and faces."""
    a, b = points[ends[:, 0]], points[ends[:, 1]]
    axis = (b - a) / np.maximum(np.linalg.norm(b - a, axis=1, keepdims=True), 1e-9)
    side = np.cross(axis, np.where(np.abs(axis[:, :1]) < 0.9, [[1.0, 0, 0]], [[0, 1.0, 0]]))
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    up = np.cross(axis, side)
    turns = [radius * (np.cos(t) * side + np.sin(t) * up) for t in np.arange(3) * 2 * np.pi / 3]
    corners = np.stack([end + turn for end in (a, b) for turn in turns], axis=1)
    sides = [(k, (k + 1) % 3, 3 + k) for k in range(3)] + [((k + 1) % 3, 3 + (k + 1) % 3, 3 + k) for k in range(3)]
    faces = np.array(sides)[None] + 6 * np.arange(len(ends))[:, None, None]
    return corners.reshape(-1, 3).astype(np.float32), faces.reshape(-1, 3).astype(np.int32)


def draw(folder: Path, model, truth) -> FigureEntry:
    """Draws the figure."""
    named = {row.clip: row for row in truth.clips()}
    row = named.get(CLIPS.get(model.garment.name, ""), truth.clips()[0])
    take, ropes = truth.take(row), model.ropes
    body = hemline.bodies.load(model.body_name).shaped(model.garment.body_betas)
    chosen = take.clip_frames[np.linspace(0, len(take.clip_frames) - 1, FRAMES).astype(int)]
    inner = np.flatnonzero(ropes.parents >= 0)
    ends = np.stack([ropes.parents[inner], inner], axis=1)
    state = model.start(body.posed(take.motion[0]))
    pictured, errors, tips = [], [], ([], [])
    last = np.setdiff1d(inner, ropes.parents)
    for frame in range(len(take.motion)):
        posed = body.posed(take.motion[frame])
        after, moved = model.source.step(state.bones, posed, 1 / take.motion.fps, state.rest_bones)
        state = replace(state, bones=after)
        if frame < take.clip_frames[0]:
            continue
        key, positions = posed.transforms[model.key], state.bones.ropes.positions
        first, second = model.skinning(moved), model.shape(moved)
        skinned, both = (
            model.basis.vertices(np.concatenate([first, each]), state.rest, key) for each in (0 * second, second)
        )
        seen = take.vertices[frame]
        for shown, bones in zip(tips, (positions, ropes.positions_on(seen)), strict=True):
            shown.append(to_key_frame(key, bones[last]))
        bones = np.linalg.norm(positions[inner] - ropes.positions_on(seen)[inner], axis=1).mean()
        errors.append([bones, *(np.linalg.norm(each - seen, axis=1).mean() for each in (skinned, both))])
        if frame not in chosen:
            continue
        under = (posed.vertices, posed.faces, "body")
        meshes = [
            [(*tubes(positions, ends, ROPE), "truth"), (*tubes(positions, ropes.chains.pairs, PAIR), "cloth")],
            [(skinned, model.garment.faces, "cloth")],
            [(both, model.garment.faces, "cloth")],
            [(seen, model.garment.faces, "truth")],
        ]
        views = [pictures.picture_of([under, *each], "back_three_quarter", size=SIZE) for each in meshes]
        pictured.append(np.concatenate(views))
    pictures.write_png(folder / "fig15.png", pictures.side_by_side(pictured))
    bones, first, second = 1e3 * np.mean(errors, axis=0)
    powers = [power_by_band(np.stack(each) - np.mean(each, axis=0), take.motion.fps) for each in tips]
    ratios = [ours / max(theirs, 1e-12) for ours, theirs in zip(*powers, strict=True)]
    bands = ", ".join(f"{low:g} to {high:g} Hz {each:.2f}" for (low, high), each in zip(BANDS, ratios, strict=True))
    alike = all(1 / ALIKE <= each <= ALIKE for each in ratios)
    return FigureEntry(
        "16" if model.garment.name.startswith("skirt") else "15",
        "Ropes, skinning, shape, simulation",
        "Simulation and rope chains both produce good dynamics.",
        f"Clip {row.clip}, ropes on their own: bones off by {bones:.0f} mm, skinning network by {first:.0f} mm, with "
        f"the shape network {second:.0f} mm. Power of the motion of the lowest bones of the ropes, relative to the "
        f"simulation: {bands}. Rows from the top: ropes (blue) with lateral springs (red), skinning, "
        "shape, simulation; before the whole-cloth step and the projection.",
        f"Holds: each is within a factor of {ALIKE:g}." if alike else f"Does not hold: not each is within {ALIKE:g}.",
        "fig15.png",
    )  # fmt: skip
