"""The neural signed distance to a body for losses: for batches of frames, differentiable by the points."""

from functools import lru_cache

import torch
from torch import Tensor

from hemline.bodies import ShapedBody
from hemline.collide.neural_sdf.capsules import BoneCapsules
from hemline.collide.neural_sdf.inputs import TEMPERATURE
from hemline.collide.neural_sdf.neural_sdf import NeuralSdf, load_neural_sdf
from hemline.collide.neural_sdf.neural_sdf_kernels import LENGTH_SCALE, RADIUS_SCALE
from hemline.learning.fit.distance_network import DistanceNetwork


class BodyDistance:
    """The neural distance to one shape of a body in many poses.

    It is `NeuralSdf.at` for losses: the same features and layers in torch, for all frames at once.

    Args:
        shaped: The body.
        device: Device on which distances are computed.
        model: The network; None uses the one that ships.

    Raises:
        BadModel: The network was trained for another body.

    Source: Li et al., "SwinGar", 2023, Sections III-D and IV; `NeuralSdf` lists the differences.
    """

    def __init__(self, shaped: ShapedBody, device: torch.device, model: NeuralSdf | None = None):
        model = model or load_neural_sdf()
        model.check_body(shaped.body)
        self._network = _network_on(model, device)
        capsules = BoneCapsules.of(shaped)
        self._starts, self._axes, self._radii = (
            torch.from_numpy(each).to(device)
            for each in (capsules.starts, capsules.ends - capsules.starts, capsules.radii)
        )
        self._betas = torch.as_tensor(shaped.betas, dtype=torch.float32, device=device)

    def distances(self, points: Tensor, transforms: Tensor, axis_angles: Tensor) -> Tensor:
        """Returns the signed distances of points, negative inside (frames, points) [m].

        Args:
            points: Points (frames, points, 3) [m].
            transforms: Skinning transforms of the joints (frames, joints, 3, 4) [m].
            axis_angles: Local rotations of the joints (frames, joints, 3); that of the pelvis is not read.
        """
        frames, count = points.shape[:2]
        turned = rotation_matrices(axis_angles[:, 1:]) - torch.eye(3, device=points.device)
        conditions = torch.cat([self._betas.expand(frames, -1), turned[..., :2].flatten(1)], dim=1)
        codes = self._network.code(conditions).repeat_interleave(count, dim=0)
        return self._network.distances(self._features(points, transforms).flatten(0, 1), codes).view(frames, count)

    def _features(self, points: Tensor, transforms: Tensor) -> Tensor:
        """Returns the features that `inputs.PointInputs` documents (frames, points, features)."""
        back = transforms[..., :3].transpose(2, 3)
        shifts = -(back @ transforms[..., 3:])[..., 0] - self._starts
        local = torch.einsum("fjab,fpb->fpja", back, points) + shifts[:, None]
        if self._network.inputs == "point":
            return local[:, :, 0]
        fraction = (local * self._axes).sum(-1) / ((self._axes**2).sum(-1) + 1e-12)
        away = local - fraction.clamp(0, 1)[..., None] * self._axes
        heights = (away.square().sum(-1) + 1e-12).sqrt() - self._radii
        weights = (-heights / TEMPERATURE).softmax(-1)
        parts = (
            local[:, :, 0],
            float(LENGTH_SCALE) * (weights[..., None] * local).flatten(2),
            weights,
            -float(LENGTH_SCALE) * TEMPERATURE * (-heights / TEMPERATURE).logsumexp(-1, keepdim=True),
            float(RADIUS_SCALE) * (weights @ self._radii)[..., None],
        )
        return torch.cat(parts, dim=-1)


@lru_cache(maxsize=4)
def _network_on(model: NeuralSdf, device: torch.device) -> DistanceNetwork:
    """Returns the layers of a network on a device, to which they are copied once."""
    network = DistanceNetwork.of(model)
    layers = {name: (weight.to(device), bias.to(device)) for name, (weight, bias) in network.layers.items()}
    return DistanceNetwork(network.inputs, layers)


def rotation_matrices(axis_angles: Tensor) -> Tensor:
    """Returns the matrices (..., 3, 3) of axis-angles (..., 3) by Rodrigues' formula."""
    squares = axis_angles.square().sum(-1)[..., None, None]
    angles = squares.clamp(min=1e-12).sqrt()
    x, y, z = axis_angles.unbind(-1)
    zero = torch.zeros_like(x)
    cross = torch.stack([zero, -z, y, z, zero, -x, -y, x, zero], dim=-1).unflatten(-1, (3, 3))
    linear, quadratic = torch.sin(angles) / angles, (1 - torch.cos(angles)) / angles.square()
    return torch.eye(3, device=axis_angles.device) + linear * cross + quadratic * (cross @ cross)
