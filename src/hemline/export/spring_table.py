"""The chains of a character as constants of other spring systems."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from hemline.errors import BadOutput
from hemline.files import atomic_write, check_writable
from hemline.springs import FRAME_SECONDS

from .character import DressedCharacter, bone_names

TABLE_ENDING = ".json"
_NOTE = (
    "Starting values, computed from the constants of VRM at 60 frames a second. Angles in degrees, radii in metres; "
    "KawaiiPhysics has centimetres. One value per bone below the root of its chain."
)
_LARGEST_GRAVITY = 10.0
"""Largest gravity of Magica Cloth 2 [m/s^2]."""


def write_spring_table(path: str | Path, character: DressedCharacter) -> None:
    """Writes the chains of a character for KawaiiPhysics, PhysBones and Magica Cloth 2, as JSON.

    Args:
        path: The file to write; it ends in `.json`.
        character: The character.

    Raises:
        BadOutput: The path has another ending, or cannot be written.
    """
    check_table_path(path)
    with atomic_write(Path(path)) as temporary:
        temporary.write_text(json.dumps(spring_table(character), indent=1) + "\n")


def check_table_path(path: str | Path) -> None:
    """Refuses a path that `write_spring_table` could not write, before any work is done.

    Raises:
        BadOutput: The path has another ending, or the folder cannot be written.
    """
    path = Path(path)
    if path.suffix.lower() != TABLE_ENDING:
        raise BadOutput(f"a table of springs is written as {TABLE_ENDING}", path.name, f"name it {path.stem}.json")
    check_writable(path)


def spring_table(character: DressedCharacter) -> dict[str, Any]:
    r"""Returns the chains of a character with the constants of each system.

    In a frame a spring bone of VRM of length $\ell$ turns back by the fraction
    $k = S \Delta t / (\ell + S \Delta t)$ of its angle to rest, keeps $1 - D$ of its velocity and falls by
    $G \Delta t$. Systems that accelerate bones by a gravity $g$ get $g = 2 G / \Delta t$ (KawaiiPhysics, which adds
    $g \Delta t^2 / 2$), or the gravity at which they fall as fast, $G D / \Delta t$ up to 10 m/s^2 (Magica Cloth 2,
    PhysBones).
    """
    chains, names = character.chains, bone_names(character)[len(character.joints) :]
    rows = [_row(character, number, names) for number in range(len(chains.joints))]
    return {"note": _NOTE, "frames_per_second": round(1 / FRAME_SECONDS), "chains": rows}


def _row(character: DressedCharacter, number: int, names: list[str]) -> dict[str, Any]:
    chains, span = character.chains, character.chains.spans[number]
    bones = np.array(span[1:])
    lengths = np.linalg.norm(chains.bones[bones] - chains.bones[bones - 1], axis=1)
    pull = chains.stiffness[bones] * FRAME_SECONDS
    returned, drag, fall = pull / (lengths + pull), chains.drag[bones], chains.gravity[bones] * FRAME_SECONDS
    angle = np.degrees(np.minimum(chains.inward[bones], np.pi))
    sideways = np.degrees(np.minimum(chains.sideways[bones], np.pi))
    accelerated = np.minimum(fall / FRAME_SECONDS**2 * np.maximum(drag, 1e-3), _LARGEST_GRAVITY)
    return {
        "root": names[span[0]],
        "bones": [names[bone] for bone in bones],
        "carried_by": character.joint_names[chains.joints[number]],
        "KawaiiPhysics": {
            "Damping": _rounded(drag),
            "Stiffness": _rounded(returned),
            "Radius": _rounded(100 * chains.radii[bones]),
            "LimitAngle": _rounded(angle),
            "Gravity.Z": _rounded(-100 * 2 * fall / FRAME_SECONDS**2),
        },
        "PhysBones": {
            "Pull": _rounded(returned),
            "Momentum": _rounded(1 - drag),
            "Gravity": _rounded(accelerated / _LARGEST_GRAVITY),
            "Radius": _rounded(chains.radii[bones]),
            "LimitType": "Polar",
            "MaxPitch": _rounded(angle),
            "MaxYaw": _rounded(sideways),
        },
        "MagicaCloth2": {
            "Gravity": _rounded(accelerated),
            "Damping": _rounded(drag),
            "AngleRestoration.Stiffness": _rounded(returned),
            "AngleLimit": _rounded(angle),
            "Radius": _rounded(chains.radii[bones]),
        },
    }


def _rounded(values: np.ndarray) -> list[float]:
    return [round(float(value), 4) for value in values]
