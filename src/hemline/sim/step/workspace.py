"""Working memory for the steps of one sheet."""

import numpy as np

from hemline.sim.cloth.air_kernels import TriangleAir
from hemline.sim.cloth.elastic_kernels import VERTEX_CHUNK
from hemline.sim.cloth.membrane_kernels import Stretch
from hemline.sim.contact.pairs.body_points import BodyPointSearch
from hemline.sim.contact.pairs.self_search import SelfSearch
from hemline.sim.solver.system import System

from .model import ClothModel
from .vertex_kernels import PotentialEvaluation


class Workspace:
    """Arrays that every evaluation of a potential overwrites, and the searches for contact with their buffers.

    One potential at a time may use it. Nothing carries over: the result of a step does not depend on its contents.

    Attributes:
        strain_start: Green strain of each triangle at the start of the step.
        stretch: Current state of the membrane.
        hinge_gradient: Gradient of each hinge at its four vertices [N].
        hinge_energy: Energy of each hinge [J].
        bent: Gradient of the hinges, summed at each vertex [N].
        elastic: Gradient of membrane and bending [N].
        bending_energy: Energy of the bending matrix, by chunk [J].
        pressed: Gradient of membrane, bending, pairs and additional terms [N].
        evaluation: Gradient of all terms; energy of inertia, air and contact with the body; residual.
        pair_diagonal: Diagonal blocks of pairs [N/m].
        air_by_triangle: Force and matrix of the air on each triangle.
        air: Force and matrix of the air at each vertex.
        system: The solver's matrix and vectors.
        self_search: Search for self-contact; None if it is switched off.
        point_search: Search for points above the body's vertices.
    """

    def __init__(self, model: ClothModel):
        sheet, settings = model.sheet, model.settings
        faces, verts, hinges = len(sheet.faces), sheet.vertex_count, len(sheet.hinge_rest)
        chunks = (verts + VERTEX_CHUNK - 1) // VERTEX_CHUNK
        self.strain_start = np.zeros((faces, 3))
        self.stretch = Stretch(np.empty((faces, 9)), np.empty((faces, 6)), np.empty((faces, 3)), np.empty(faces))
        self.hinge_gradient, self.hinge_energy, self.bent = (
            np.empty((hinges, 12)),
            np.empty(hinges),
            np.zeros((verts, 3)),
        )
        self.elastic, self.bending_energy = np.empty((verts, 3)), np.empty(chunks)
        self.pressed = np.empty((verts, 3))
        self.evaluation = PotentialEvaluation(np.empty((verts, 3)), np.empty(chunks), np.empty(chunks))
        self.pair_diagonal = np.zeros((verts, 6))
        self.air_by_triangle = TriangleAir(np.zeros((faces, 3)), np.zeros((faces, 6)))
        self.air = np.zeros((verts, 3)), np.zeros((verts, 6))
        self.system = System(model.layout)
        self.self_search = (
            SelfSearch(
                sheet,
                thickness=settings.self_thickness,
                stiffness=settings.self_stiffness,
                friction=sheet.friction,
            )
            if settings.self_contact
            else None
        )
        self.point_search = BodyPointSearch(
            sheet, fixed=model.fixed, thickness=settings.thickness, friction=sheet.friction
        )
