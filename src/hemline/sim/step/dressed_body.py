"""A garment on a body: its scene at a pose, and the steps of one frame."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from hemline.bodies.lead_in import interpolate_poses
from hemline.collide import limb_of_vertices
from hemline.errors import BadGarment
from hemline.garments.garment import Garment
from hemline.motions.motion import Pose
from hemline.sim.cloth.join import join_sheets
from hemline.sim.cloth.sheet import Elastic, Sheet, make_sheet
from hemline.sim.cloth.wind import Wind
from hemline.sim.contact.body.surface import BodySurface, MovingSkin
from hemline.sim.contact.pairs.capsules import Capsules
from hemline.sim.settings import SimSettings

from .frame_end import CleanCloth
from .model import ClothModel
from .state import ClothState, StepReport, StepScene
from .stepper import Stepper

if TYPE_CHECKING:
    from hemline.bodies import PosedBody, ShapedBody


def make_garment_sheet(garment: Garment) -> Sheet:
    """Makes the sheet of a garment from its pieces."""
    sheets, first, owner = [], 0, garment.face_pieces
    for number, piece in enumerate(garment.layers):
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


@dataclass(frozen=True, eq=False)
class SimulatedFrame:
    """One frame of the cloth before the projection.

    Attributes:
        state: The cloth at the end of the frame.
        reports: Report of each step.
        posed: The body at the end of the frame.
        skin_before: The skin at the start of the last step.
        skin: The skin at the end of the last step.
        step_seconds: Length of the last step [s].
    """

    state: ClothState
    reports: list[StepReport]
    posed: "PosedBody"
    skin_before: MovingSkin
    skin: MovingSkin
    step_seconds: float


class DressedBody:
    """One garment on one body shape, ready to be stepped from pose to pose.

    Args:
        garment: The garment, on this body shape.
        shaped: The body.
        settings: Settings of the simulator.
        wind: Wind over time and place; None for that of the settings.

    Raises:
        BadGarment: A pin of the garment names a face that the body does not have.
    """

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
            rest_limb=limb[KDTree(shaped.vertices).query(garment.vertices)[1]],
            settings=settings,
            wind=wind,
        )

    @property
    def model(self) -> ClothModel:
        """Constants of the cloth."""
        return self.stepper.model

    def scene(self, posed: "PosedBody") -> StepScene:
        """Returns what drives the cloth at a pose."""
        pins = np.asarray(self.garment.pins.on(posed), np.float64)
        return StepScene(pins, MovingSkin(posed.vertices, posed.normals), posed.joints)

    def simulate_frame(
        self, state: ClothState, first: Pose, second: Pose, *, substeps: int | None = None, seconds: float | None = None
    ) -> SimulatedFrame:
        """Steps the cloth through one frame, without the projection at its end.

        Args:
            state: The cloth at the first pose.
            first: Pose at the start.
            second: Pose at the end.
            substeps: Number of steps; None for that of the settings.
            seconds: Length of the frame [s]; None for that of the settings.

        Raises:
            SimulationFailed: A step failed even when it was cut as short as allowed.
        """
        substeps, seconds = substeps or self.settings.substeps, seconds or 1 / self.settings.fps
        posed: dict[float, tuple[PosedBody, StepScene]] = {}

        def at(fraction: float) -> tuple["PosedBody", StepScene]:
            if fraction not in posed:
                body = self.shaped.posed(interpolate_poses(first, second, fraction))
                posed[fraction] = body, self.scene(body)
            return posed[fraction]

        reports = []
        for step in range(substeps):

            def scene_at(fraction: float, step: int = step) -> StepScene:
                return at((step + fraction) / substeps)[1]

            state, report = self.stepper.advance(state, seconds / substeps, scene_at)
            reports.append(report)
        (body, now), (_, before) = at(1.0), at((substeps - 1) / substeps)
        assert now.skin is not None and before.skin is not None
        return SimulatedFrame(state, reports, body, before.skin, now.skin, seconds / substeps)

    def apply_projection(self, frame: SimulatedFrame, cleaned: CleanCloth) -> ClothState:
        """Returns the state after the projection moved the cloth.

        Velocities into the body, relative to its motion, are removed where a vertex was moved.

        Args:
            frame: The frame before the projection.
            cleaned: The cloth after the projection. Contact of its pinched vertices is softened from the next step on.
        """
        state, positions = frame.state, cleaned.positions
        moved = positions - state.positions
        length = np.linalg.norm(moved, axis=1)
        direction = moved / np.maximum(length, 1e-12)[:, None]
        closest = self.surface.closest(positions, frame.skin, length < 1e-7)
        planes = self.surface.planes(closest, positions, frame.skin_before, frame.skin, np.ones(len(positions)))
        body_velocity = (planes.carried - positions) / frame.step_seconds
        body_velocity = np.where((closest.face >= 0)[:, None], body_velocity, 0.0)
        inward = np.minimum(np.einsum("vi,vi->v", state.velocities - body_velocity, direction), 0.0)
        velocities = state.velocities - np.where(length < 1e-7, 0.0, inward)[:, None] * direction
        mask = np.zeros(len(positions), bool)
        mask[cleaned.pinched] = True
        # pinned vertices stay at their targets: pushed out and pulled back in every frame, they would shake the cloth
        positions = np.where(self.model.fixed[:, None], state.positions, positions)
        return replace(state, positions=positions, velocities=velocities, pinched=mask)
