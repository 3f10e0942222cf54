"""Whether novelty tells errors: `python -m papers.agentdress.novelty ANCHORS...`.

ANCHORS are datasets that `hemline drape GARMENT --anchors` made. Each pose of a dataset is left out of the pose model
in turn: what is missed there, by how far it is from the nearest other one, in the unit of `Frame.novelty`.
"""

import argparse
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

STEPS = (0.0, 0.2, 0.4, 0.6, NOVELTY_LIMIT, np.inf)


def left_out(folder: Path) -> tuple[Float[np.ndarray, " poses"], Float[np.ndarray, " poses"]]:
    """Novelty of each pose when it is left out, and what is missed there, mean over the vertices [mm]."""
    dataset, config = open_dataset(folder), AgentDressConfig(mirror=False)
    anchors = AnchorSet.of(dataset, config)
    model = fit_anchors(dataset.garment, anchors, config, progress=lambda stage, done, total: None)
    rotations = model.tables.rotations.astype(np.float64)
    offsets = np.concatenate([anchors.offsets[:, 0], anchors.single_offsets]).reshape(len(rotations), -1)
    basis, outputs = principal_of_rows(offsets - offsets.mean(axis=0), config.pose_modes)
    apart = region_distances(axes_between(rotations, rotations), model.tables.axes.astype(np.float64))
    ridge = model.figures["kernel_ridge"]
    missed = fit_kernel(apart, outputs, anchors.groups, width=model.width, ridge=ridge).leave_one_out
    regions, rows = model.tables.regions, basis.reshape(len(basis), -1, 3)
    novelties, errors = [], []
    for pose in range(len(rotations)):
        others = np.delete(apart[pose], pose, axis=1)
        novelties.append(novelty(others, regions.mean(axis=0)))
        away = np.einsum("vk,kvi->vi", regions @ missed[:, pose], rows)
        errors.append(1e3 * float(np.linalg.norm(away, axis=1).mean()))
    return np.array(novelties), np.array(errors)


def main() -> None:
    """Print, for each dataset, errors by novelty."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("anchors", type=Path, nargs="+")
    for folder in parser.parse_args().anchors:
        novelties, errors = left_out(folder)
        related = np.corrcoef(novelties, errors)[0, 1]
        print(f"{folder.name}: {len(errors)} poses, {errors.mean():.1f} mm in the mean, correlation {related:.2f}")
        for low, high in pairwise(STEPS):
            here = errors[(novelties >= low) & (novelties < high)]
            told = f"{here.mean():5.1f} mm, worst {here.max():5.1f}" if len(here) else ""
            print(f"  novelty {low:.1f} to {high:.1f}: {len(here):4d} poses  {told}")


if __name__ == "__main__":
    main()
