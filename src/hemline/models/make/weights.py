"""Rounds the kernel weights of models of AgentDress: `python -m hemline.models.make.weights FILE...`.

A fit does this itself since version 6 of these files. Models fitted before have weights of 16 and 32 bits; this writes
them again in 8 and 16, from the kernel matrices of their own poses and bodies.
"""

import argparse
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from hemline.animators import load
from hemline.animators.agentdress.distances import axes_between, region_distances
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.animators.agentdress.pose_model import invert_definite, kernel
from hemline.animators.agentdress.shape_samples import ShapeSamples, kernel_over_shapes
from hemline.errors import BadModel
from hemline.learning.compensated_rounding import round_to_digits, round_to_half


def with_rounded_weights(model: AnimatorAgentDress) -> AnimatorAgentDress:
    """Returns a model with kernels for poses and shapes whose weights are rounded as a fit rounds them."""
    tables, figures = model.tables, model.figures
    distances = region_distances(axes_between(tables.rotations, tables.rotations), tables.axes).astype(np.float64)
    identity = np.eye(len(distances))
    inverses = (
        invert_definite(kernel(distances[:, region], model.width) + figures["kernel_ridge"] * identity)
        for region in range(distances.shape[1])
    )
    poses = np.stack([round_to_half(each, of) for each, of in zip(tables.pose_weights, inverses, strict=True)])
    shapes = _rounded(tables.shapes, distances, model.shape_width, figures["shape_kernel_ridge"])
    return replace(model, tables=replace(tables, pose_weights=poses, shapes=shapes))


def _rounded(samples: ShapeSamples, distances: np.ndarray, width: float, ridge: float) -> ShapeSamples:
    """Returns samples with weights of 8 bits."""
    coordinates = samples.betas @ samples.scale
    between = kernel_over_shapes(coordinates, coordinates, samples.length_scale)
    packed, poses = [], samples.poses
    for region, each in enumerate(samples.weights):
        gram = kernel(distances[:, region], width)[np.ix_(poses, poses)] * between
        packed.append(round_to_digits(each, invert_definite(gram + ridge * np.eye(len(poses)))))
    return replace(
        samples,
        weights=np.stack([each.weights for each in packed]),
        sizes=np.stack([each.sizes for each in packed]),
        steps=np.stack([each.steps for each in packed]),
    )


def main(path: Path) -> None:
    """Rounds the weights of a model file, writes it again, and prints its size before and after."""
    model, before = load(path), path.stat().st_size
    if not isinstance(model, AnimatorAgentDress) or not model.config.by_kernels or model.materials is not None:
        raise BadModel("weights are rounded of AgentDress with two kernels and no materials", path, "fit it again")
    with_rounded_weights(model).save(path)
    sys.stdout.write(f"{path}: {before / 1e6:.2f} MB, now {path.stat().st_size / 1e6:.2f} MB\n")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", type=Path, nargs="+")
    for path in parser.parse_args().files:
        main(path)
