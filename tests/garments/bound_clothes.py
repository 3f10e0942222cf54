"""Clothes bound to MakeHuman's mesh as its tools bind them, for tests: three corners, weights, a scaled offset."""

import numpy as np

from hemline.bodies.base_mesh import base_mesh
from hemline.garments.dressing import body_tree

SPANS = ((5399, 11998), (791, 881), (962, 5320))


def tube(shaped, *, top=0.1, bottom=-0.3, ease=0.05, rows=12, columns=36, flare=1.5):
    """A tube around the hips, vertices [m] and quads, row 0 on top."""
    torso = shaped.vertices[np.abs(shaped.vertices[:, 1] - 0.02) < 0.1]
    reach = np.abs(torso[np.abs(torso[:, 0]) < 0.3]).max(axis=0) + ease
    angle = np.linspace(0, 2 * np.pi, columns, endpoint=False)
    wide = np.linspace(1, flare, rows)[:, None]
    x, z = wide * reach[0] * np.sin(angle), wide * reach[2] * np.cos(angle)
    y = np.repeat(np.linspace(top, bottom, rows), columns).reshape(rows, columns)
    index = np.arange(rows * columns).reshape(rows, columns)
    quads = np.stack([index[:-1], index[1:], np.roll(index, -1, 1)[1:], np.roll(index, -1, 1)[:-1]], -1)
    return np.stack([x, y, z], axis=-1).reshape(-1, 3), quads.reshape(-1, 4)


def bindings(vertices, shaped):
    """Rows of three base vertices, weights and offset [dm], exact on the body."""
    closest = body_tree(shaped).closest(vertices)
    corners = base_mesh().body_vertices[shaped.body.faces[closest.faces]]
    return [
        f"{a} {b} {c} {u:.12g} {v:.12g} {w:.12g} {x:.12g} {y:.12g} {z:.12g}"
        for (a, b, c), (u, v, w), (x, y, z) in zip(
            corners.tolist(), closest.weights, 10 * (vertices - closest.positions), strict=True
        )
    ]


def write_clothes(folder, mesh, shaped, *, rows=None, head=None, tail=("", "delete_verts", "3 - 9 12")):
    """`clothes.mhclo` and `clothes.obj` of a mesh (vertices [m], quads) in a folder; the path of the first."""
    vertices, quads = mesh
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in 10 * vertices]
    lines += ["f " + " ".join(str(corner + 1) for corner in quad) for quad in quads]
    (folder / "clothes.obj").write_text("\n".join(lines))
    base = base_mesh().on(shaped)
    spans = [
        f"{axis}_scale {first} {second} {10 * abs(base[first, k] - base[second, k]):.12g}"
        for k, (axis, (first, second)) in enumerate(zip("xyz", SPANS, strict=True))
    ]
    lines = ["# a comment", "basemesh hm08", "name tube skirt", "obj_file clothes.obj", *spans, "z_depth 50"]
    lines = head(lines) if head else lines
    rows = bindings(vertices, shaped) if rows is None else rows
    path = folder / "clothes.mhclo"
    path.write_text("\n".join([*lines, "verts 0", *rows, *tail]) + "\n")
    return path
