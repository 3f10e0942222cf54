"""Linear correction of the ropes' bones, by where they are and how the body moves."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from hemline.arrays import Float
from hemline.errors import BadModel
from hemline.files.contents import AGAIN, array_of

from .body_inputs import BODY_INPUT_COUNT, REST_INPUTS

MOST_GAIN = 1.25
"""Largest factor of the swing of the bones."""


@dataclass(frozen=True, eq=False)
class BoneCorrection:
    r"""Predicts how far simulated bones are from those of the ropes.

    $$\Delta d = N^T A\,[M d,\; b - b_\mathrm{rest}]$$

    with $d$ the displacements of all bones from rest in the frame of the key joint, $M$ their principal directions, $N$
    those of the output, and $b$ the motion of the body (`body_inputs.body_inputs`), clipped to the range of the
    training. It is zero where body and ropes are at rest, so the settled drape stays an equilibrium.

    Source: ours. Jin, Omens, Geng, Teran, Kumar, Tashiro, Fedkiw, "A Neural-Network-Based Approach for Loose-Fitting
        Clothing", 2024, Section 7 names the gap between bones of ropes and of the simulation, and leaves it open.
    """

    modes: Float[np.ndarray, "modes rows"]
    """$M$: orthonormal directions, zero at bones that the body carries, float32."""
    matrix: Float[np.ndarray, "outputs ins"]
    """$A$, float32."""
    outputs: Float[np.ndarray, "outputs rows"]
    """$N$: orthonormal directions, zero at bones that the body carries, float32."""
    low: Float[np.ndarray, " body"]
    """Least value of each component of $b$ in the training, float32."""
    high: Float[np.ndarray, " body"]
    """Largest value of each component of $b$ in the training, float32."""
    swing_gain: float = 1.0
    """Factor of the swing of the corrected bones (`bone_source`): above 1 where a least-squares fit damps it."""

    def __call__(
        self, moved: Float[np.ndarray, "*frames rows"], body: Float[np.ndarray, "*frames body"]
    ) -> Float[np.ndarray, "*frames rows"]:
        """Returns the change of the displacements, in one frame or in many [m], float32.

        Args:
            moved: Displacements of all bones of the ropes [m].
            body: Motion of the body, see `body_inputs.body_inputs`.
        """
        seen = (np.clip(body, self.low, self.high) - REST_INPUTS).astype(np.float32)
        inputs = np.concatenate([moved @ self.modes.T, seen], axis=-1)
        return inputs @ self.matrix.T @ self.outputs

    def with_zero_output(self) -> "BoneCorrection":
        """Returns a correction of the same size that changes nothing."""
        return replace(self, matrix=np.zeros_like(self.matrix), swing_gain=1.0)

    def arrays(self) -> dict[str, np.ndarray]:
        """Returns the arrays of a model file."""
        arrays = {name: getattr(self, name) for name in ("modes", "matrix", "outputs", "low", "high")}
        return arrays | {"swing_gain": np.array([self.swing_gain], np.float32)}

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray], *, rows: int) -> Self:
        """Makes a correction from the arrays of a model file.

        Args:
            arrays: As `arrays` returns them.
            rows: Number of coordinates of all bones.

        Raises:
            BadModel: An array is missing, or its type or shape does not fit the others; or the factor of the swing is
                not from 1 to `MOST_GAIN`. Files without that factor have 1.
        """
        modes, outputs = (array_of(arrays, name, "float32", (None, rows)) for name in ("modes", "outputs"))
        if not (len(modes) and len(outputs)):
            raise BadModel("the bone correction of the model has no modes", 0, AGAIN)
        seen = BODY_INPUT_COUNT
        low, high = (array_of(arrays, name, "float32", (seen,)) for name in ("low", "high"))
        if (low > high).any():
            raise BadModel("ranges of the bone correction are ordered", "a lower limit above the upper one", AGAIN)
        matrix = array_of(arrays, "matrix", "float32", (len(outputs), len(modes) + seen))
        gain = float(array_of(arrays, "swing_gain", "float32", (1,))[0]) if "swing_gain" in arrays else 1.0
        if not 1 <= gain <= MOST_GAIN:
            raise BadModel(f"the swing of a model is multiplied by 1 to {MOST_GAIN:g}", gain, AGAIN)
        return cls(modes, matrix, outputs, low, high, gain)
