"""Whether novelty predicts errors: `python -m papers.agentdress.novelty ANCHORS...`.

ANCHORS are datasets made by `hemline drape GARMENT --anchors`. Prints the leave-one-out error of the pose model by the
distance from the nearest other pose, in the unit of `Frame.novelty`.
"""

from itertools import pairwise
from pathlib import Path

import numpy as np

from hemline.animators.agentdress.bounds import NOVELTY_LIMIT, novelty
from hemline.animators.agentdress.config import AgentDressConfig
from hemline.animators.agentdress.distances import axes_between, region_distances
from hemline.animators.agentdress.fit.anchor_set import AnchorSet
from hemline.animators.agentdress.fit.fit import fit_anchors
from hemline.animators.agentdress.pose_model import fit_kernel
from hemline.arrays import Float
from hemline.datasets import open_dataset
from hemline.learning.pca import principal_of_rows
from papers.report import parse_options

STEPS = (0.0, 0.2, 0.4, 0.6, NOVELTY_LIMIT, np.inf)


def measure(folder: Path) -> tuple[Float[np.ndarray, " poses"], Float[np.ndarray, " poses"]]:
    """Returns the novelty and the mean error [mm] of each pose when it is left out of the fit."""
    dataset, config = open_dataset(folder), AgentDressConfig(mirror=False)
    anchors = AnchorSet.of(dataset, config)
    model = fit_anchors(dataset.garment, anchors, config, progress=lambda stage, done, total: None)
    rotations = model.tables.rotations.astype(np.float64)
    offsets = np.concatenate([anchors.offsets[:, 0], anchors.single_offsets]).reshape(len(rotations), -1)
    basis, outputs = principal_of_rows(offsets - offsets.mean(axis=0), config.pose_modes)
    distances = region_distances(axes_between(rotations, rotations), model.tables.axes.astype(np.float64))
    ridge = model.figures["kernel_ridge"]
    residuals = fit_kernel(distances, outputs, anchors.groups, width=model.width, ridge=ridge).leave_one_out
    regions, rows = model.tables.regions, basis.reshape(len(basis), -1, 3)
    novelties, errors = [], []
    for pose in range(len(rotations)):
        others = np.delete(distances[pose], pose, axis=1)
        novelties.append(novelty(others, regions.mean(axis=0)))
        differences = np.einsum("vk,kvi->vi", regions @ residuals[:, pose], rows)
        errors.append(1e3 * float(np.linalg.norm(differences, axis=1).mean()))
    return np.array(novelties), np.array(errors)


def main() -> None:
    """Prints errors by novelty, for each dataset."""
    for folder in parse_options(__doc__, "anchors...").anchors:
        novelties, errors = measure(folder)
        correlation = np.corrcoef(novelties, errors)[0, 1]
        print(f"{folder.name}: {len(errors)} poses, {errors.mean():.1f} mm on average, correlation {correlation:.2f}")
        for low, high in pairwise(STEPS):
            some = errors[(novelties >= low) & (novelties < high)]
            text = f"{some.mean():5.1f} mm, worst {some.max():5.1f}" if len(some) else ""
            print(f"  novelty {low:.1f} to {high:.1f}: {len(some):4d} poses  {text}")


if __name__ == "__main__":
    main()
