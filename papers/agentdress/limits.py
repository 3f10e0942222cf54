"""Where AgentDress fails, too loose and too tight: `python -m papers.agentdress.limits MODEL ANCHORS TEST`.

MODEL is a model file or the name of a shipped model, ANCHORS the dataset that it was fitted to, TEST a folder for the
test set, made and continued here. First the garment of the model is evaluated on bodies from small to large, including
that of Fig. 13, in poses of people who appear in no fit. Then come other garments, close and loose, with every term of
Eq. 3 simulated: the garment on the mean body, and the effect of the shape in the pose of the nearest anchor. The error
that remains is that of the assumption that skinning carries the effect of the shape from pose to pose.

Writes papers/agentdress/pages/limits.md with its pictures, and a row in benchmarks/results/agentdress_limits.jsonl.
"""

from pathlib import Path

import numpy as np

import hemline
from hemline import bodies, garments, pictures
from hemline.animators.agentdress.binding import Binding
from hemline.animators.agentdress.fit.anchor_set import AnchorSet
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.arrays import Vertices
from hemline.bodies import Body, PosedBody, ShapedBody
from hemline.collide.winding.numbers import inside
from hemline.compiled import use_threads
from hemline.datasets import open_dataset
from hemline.garments import Garment
from hemline.meshes import edge_strains
from hemline.motions.motion import Pose
from hemline.sim import produce_rests
from papers.agentdress.models.ablations import binding_of, with_offsets
from papers.agentdress.settled.pairs import choose_pairs, mean_distance_mm, settle_in_poses
from papers.report import ROOT, Page, Row, join_numbers, mean_of, origin_of, parse_options, record
from papers.rope_chains.drawing.figure import axes, save_sheet

NAME = "agentdress_limits"
PAGES = ROOT / "papers" / "agentdress" / "pages"
GARMENTS = ("tshirt-light", "skirt-light", "cape-light")
FIG13_BETAS = (-2.0, 2.0, 0.0, 0.0)
HALF_BETAS = (-1.0, 1.0, 0.0, 0.0)
"""Body on which other garments are evaluated, half way to that of Fig. 13."""
PICTURE_SIZE = (360, 480)


def write_page(row: Row) -> str:
    """Writes the page; returns the text."""
    page = Page("Too loose, too tight")
    page.text(origin_of(row, f"python -m papers.agentdress.limits {row['garment']} ANCHORS TEST"))
    page.text("""
        Poses of people who appear in no fit. Errors are mean distances of vertices from the simulation. The gap is the
        mean distance of the simulated vertices from the closest body vertex, the stretch the mean excess length of
        edges. The paper (section 4.9, Fig. 13) reports that the method may fail for garments that are too loose, as
        skinning then does not carry the effect of the shape from pose to pose, and that for garments that are too tight
        not all penetrations are resolved.
    """)
    page.section(f"{row['garment']} on small and large bodies").table(
        {
            "body": "",
            "betas": "",
            "gap, mm": ".1f",
            "stretch, %": ".1f",
            "error, mm": ".1f",
            "error with simulation as pose model, mm": ".1f",
            "inside, %": ".1f",
        },
        (
            [name, join_numbers(each["betas"])]
            + [each[key] for key in ("gap_mm", "stretch_percent", "error_mm", "driven_mm", "inside_percent")]
            for name, each in sorted(row["by_body"].items(), key=lambda item: -item[1]["gap_mm"])
        ),
    )
    page.text('"Inside" are vertices in the body before the projection of the player, which moves them out.')
    page.picture("error against gap", "limits/fig13-curve.png").picture("the body of Fig. 13", "limits/fig13.png")
    page.text("""
        The body of Fig. 13 in the pose of largest error, before cover and projection of the player, and the mean body
        in the same pose.
    """)
    page.section("Other garments").text("""
        The effect of the shape, carried by skinning from the pose of the nearest anchor to another one, with all terms
        of Eq. 3 simulated, on a body half way to that of Fig. 13. The baseline is the skinned rest drape of that body.
        A garment without figures never came to rest.
    """)
    page.table(
        {"garment": "", "poses": "d", "gap, mm": ".1f", "error, mm": ".1f", "skinned rest drape, mm": ".1f"},
        (
            [name, *((each or {"poses": 0}).get(key) for key in ("poses", "gap_mm", "error_mm", "skinned_mm"))]
            for name, each in row["by_garment"].items()
        ),
    )
    return page.write(PAGES / "limits.md")


