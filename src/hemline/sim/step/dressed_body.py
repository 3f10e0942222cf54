"""A garment on a body: what drives the cloth at a pose, and the end of each frame."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Int

from hemline.bodies.lead_in import between
from hemline.collide import limb_of_vertices
from hemline.errors import BadGarment
from hemline.garments.garment import Garment
from hemline.motions.motion import Pose
from hemline.sim.cloth.join import join_sheets
from hemline.sim.cloth.sheet import Elastic, Sheet, make_sheet
from hemline.sim.cloth.wind import Wind
from hemline.sim.contact.body.surface import MovingSkin, BodySurface
from hemline.sim.contact.pairs.capsules import Capsules
from hemline.sim.settings import SimSettings

from .model import ClothModel
from .state import ClothState, Scene, StepReport
from .stepper import Stepper

if TYPE_CHECKING:
    from hemline.bodies import PosedBody, ShapedBody


def make_garment_sheet(garment: Garment) -> Sheet:
    """The garment's cloth, laid out for the solver, piece by piece."""
    sheets, first, owner = [], 0, garment.face_pieces
    for number, piece in enumerate(garment.worn):
        faces, material = garment.faces[owner == number] - np.int32(first), piece.material
        elastic = Elastic(
            density=material.density,
            young=material.young,
            poisson=material.poisson,
            bending=material.bending,
            damping=material.damping,
            drag=material.drag,
            lift=material.lift,
            friction=material.friction,
        )
        shape = None if piece.flat_rest else garment.vertices[first : first + piece.vertex_count]
        sheets.append(make_sheet(faces, garment.rest_edges[owner == number], elastic, rest_vertices=shape))
        first += piece.vertex_count
    return join_sheets(sheets)


class DressedBody:
    """One garment on one body shape, ready to be stepped from pose to pose."""

    def __init__(self, garment: Garment, shaped: "ShapedBody", settings: SimSettings, wind: Wind | None = None):
        from scipy.spatial import KDTree

        self.garment, self.shaped, self.settings = garment, shaped, settings
        faces = garment.pins.body_faces
        if len(faces) and faces.max() >= len(shaped.body.faces):
            what = f"garment '{garment.name}': pins name a body face that does not exist"
            got = f"{faces.max()}; {shaped.body.name} has {len(shaped.body.faces)}"
            raise BadGarment(what, got, "read its mesh again with this body")
        limb = limb_of_vertices(shaped.body)
        self.surface = BodySurface(shaped.body.faces, reach=settings.contact_reach, limb=limb[shaped.body.faces[:, 0]])
        self.sheet = make_garment_sheet(garment)
        self.pinned = np.zeros(self.sheet.vertex_count, bool)
        self.pinned[garment.pins.vertices] = True
        self.stepper = Stepper(
            self.sheet,
            pinned=garment.pins.vertices,
            pin_stiffness=garment.pins.stiffness,
            surface=self.surface,
            capsules=Capsules.of(shaped),
            home=limb[KDTree(shaped.vertices).query(garment.vertices)[1]],
            settings=settings,
            wind=wind,
        )

    @property
    def model(self) -> ClothModel:
        """What never moves of the cloth."""
        return self.stepper.model

    def scene(self, posed: "PosedBody") -> Scene:
        """What drives the cloth at a pose."""
        pins = np.asarray(self.garment.pins.on(posed), np.float64)
        return Scene(pins, MovingSkin(posed.vertices, posed.normals), posed.joints)

    def frame(
        self, state: ClothState, first: Pose, second: Pose, *, substeps: int | None = None, seconds: float | None = None
    ) -> tuple[ClothState, list[StepReport], "PosedBody"]:
        """The cloth at the end of one frame, before the projection.

        Args:
            state: At the first pose.
            first: Pose at the start.
            second: Pose at the end.
            substeps: Steps; None: those of the settings.
            seconds: Length of the frame; None: that of the settings.

        Raises:
            SimulationFailed: A step failed at its shortest.
        """
        substeps, seconds = substeps or self.settings.substeps, seconds or 1 / self.settings.fps
        posed: dict[float, tuple[PosedBody, Scene]] = {}

        def at(share: float) -> tuple["PosedBody", Scene]:
            if share not in posed:
                body = self.shaped.posed(between(first, second, share))
                posed[share] = body, self.scene(body)
            return posed[share]

        reports = []
        for step in range(substeps):

            def scene_at(share: float, step: int = step) -> Scene:
                return at((step + share) / substeps)[1]

            state, report = self.stepper.advance(state, seconds / substeps, scene_at)
            reports.append(report)
        body, self._now = at(1.0)
        self._then, self._step = at((substeps - 1) / substeps)[1], seconds / substeps
        return state, reports, body

    def fed_back(self, state: ClothState, positions: np.ndarray, pinched: Int[np.ndarray, " pinched"]) -> ClothState:
        """The state after the projection moved the cloth: velocities into the body, seen from it, are taken away.

        Args:
            state: At the end of the frame, before.
            positions: After the projection.
            pinched: Vertices whose contact yields from now on.
        """
        moved = positions - state.positions
        length = np.linalg.norm(moved, axis=1)
        direction = moved / np.maximum(length, 1e-12)[:, None]
        now, then = self._now.skin, self._then.skin
        assert now is not None and then is not None
        closest = self.surface.closest(positions, now, length < 1e-7)
        planes = self.surface.planes(closest, positions, then, now, np.ones(len(positions)))
        body_velocity = np.where((closest.face >= 0)[:, None], (planes.carried - positions) / self._step, 0.0)
        inward = np.minimum(np.einsum("vi,vi->v", state.velocities - body_velocity, direction), 0.0)
        velocities = state.velocities - np.where(length < 1e-7, 0.0, inward)[:, None] * direction
        mask = np.zeros(len(positions), bool)
        mask[pinched] = True
        # pins stay where they are bound: moved out and back, they would shake the cloth
        positions = np.where(self.model.fixed[:, None], state.positions, positions)
        return replace(state, positions=positions, velocities=velocities, pinched=mask)
