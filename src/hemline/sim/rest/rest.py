"""A garment at rest on a body, and what is known about it."""

from dataclasses import asdict, dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Bool, Float, Int

from hemline.arrays import Vertices
from hemline.datasets.take import Take
from hemline.garments.garment import Garment
from hemline.motions.motion import Motion, Pose
from hemline.sim.cloth.sheet import Positions
from hemline.sim.contact.body.friction_anchors import FrictionAnchors
from hemline.sim.settings import SIMULATOR, SimSettings

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody


@dataclass(frozen=True, eq=False)
class Rest:
    """A garment that hangs still on a posed body; what `settle` returns and what the next one may start from.

    Attributes:
        garment: The garment.
        shaped: The body at its shape.
        pose: Its pose.
        settings: Settings of the simulator.
        positions: Of the cloth [m].
        forces: Resultant force that is left on each vertex, 0 at pins [N].
        load: Force with which the body presses on each vertex [N].
        face: Triangle of the body that each vertex is held off from, -1 for none.
        held: Triangle that each vertex in a crease of the body keeps to, -1 for the others.
        friction_anchors: Where static friction holds each vertex.
        pinched: Vertices that have no free place, as the body cuts through itself there; their contact yields.
        residual_share: Mean size of `forces` over the mean weight of a vertex.
        worst_share: The largest of `forces` over the mean weight of a vertex.
        method: How it was found: `newton`, `newton after dynamics`, `dynamics` (for takes, not balanced) or `draping`.
        newton_steps: Newton steps of the search, all stations of a continuation together.
        solver_steps: Steps of conjugate gradients in all of them.
        figures: Edge strains as a take has them, `inside` (vertices inside the body that are not pinched), `deepest_mm`
            (how deep the deepest of all is) and `pinched`, counted.
    """

    garment: Garment
    shaped: "ShapedBody"
    pose: Pose
    settings: SimSettings
    positions: Positions
    forces: Positions
    load: Float[np.ndarray, " verts"]
    face: Int[np.ndarray, " verts"]
    held: Int[np.ndarray, " verts"]
    friction_anchors: FrictionAnchors
    pinched: Bool[np.ndarray, " verts"]
    residual_share: float
    worst_share: float
    method: str
    newton_steps: int
    solver_steps: int
    figures: dict[str, float]

    @cached_property
    def vertices(self) -> Vertices:
        """Positions as everything after the simulator takes them, float32 [m]."""
        return self.positions.astype(np.float32)

    def take(self) -> Take:
        """One frame of kind `rest`, as `simulate` starts from and datasets store."""
        pose, rest = self.pose, self.shaped.rest_pose
        motion = Motion(
            pose.rotations[None],
            pose.translation[None],
            fps=self.settings.fps,
            leg_length=self.shaped.leg_length,
            name="rest",
        )
        inputs = {
            "garment": self.garment.hash,
            "body": self.shaped.body.hash,
            "betas": [float(beta) for beta in self.shaped.betas],
            "settings": asdict(self.settings),
            "simulator": SIMULATOR,
            "clip": "",
            "part": 0,
        }
        if pose.hash != rest.hash:
            inputs["pose"] = pose.hash
        return Take(
            kind="rest",
            vertices=self.vertices[None],
            motion=motion,
            betas=self.shaped.betas,
            lead_in=np.zeros(1, bool),
            pinched=np.array([self.pinched.sum()], np.int32),
            figures=self.figures | {"residual_share": self.residual_share},
            inputs=inputs,
        )