def draw_curves(row: Row) -> None:
    """Draws error over gap, for bodies and for garments."""
    sheet, ((axis,),) = axes(1, 1, width=5.6, height=3.4)
    series = (
        ("by_body", "error_mm", "o", "tab:blue", "as played"),
        ("by_body", "driven_mm", "s", "tab:blue", "simulation as pose model"),
        ("by_garment", "error_mm", "^", "tab:orange", "other garments, Eq. 3 simulated"),
    )
    for group, key, mark, colour, label in series:
        points = {name: (each["gap_mm"], each[key]) for name, each in row[group].items() if each}
        fill = "none" if mark == "s" else colour
        axis.plot(*zip(*points.values(), strict=True), mark, color=colour, mfc=fill, label=label)
        if key == "error_mm":
            for name, place in points.items():
                axis.annotate(name, place, fontsize=6, xytext=(4, 3), textcoords="offset points")
    axis.set(xlabel="gap between garment and body, mm", ylabel="mean vertex error, mm", xlim=(0, None), ylim=(0, None))
    axis.legend(fontsize=7)
    save_sheet(sheet, PAGES / "limits", "fig13-curve.png")


def draw_worst(model: AnimatorAgentDress, pose: Pose, mean: Vertices, truth: Vertices) -> None:
    """Draws Fig. 13: the garment on the mean body, and on the other one as simulated and as played."""
    body = bodies.load(model.body_name)
    plain, posed = (body.shaped(np.array(betas, np.float32)).posed(pose) for betas in ((), FIG13_BETAS))
    scenes = ((plain, mean, "truth"), (posed, truth, "truth"), (posed, model.drape(posed), "cloth"))
    views = []
    for solid, vertices, colour in scenes:
        meshes = [(solid.vertices, solid.faces, "body"), (np.asarray(vertices), model.garment.faces, colour)]
        views.append(pictures.picture_of(meshes, "three_quarter", size=PICTURE_SIZE))
    captions = ["simulated, mean body", "simulated, betas -2, 2", "as played"]
    pictures.write_png(PAGES / "limits" / "fig13.png", pictures.side_by_side(views, captions))


def volume(body: Body, betas: np.ndarray) -> float:
    """Returns the volume of a body in its rest pose [m^3]."""
    shaped = body.shaped(betas.astype(np.float32))
    a, b, c = shaped.vertices[body.faces].astype(np.float64).transpose(1, 0, 2)
    return float(np.einsum("fi,fi->", a, np.cross(b, c)) / 6)


def shapes_of(body: Body) -> dict[str, tuple[float, ...]]:
    """Returns betas by name: Fig. 13, along the first beta, and as far along the gradient of the volume."""
    gradient = np.array([volume(body, each) - volume(body, -each) for each in 0.5 * np.eye(4)])
    heavy = np.linalg.norm(FIG13_BETAS) * gradient / np.linalg.norm(gradient)
    along = {f"first beta {first:g}": (first,) for first in (-2.0, -1.0, 0.0, 1.0, 2.0)}
    ends = {"heaviest": tuple(heavy.tolist()), "lightest": tuple((-heavy).tolist())}
    return {"of Fig. 13": FIG13_BETAS} | along | ends


def measure_fit(vertices: Vertices, posed: PosedBody, garment: Garment) -> dict[str, float]:
    """Measures how a simulated garment fits: mean distance to the closest body vertex, and mean stretch of edges."""
    from scipy.spatial import KDTree

    gap = KDTree(posed.vertices).query(vertices)[0].mean()
    strains = edge_strains(vertices, garment.faces, garment.rest_edges)
    return {"gap_mm": 1e3 * float(gap), "stretch_percent": 100 * float(np.maximum(strains, 0).mean())}


def measure_errors(
    model: AnimatorAgentDress, betas: tuple[float, ...], pose: Pose, mean: Vertices, truth: Vertices
) -> dict[str, float]:
    """Measures the errors in one pose.

    Args:
        model: The model.
        betas: The body.
        pose: The pose.
        mean: The simulated garment on the mean body [m].
        truth: The simulated garment on the body [m].
    """
    body = bodies.load(model.body_name)
    plain, posed = body.shaped().posed(pose), body.shaped(np.array(betas, np.float32)).posed(pose)
    nominal = binding_of(model).offsets(plain.transforms, model.tables.rest, mean)
    prediction = model.drape(posed)
    return measure_fit(truth, posed, model.garment) | {
        "error_mm": mean_distance_mm(prediction, truth),
        "driven_mm": mean_distance_mm(with_offsets(model, nominal).drape(posed), truth),
        "inside_percent": 100 * float(np.mean(inside(posed.vertices, posed.faces, prediction))),
    }


