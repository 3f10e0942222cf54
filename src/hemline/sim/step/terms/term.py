"""The interface of an additional energy term, outside the fused kernel of the vertices."""

from collections.abc import Callable
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from hemline.sim.cloth.sheet import Positions
from hemline.sim.step.model import ClothModel
from hemline.sim.step.state import StepScene


class TermInputs(NamedTuple):
    """What an additional term may depend on.

    Attributes:
        model: Constants of the sheet.
        start: The cloth at the start of the step [m].
        scene: Pins and body at the end of the step.
        h: Length of the step [s], infinite in the static solve.
    """

    model: ClothModel
    start: Positions
    scene: StepScene
    h: float


@runtime_checkable
class Term(Protocol):
    """One energy E(x) of the cloth during one step.

    The energy may couple vertices. Its Hessian is limited to the 3 x 3 blocks of each vertex with itself, which are
    enough for Newton's method to converge as long as they are positive semidefinite. A coupling in the Hessian is
    possible for pairs of up to four vertices, see `contact_pairs`.
    """

    def evaluate(self, x: Positions, gradient: Positions) -> float:
        """Returns the energy at some positions [J] and adds its gradient to `gradient` [N].

        Args:
            x: Positions of the cloth [m].
            gradient: The gradient of the terms so far [N]; changed in place.
        """
        ...

    def add_blocks(self, x: Positions, diagonal: Float[np.ndarray, "verts 6"]) -> None:
        """Adds the diagonal blocks of the Hessian at some positions.

        Args:
            x: Positions of the cloth [m].
            diagonal: Symmetric block of each vertex as xx, xy, xz, yy, yz, zz [N/m]; changed in place.
        """
        ...


MakeTerm = Callable[[TermInputs], Term | None]
"""Makes a term for one step; None if it does not act on this cloth."""
