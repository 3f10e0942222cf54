"""Measures how long the network's error at the beginning persists: `python -m papers.swingar.lasting TAKES...`.

TAKES are datasets that `python -m hemline.models.make.swingar_takes` made of garments that the model was not fitted to.
Each take is played once, as a proxy alone. From the predictions of each frame follows what would have been shown if
another fraction of the error at the end of the simulation persisted for another time. Prints the mean distance of
vertices over the frames after the lead-in [mm], by class of garment.
"""

import argparse
from pathlib import Path

import numpy as np

import hemline
from hemline import bodies
from hemline.animators.coarse.displacement import SMOOTHING_SECONDS, TRANSIENT_SECONDS
from hemline.animators.coarse.model import CoarseAnimator
from hemline.datasets import Dataset, Row, open_dataset
from papers.swingar.unseen import LOOSE_MM, Rest

SHARES, SECONDS = (0.3, 0.5, 0.7, 1.0), (2.0, 8.0, 20.0)
VARIANTS = {"none lasts": (0.0, 1.0)} | {
    f"{share:g} of it, {each:g} s": (share, each) for share in SHARES for each in SECONDS
}


def predictions(animator: CoarseAnimator, data: Dataset, row: Row) -> tuple[np.ndarray, ...]:
    """Plays a take.

    Returns:
        Predicted and true displacements in each frame from the end of the simulation on, in the rotated frames of the
        vertices (frames, verts, 3) [m]; displacements at the end of the simulation; whether each frame counts; the time
        step [s].
    """
    shaped, take = bodies.load(data.garment.body_name).shaped(row.betas), data.take(row)
    dt, kept = 1 / take.motion.fps, animator.coarse[1]
    smooth = np.exp(-dt / SMOOTHING_SECONDS)
    state, before = animator.start(shaped.posed(take.motion[0])), None
    said, truth, counts, lay = [], [], [], np.zeros(0)
    for frame, vertices in enumerate(take.vertices):
        state, _ = animator.step(state, shaped.posed(take.motion[frame]), dt)
        now = state.displacement
        if now is None or now.transient is None or now.persistent is None:
            continue
        if before is None:
            lay = now.current
        shown = now.current if before is None else (now.current - smooth * before) / (1 - smooth)
        said.append(shown - now.transient - now.persistent)
        truth.append(state.trail.local_offsets(vertices[kept]))
        counts.append(not take.lead_in[frame])
        before = now.current
    return np.array(said), np.array(truth), lay, np.array(counts), np.array(dt)


def shown_mm(played: tuple[np.ndarray, ...], share: float, seconds: float) -> float:
    """Returns the mean distance of vertices if a fraction of the error persisted with a time constant [mm]."""
    said, truth, lay, counts, dt = played
    missed, now, errors = lay - said[0], lay, []
    for frame, (here, true) in enumerate(zip(said, truth, strict=True)):
        if frame:
            age = frame * dt
            aim = here + ((1 - share) * np.exp(-age / TRANSIENT_SECONDS) + share * np.exp(-age / seconds)) * missed
            now = aim + np.exp(-dt / SMOOTHING_SECONDS) * (now - aim)
        errors.append(np.linalg.norm(now - true, axis=1).mean())
    return 1e3 * float(np.mean(np.array(errors)[counts]))


def main() -> None:
    """Plays all takes and prints the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("takes", type=Path, nargs="+")
    parser.add_argument("--model", default="lag")
    parser.add_argument("--most", type=int, default=2, help="takes of each garment at most")
    asked = parser.parse_args()
    model, found = hemline.load(asked.model), {}
    for folder in asked.takes:
        data = open_dataset(folder)
        worn = model.animator_for(data.garment, bodies.load(data.garment.body_name).shaped())
        for row in data.clips()[: asked.most]:
            played = predictions(worn, data, row)
            shaped = bodies.load(data.garment.body_name).shaped(row.betas)
            gap = Rest(data.garment, shaped, data.rest(shaped.betas).vertices[0]).gap_mm
            kind = "loose" if gap > LOOSE_MM else "close-fitting"
            if played[3].any():
                found.setdefault(kind, []).append([shown_mm(played, *variant) for variant in VARIANTS.values()])
        print(data.garment.name, flush=True)
    for kind, rows in found.items():
        print(f"{kind}, {len(rows)} takes")
        for name, mean in zip(VARIANTS, np.mean(rows, axis=0), strict=True):
            print(f"  {name:<20}{mean:6.1f} mm")


if __name__ == "__main__":
    main()