def synthesise(
    binding: Binding,
    shaped: tuple[ShapedBody, ShapedBody],
    rests: tuple[np.ndarray, np.ndarray],
    anchor: Pose,
    settled: tuple[Vertices, Vertices],
    pose: Pose,
    mean: Vertices,
) -> np.ndarray:
    """Computes Eq. 3, the garment on a body in a pose (verts, 3) [m].

    Args:
        binding: Skin weights of the garment.
        shaped: The mean body, and the other one.
        rests: The garment in the rest pose on both [m].
        anchor: Pose of the anchor.
        settled: The garment of the anchor on both bodies [m].
        pose: The pose.
        mean: The garment in the pose on the mean body [m].
    """
    first, second = (
        binding.offsets(each.posed(anchor).transforms, rest, vertices)
        for each, rest, vertices in zip(shaped, rests, settled, strict=True)
    )
    nominal = binding.offsets(shaped[0].posed(pose).transforms, rests[0], mean)
    return binding.skin(shaped[1].posed(pose).transforms, rests[1], nominal + second - first)


def measure_transfer(
    folder: Path, garment: Garment, poses: list[Pose], anchors: list[Pose], jobs: int
) -> dict[str, float] | None:
    """Measures Eq. 3 with every term simulated, on the body half way to Fig. 13; None if nothing came to rest."""
    body = bodies.load(garment.body_name)
    rests = produce_rests(folder, garment, [(), HALF_BETAS])
    if any(isinstance(each, str) for each in rests):
        return None
    plain, other = (each.vertices[0].astype(np.float64) for each in rests if not isinstance(each, str))
    both = body.shaped(), body.shaped(np.array(HALF_BETAS, np.float32))
    binding = Binding.of(plain.astype(np.float32), garment.faces, both[0].posed(both[0].rest_pose))
    columns = [
        settle_in_poses(folder, garment, where, betas, jobs=jobs)
        for where in (poses, anchors)
        for betas in ((), HALF_BETAS)
    ]
    rows = []
    for pose, anchor, *vertices in zip(poses, anchors, *columns, strict=True):
        if any(each is None for each in vertices):
            continue
        mean, truth, *settled = vertices
        posed = both[1].posed(pose)
        prediction = synthesise(binding, both, (plain, other), anchor, (settled[0], settled[1]), pose, mean)
        skinned = binding.skin(posed.transforms, other)
        errors = {"error_mm": mean_distance_mm(prediction, truth), "skinned_mm": mean_distance_mm(skinned, truth)}
        rows.append(measure_fit(truth, posed, garment) | errors)
    return means_of(rows) | {"poses": len(rows)} if rows else None


def means_of(rows: list[dict[str, float]]) -> dict[str, float]:
    """Returns the mean of each figure."""
    return {name: round(mean_of(rows, name), 2) for name in rows[0]}


def nearest_anchor(anchors: AnchorSet, pose: Pose) -> Pose:
    """Returns the anchor with the most similar joint rotations."""
    cosines = np.abs(np.einsum("aji,ji->aj", anchors.rotations, pose.rotations.astype(np.float64)))
    angles = 2 * np.arccos(np.minimum(cosines, 1)).mean(axis=1)
    return Pose(anchors.rotations[angles.argmin()].astype(np.float32), pose.translation)


def main() -> None:
    """Settles what the test set lacks, measures, records, draws and writes the page."""
    options = parse_options(
        __doc__,
        "model",
        "anchors",
        "test",
        poses=(5, "number of poses on each body and of each garment"),
        seed=0,
        jobs=1,
    )
    use_threads(1)
    model, anchors = hemline.load(options.model), AnchorSet.of(open_dataset(options.anchors))
    assert isinstance(model, AnimatorAgentDress)
    poses = [pose for pose, _ in choose_pairs(options.poses, options.seed, model.body_name)]
    folder = options.test / model.garment.name
    means = settle_in_poses(folder, model.garment, poses, jobs=options.jobs)
    by_body, worst = {}, None
    for name, betas in shapes_of(bodies.load(model.body_name)).items():
        truths = settle_in_poses(folder, model.garment, poses, betas, jobs=options.jobs)
        complete = [
            (pose, mean, truth)
            for pose, mean, truth in zip(poses, means, truths, strict=True)
            if mean is not None and truth is not None
        ]
        if not complete:
            continue
        rows = [measure_errors(model, betas, *each) for each in complete]
        by_body[name] = means_of(rows) | {"betas": [round(beta, 2) for beta in betas], "poses": len(rows)}
        print(name, by_body[name], flush=True)
        if betas == FIG13_BETAS:
            worst = complete[int(np.argmax([row["error_mm"] for row in rows]))]
    near, by_garment = [nearest_anchor(anchors, pose) for pose in poses], {}
    for name in GARMENTS:
        by_garment[name] = measure_transfer(options.test / name, garments.load(name), poses, near, options.jobs)
        print(name, by_garment[name], flush=True)
    (row,) = record(NAME, {"garment": model.garment.name, "by_body": by_body, "by_garment": by_garment})
    draw_curves(row)
    if worst is not None:
        draw_worst(model, *worst)
    print(write_page(row))


if __name__ == "__main__":
    main()
