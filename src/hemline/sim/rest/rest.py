"""A garment at rest on a body, with its forces, contact and figures."""

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
    """A garment that hangs still on a posed body: the result of `settle`, which another call may start from.

    Attributes:
        garment: The garment.
        shaped: The body in its shape.
        pose: The pose of the body.
        settings: Settings of the simulator.
        positions: Positions of the cloth [m].
        forces: Remaining resultant force on each vertex, 0 at pins [N].
        load: Force with which the body presses on each vertex [N].
        face: Triangle of the body that holds each vertex off, -1 for none.
        crease_face: Triangle that each vertex in a crease of the body stays with, -1 for vertices outside creases.
        friction_anchors: Points that static friction pulls each vertex back to.
        pinched: Vertices without a free place, because the body intersects itself there; their contact yields.
        residual_share: Mean size of `forces` over the mean weight of a vertex.
        worst_share: Largest of `forces` over the mean weight of a vertex.
        method: Method that led here: `newton`, `newton after dynamics`, `dynamics` (for takes, not balanced), `draping`
            or `walked`.
        newton_steps: Newton steps of the search, over all stations of a continuation.
        solver_steps: Steps of conjugate gradients in all Newton steps.
        figures: Edge strains as in a take, `inside` (number of vertices inside the body that are not pinched),
            `deepest_mm` (largest depth inside the body) and `pinched` (number of pinched vertices).
    """

    garment: Garment
    shaped: "ShapedBody"
    pose: Pose
    settings: SimSettings
    positions: Positions
    forces: Positions
    load: Float[np.ndarray, " verts"]
    face: Int[np.ndarray, " verts"]
    crease_face: Int[np.ndarray, " verts"]
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
        """Positions in float32, as everything outside the simulator takes them [m]."""
        return self.positions.astype(np.float32)

    def take(self) -> Take:
        """Returns a take of kind `rest` with one frame, which `simulate` starts from and datasets store."""
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
