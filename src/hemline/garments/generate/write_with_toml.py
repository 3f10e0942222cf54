"""Writes a garment as a mesh for other programs, with a TOML that holds the rest."""

from pathlib import Path

from hemline.files import atomic_writes
from hemline.garments.garment import Garment


def write_with_toml(path: str | Path, garment: Garment) -> Path:
    """Writes `NAME.obj` and `NAME.toml`; `hemline simulate NAME.toml` reads them, edited or not.

    Args:
        path: The mesh, `NAME.obj`.
        garment: A garment of a named material, pinned along its highest rim or nowhere.

    Returns:
        The path of the TOML.

    Raises:
        BadOutput: The path cannot be written.
    """
    path = Path(path)
    lines = [f"o {garment.name}"]
    lines += [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in garment.vertices.tolist()]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in garment.faces.tolist()]
    description = {
        "mesh": path.name,
        "unit": "m",
        "up": "y",
        "origin": "pelvis",
        "body": garment.body_name,
        "material": garment.material.name,
        "pins": "top_rim" if len(garment.pins) else "none",
        "key_joint": garment.key_joint,
    }
    betas = ", ".join(f"{float(beta):g}" for beta in garment.body_betas)
    table = [f'{key} = "{value}"' for key, value in description.items()] + [f"betas = [{betas}]", "flat_rest = true"]
    with atomic_writes([path, path.with_suffix(".toml")]) as temporaries:
        for temporary, content in zip(temporaries, (lines, table), strict=True):
            temporary.write_text("\n".join(content) + "\n")
    return path.with_suffix(".toml")
