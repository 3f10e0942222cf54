"""Contact in the twin of the ropes: the kernels' own, with gradients along the surface."""

import numpy as np
import torch

from hemline.animators.ropes.mechanics.dynamics import RopeChains
from hemline.animators.ropes.mechanics.rope_force_kernels import FRICTION
from hemline.animators.ropes.mechanics.rope_step_kernels import POSITION, VELOCITY
from hemline.arrays import Float
from hemline.collide.primitives.proxy import Colliders

from .window_contact_kernels import resolve_windows

Tensor = torch.Tensor


class TorchContact:
    """What holds nodes out of the primitives in each substep.

    Positions and velocities after it are the kernels'. Where a node touches, its gradient across the way that it was
    pushed passes, and that along it does not: the surface holds it there.
    """

    def __init__(
        self,
        chains: RopeChains,
        colliders: Colliders,
        bodies: Float[np.ndarray, "windows frames ends joints 3 4"],
        real: Tensor,
    ):
        """Prepare.

        Args:
            chains: The chains.
            colliders: The primitives.
            bodies: Transforms of the joints where each frame begins and where each of its substeps ends.
            real: Which places of the table of nodes are nodes (chains, nodes).
        """
        first = int(chains.offsets[0])
        self.model = (
            chains.offsets - chains.offsets[0],
            chains.lengths[first:],
            chains.margins[first:],
            *colliders[:4],
            float(chains.constants.numbers()[FRICTION]),
            *(float(chains.constants.choices()[way]) for way in (POSITION, VELOCITY)),
        )
        self.bodies, self.real = bodies, real

    def __call__(
        self, x: Tensor, v: Tensor, starts: Tensor, frame: int, step: int, h: float
    ) -> tuple[Tensor, Tensor, Tensor]:
        """Positions and velocities (windows, chains, nodes, 3) after contact, and which chains touched.

        Args:
            x: Positions at the end of the substep [m].
            v: Velocities there [m/s].
            starts: Positions where it began [m].
            frame: Number of the frame.
            step: Number of the substep in it, from 1.
            h: Its length [s].
        """
        begun, places, speeds = (each.detach()[:, self.real].numpy().copy() for each in (starts, x, v))
        touched = np.zeros(places.shape[:2], np.bool_)
        hit = np.zeros((len(places), len(self.model[0]) - 1), np.bool_)
        bodies = (np.ascontiguousarray(self.bodies[:, frame, at]) for at in (step - 1, step))
        resolve_windows(*self.model, h, *bodies, begun, places, speeds, touched, hit)
        where = torch.as_tensor(touched)[..., None]
        return self._held(x, places, where), self._held(v, speeds, where), torch.as_tensor(hit)

    def _held(self, before: Tensor, after: np.ndarray, touched: Tensor) -> Tensor:
        """The values after contact, with the gradient of those before but for the part along the change."""
        given = before[:, self.real]
        change = given - given.detach()
        way = torch.as_tensor(after) - given.detach()
        way = way / way.norm(dim=-1, keepdim=True).clamp(min=1e-12)
        along = (change * way).sum(-1, keepdim=True) * way
        found = before.clone()
        found[:, self.real] = torch.as_tensor(after) + change - torch.where(touched, along, torch.zeros_like(along))
        return found
