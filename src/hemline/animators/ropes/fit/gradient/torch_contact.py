"""Contact in the torch reference of the step: the kernels' own, with gradients along the surface."""

import numpy as np
import torch

from hemline.animators.ropes.mechanics.dynamics import RopeChains
from hemline.animators.ropes.mechanics.kernel_inputs import BodyMotion, NodeArrays
from hemline.arrays import Float
from hemline.collide.primitives.body_primitives import Colliders

from .window_contact_kernels import resolve_windows

Tensor = torch.Tensor


class TorchContact:
    """Pushes nodes out of the primitives in each substep.

    Positions and velocities are those of the kernels. Where a node touches, the part of its gradient along the push is
    removed, since the surface holds the node there; the part across the push is kept.
    """

    def __init__(
        self,
        chains: RopeChains,
        colliders: Colliders,
        bodies: Float[np.ndarray, "windows frames ends joints 3 4"],
        real: Tensor,
    ):
        """Prepares the arrays of the kernel.

        Args:
            chains: The chains.
            colliders: The primitives.
            bodies: Transforms of the joints where each frame begins and where each of its substeps ends.
            real: Which places of the table of nodes are nodes (chains, nodes).
        """
        first = int(chains.offsets[0])
        self.chains = chains.kernel_chains._replace(
            offsets=chains.offsets - chains.offsets[0], lengths=chains.lengths[first:], margins=chains.margins[first:]
        )
        self.colliders, self.settings = colliders, chains.constants.contact_settings()
        self.bodies, self.real = bodies, real

    def __call__(
        self, x: Tensor, v: Tensor, starts: Tensor, frame: int, step: int, h: float
    ) -> tuple[Tensor, Tensor, Tensor]:
        """Returns positions and velocities (windows, chains, nodes, 3) after contact, and which chains touched.

        Args:
            x: Positions at the end of the substep [m].
            v: Velocities there [m/s].
            starts: Positions at the beginning of the substep [m].
            frame: Number of the frame.
            step: Number of the substep in it, from 1.
            h: Length of the substep [s].
        """
        before_substep, positions, velocities = (each.detach()[:, self.real].numpy().copy() for each in (starts, x, v))
        touched = np.zeros(positions.shape[:2], np.bool_)
        hit = np.zeros((len(positions), len(self.chains.offsets) - 1), np.bool_)
        before, after = (np.ascontiguousarray(self.bodies[:, frame, at]) for at in (step - 1, step))
        nodes = NodeArrays(positions, velocities, np.zeros(touched.shape), touched)
        resolve_windows(
            self.chains, self.colliders, self.settings, BodyMotion(before, after, h), before_substep, nodes, hit
        )
        mask = torch.as_tensor(touched)[..., None]
        return self._replace(x, positions, mask), self._replace(v, velocities, mask), torch.as_tensor(hit)

    def _replace(self, before: Tensor, after: np.ndarray, touched: Tensor) -> Tensor:
        """Returns the values after contact, with the gradient of those before less its part along the change."""
        given = before[:, self.real]
        change = given - given.detach()
        direction = torch.as_tensor(after) - given.detach()
        direction = direction / direction.norm(dim=-1, keepdim=True).clamp(min=1e-12)
        along = (change * direction).sum(-1, keepdim=True) * direction
        replaced = before.clone()
        replaced[:, self.real] = torch.as_tensor(after) + change - torch.where(touched, along, torch.zeros_like(along))
        return replaced
