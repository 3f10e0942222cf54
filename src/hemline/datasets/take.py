"""Takes: a garment simulated against a clip, frame by frame, with figures that tell how far to trust it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hemline.arrays import Betas, Bool, FramesOfVertices, Int, Vertices
from hemline.errors import BadDataset, BadInput, DamagedTake
from hemline.files import content_hash, read_metadata, read_tensors, write_tensors
from hemline.motions.motion import Motion

from .take_checks import MAKE_AGAIN, QUANTUM, check_arrays, check_metadata

KINDS = ("clip", "rest", "anchor")


@dataclass(frozen=True)
class Take:
    """Vertices of a garment over a clip, with everything needed to use or to continue the take."""

    kind: str
    """Kind of the take: `clip`, or a single settled frame, `rest` in the body's rest pose or `anchor` in any pose."""
    vertices: FramesOfVertices
    """Garment vertices in the world [m], float32."""
    motion: Motion
    """Exact poses that the cloth was simulated against, one for each frame, lead-in included."""
    betas: Betas
    """Shape of the body."""
    lead_in: Bool[np.ndarray, " frames"]
    """Mask of the frames before the clip proper; training skips them."""
    pinched: Int[np.ndarray, " frames"]
    """Number of vertices in each frame that had no free place because the body overlaps itself there."""
    figures: Mapping[str, float]
    """Figures of trust, unit in the name: `edge_strain_p99`, `inside`, `deepest_mm`, `residual_share`..."""
    inputs: Mapping[str, Any]
    """Exactly what the take depends on, including the number of the simulator; its hash is the take's name."""
    failed: str | None = None
    """Reason why the simulation stopped early, with the frame; None if it did not."""
    end_state: Mapping[str, np.ndarray] = field(default_factory=dict)
    """State from which the next part of the same clip continues."""
    derivatives: Mapping[str, Vertices] = field(default_factory=dict)
    """Derivatives of an anchor by name: the change of each vertex while a joint turns about an axis of its frame
    (`turn.12.0` [m/rad]) or a shape coefficient grows (`beta.0` [m])."""
    made_with: Mapping[str, str] = field(default_factory=dict)
    """Versions of hemline and of its compiler, and the processor. This is for the record and not part of the name."""

    def __post_init__(self):
        frames = len(self.motion)
        lengths = {"vertices": len(self.vertices), "lead_in": len(self.lead_in), "pinched": len(self.pinched)}
        wrong = {name: length for name, length in lengths.items() if length != frames}
        if wrong:
            raise BadDataset(
                "a take's arrays must have one row a frame", f"{wrong} for {frames} frames", "make it again"
            )
        if self.kind not in KINDS:
            raise BadDataset("a take's kind is 'clip', 'rest' or 'anchor'", repr(self.kind), "name one of them")
        for name, derivative in self.derivatives.items():
            if derivative.shape != self.vertices.shape[1:]:
                got = f"shape {derivative.shape} for {self.vertices.shape[1]} vertices"
                raise BadDataset(f"derivative '{name}' must have one row a vertex", got, "make the take again")

    @property
    def name(self) -> str:
        """Name of the take, a hash of its inputs: the same command gives the same name."""
        return take_name(self.inputs)

    @property
    def simulator(self) -> int:
        """Number of the simulator that made the take, see `hemline.sim.SIMULATOR`; 0 for older takes without it."""
        return self.inputs.get("simulator", 0)

    @property
    def clip_frames(self) -> Int[np.ndarray, " frames"]:
        """Indices of the frames after the lead-in."""
        return np.flatnonzero(~self.lead_in)


def take_name(inputs: Mapping[str, Any]) -> str:
    """Returns the name of the take that is made of these inputs, a hash of them."""
    return content_hash(inputs)


def write_take(path: str | Path, take: Take, *, quantised: bool = False) -> None:
    """Writes a take, whole or not at all.

    Args:
        path: The file.
        take: The take.
        quantised: Whether vertices are stored as steps of 10 micrometres, differenced in time, in int16 or else int32.
            Once compressed this is about a third smaller; the error is at most 5 micrometres a coordinate.

    Raises:
        BadOutput: The path cannot be written.
    """
    arrays: dict[str, np.ndarray] = {
        "rotations": take.motion.rotations,
        "translations": take.motion.translations,
        "betas": np.asarray(take.betas, np.float32),
        "lead_in": np.asarray(take.lead_in, np.uint8),
        "pinched": np.asarray(take.pinched, np.int32),
    }
    arrays |= _quantise(take.vertices) if quantised else {"vertices": np.asarray(take.vertices, np.float32)}
    arrays |= {f"end_state.{name}": array for name, array in take.end_state.items()}
    arrays |= {f"derivatives.{name}": np.asarray(array, np.float32) for name, array in take.derivatives.items()}
    motion = take.motion
    metadata = {
        "kind": "take",
        "take": take.kind,
        "figures": dict(take.figures),
        "inputs": dict(take.inputs),
        "failed": take.failed,
        "made_with": dict(take.made_with),
        "motion": {
            "fps": motion.fps,
            "leg_length": motion.leg_length,
            "name": motion.name,
            "source": motion.source,
            "licence": motion.licence,
        },
    }
    write_tensors(path, arrays, metadata)


def read_take(path: str | Path) -> Take:
    """Reads a take.

    Raises:
        BadDataset: The file is missing, cannot be read, is not a take, or its arrays contradict each other.
        DamagedTake: The take is damaged; this is a kind of `BadDataset`.
    """
    try:
        arrays, metadata = read_tensors(path, "take", error=BadDataset, damaged=DamagedTake)
    except DamagedTake as reason:
        raise _damage_error(reason) from reason
    check_metadata(path, metadata)
    check_arrays(path, arrays)
    try:
        motion = Motion(rotations=arrays["rotations"], translations=arrays["translations"], **metadata["motion"])
        return Take(
            kind=metadata["take"],
            vertices=arrays["vertices"],
            motion=motion,
            betas=arrays["betas"],
            lead_in=arrays["lead_in"].astype(bool),
            pinched=arrays["pinched"],
            figures=metadata["figures"],
            inputs=metadata["inputs"],
            failed=metadata["failed"],
            end_state=_part(arrays, "end_state"),
            derivatives=_part(arrays, "derivatives"),
            made_with=metadata.get("made_with", {}),
        )
    except BadInput as reason:
        raise BadDataset(f"{path} is none of a take", reason, MAKE_AGAIN) from reason


def take_metadata(path: str | Path) -> dict[str, Any]:
    """Returns a take's metadata without reading its arrays; raises the same errors as `read_take`."""
    try:
        metadata = read_metadata(path, "take", error=BadDataset, damaged=DamagedTake)
    except DamagedTake as reason:
        raise _damage_error(reason) from reason
    check_metadata(path, metadata)
    return metadata


def _damage_error(reason: DamagedTake) -> DamagedTake:
    """Returns the error with what can be done about a damaged take."""
    return DamagedTake(reason.what, reason.got, "run the command that made it again: it puts the file aside")


def _part(arrays: Mapping[str, np.ndarray], name: str) -> dict[str, np.ndarray]:
    return {key.removeprefix(f"{name}."): array for key, array in arrays.items() if key.startswith(f"{name}.")}


def _quantise(vertices: FramesOfVertices) -> dict[str, np.ndarray]:
    whole = np.rint(np.asarray(vertices, np.float64) / QUANTUM).astype(np.int32)
    steps = np.diff(whole, axis=0)
    fits = steps.size == 0 or np.abs(steps).max() < 2**15
    return {"first": whole[0], "steps": steps.astype(np.int16) if fits else steps}
