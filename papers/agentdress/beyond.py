"""Extensions of the paper, each next to what it would replace: `python -m papers.agentdress.beyond ANCHORS TEST`.

ANCHORS is a dataset made by `hemline drape GARMENT --anchors ...`, TEST the test set of `errors.py`. The variants that
ship are a kernel over pose and shape together, and bodies compared by the skin under the garment. They are compared
with shape models blended as in the paper, bodies compared by their betas, sensitivities of the body's own shape or with
the effect of skinning (as in the paper), and a fit without random bodies.

Writes papers/agentdress/pages/beyond.md, which also shows the rows of `materials.py`, and a row in
benchmarks/results/agentdress_beyond.jsonl.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from hemline import bodies
from hemline.animators.agentdress.config import AgentDressConfig
from hemline.animators.agentdress.distances import anchor_weights, axes_between, region_distances
from hemline.animators.agentdress.fit.anchor_set import AnchorSet, is_t_pose
from hemline.animators.agentdress.fit.fit import fit_anchors
from hemline.animators.agentdress.fit.shape_fit import shape_models
from hemline.animators.agentdress.fit.shape_kernel import SHAPE_RIDGES, SHAPE_WIDTHS, ShapeChanges, fit_shape_kernel
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.animators.agentdress.shape_model import pad_betas, shape_features
from hemline.arrays import Float
from hemline.bodies.velocities import turning_velocity
from hemline.compiled import use_threads
from hemline.datasets import Dataset, open_dataset
from hemline.datasets.joint_sensitivity import derivatives_by_joint
from hemline.learning.pca import principal_of_rows
from papers.agentdress.settled.pairs import Pair, mean_distance_mm, settle_pairs
from papers.report import ROOT, Page, Row, origin_of, parse_options, read_rows, record

NAME = "agentdress_beyond"
PAGES = ROOT / "papers" / "agentdress" / "pages"
RIDGE = 0.2


def write_page(row: Row) -> str:
    """Writes the page; returns the text."""
    page = Page("Beyond the paper")
    page.text(origin_of(row, "python -m papers.agentdress.beyond ANCHORS TEST"))
    page.text(f"""
        `{row["garment"]}` with {row["anchors"]} anchors, evaluated on {row["pairs"]} pairs of a random body and a pose
        of people who appear in no fit. Errors are mean distances of vertices from the simulation.
    """)
    page.section("On random bodies").table({"fit": "", "error, mm": ".2f"}, row["random_bodies_mm"].items())
    page.text("""
        "As it ships" compares two bodies by the distance between their skins under the garment
        (`shape_distance.shape_scale`), "betas alike" by their sixteen betas, some of which hardly move that skin. The
        future work of the paper asks for sensitivities that depend on the shape: here a ridge regression of the norms
        of Eq. 7 on betas and squared betas predicts them for each body, which gets a fit of its own.
    """)
    page.section("Pose and shape together").text("""
        The error of the change from the mean shape to the sixteen other shapes, at anchors that are left out. Width and
        ridge of the kernel over pose and shape are chosen on every other anchor, and evaluated on those between.
    """)
    page.table({"shape model": "", "error, mm": ".2f"}, row["shape_left_out_mm"].items())
    page.section("Material as a third dimension").text("""
        `python -m papers.agentdress.materials ANCHORS OTHER... --test FOLDER` evaluates the garment in other materials,
        on the mean body, in poses of other people. The model is fitted to the anchors and to drapes in other materials
        and some of the same poses. The first error columns use the simulated garment of the fit as pose model, so that
        only the effect of the material is evaluated; "as played" includes the pose model.
    """)
    latest = {each["to"]: each for each in read_rows("agentdress_materials")}
    columns = {
        "material left out": "without material",
        "mean change": "mean change of its drapes",
        "told": "kernel over materials",
        "told, from the others alone": "kernel, fitted without its drapes",
        "as played, material left out": "as played, without material",
        "as played": "as played",
    }
    page.table(
        {
            "from": "",
            "to": "",
            "drapes": "d",
            "test poses": "d",
            **{f"{heading}, mm": ".2f" for heading in columns.values()},
            "commit": "",
        },
        (
            [each["from"], each["to"], each["known"], each["judged"]]
            + [each["error_mm"].get(key) for key in columns]
            + [each["commit"]]
            for each in latest.values()
        ),
    )
    return page.write(PAGES / "beyond.md")


def sensitivities(dataset: Dataset, anchors: AnchorSet) -> tuple[np.ndarray, np.ndarray]:
    """Returns the betas of the bodies in the T-pose, and the sensitivity of each vertex relative to the skin."""
    body, betas, norms = bodies.load(dataset.garment.body_name), [], []
    for row in dataset.anchors():
        take = dataset.take(row)
        if "turn.0.0" not in take.derivatives or not is_t_pose(take.motion[0]):
            continue
        cloth, posed = derivatives_by_joint(take, body), body.shaped(take.betas).posed(take.motion[0])
        skin = [
            [turning_velocity(posed, joint, axis)[anchors.binding.nearest] for axis in np.eye(3)]
            for joint in range(len(cloth))
        ]
        norms.append(np.linalg.norm(cloth - np.array(skin), axis=3).transpose(2, 0, 1))
        betas.append(take.betas)
    return pad_betas(np.array(betas, np.float64), anchors.betas.shape[1]), np.array(norms)


def fit_own_shapes(
    dataset: Dataset, anchors: AnchorSet, pairs: list[Pair]
) -> dict[tuple[float, ...], AnimatorAgentDress]:
    """Fits a model for each body with the sensitivities of its shape, predicted by a ridge regression on the betas."""
    betas, norms = sensitivities(dataset, anchors)
    features, models = shape_features(betas), {}
    centre, mean = features.mean(axis=0), norms.mean(axis=0)
    centred = features - centre
    gram = centred.T @ centred + RIDGE * np.eye(centred.shape[1])
    weights = np.linalg.solve(gram, centred.T @ (norms - mean).reshape(len(norms), -1))
    for shape in {pair.betas for pair in pairs}:
        query = shape_features(pad_betas(np.array([shape]), betas.shape[1]))
        predicted = np.maximum(mean + ((query - centre) @ weights).reshape(mean.shape), 0)
        models[shape] = _fit(dataset, replace(anchors, sensitivity=(anchors.sensitivity[0], predicted)))
    return models


def fit_without_random_bodies(dataset: Dataset, anchors: AnchorSet) -> AnimatorAgentDress:
    """Fits a model to bodies with the betas of the anchors alone."""
    known = anchors.betas.shape[1]

    class Fewer(Dataset):
        def anchors(self):
            return [row for row in super().anchors() if not any(row.betas[known:])]

    return _fit(dataset, AnchorSet.of(Fewer(dataset.folder, dataset.garment)))


def _fit(
    dataset: Dataset, anchors: AnchorSet, config: AgentDressConfig | None = None, scale: np.ndarray | None = None
) -> AnimatorAgentDress:
    options = config or AgentDressConfig()
    return fit_anchors(dataset.garment, anchors, options, scale=scale, progress=lambda stage, done, total: None)


def error_mm(model_of: Callable[[Pair], AnimatorAgentDress], pairs: list[Pair], body: bodies.Body) -> float:
    """Returns the mean distance of vertices from the settled garment over the pairs [mm]."""
    return float(
        np.mean(
            [
                mean_distance_mm(model_of(pair).drape(body.shaped(pair.betas).posed(pair.pose)), pair.worn)
                for pair in pairs
            ]
        )
    )


BASIS_MODES = AgentDressConfig().shape_modes


def shape_errors(model: AnimatorAgentDress, anchors: AnchorSet) -> dict[str, float]:
    """Returns the error of the change from the mean shape to the others at anchors left out, by shape model [mm].

    Width and ridge of the joint kernel are chosen on every other anchor, and evaluated on those between.
    """
    changes = (anchors.offsets[:, 1:] - anchors.offsets[:, :1]).astype(np.float64)
    weights, scale = model.tables.axes.astype(np.float64), model.tables.shapes.scale.astype(np.float64)
    distances = region_distances(axes_between(anchors.rotations, anchors.rotations), weights)
    regions, count = model.tables.regions.astype(np.float64), len(changes)
    test = range(1, count, 2)
    blended = _blend_others(anchors, distances, regions)
    coordinates = pad_betas(anchors.betas[1:], len(scale)) @ scale
    joint = _joint_kernel_mm(coordinates, changes, distances, regions, range(0, count, 2), test)
    return {
        "nothing": _mm([changes[n] for n in test]),
        "mean over anchors": _mm([changes[n] - np.delete(changes, n, axis=0).mean(axis=0) for n in test]),
        "shape models of five anchors, blended (Eq. 4)": _mm([changes[n] - blended[n] for n in test]),
        "kernel over pose and shape": joint,
    }


def _blend_others(anchors: AnchorSet, distances: np.ndarray, regions: np.ndarray) -> Float[np.ndarray, "a s v 3"]:
    """Returns Eq. 4 at each anchor, from the other anchors."""
    config, results = AgentDressConfig(), []
    models = shape_models(anchors, config)
    zero = np.zeros_like(anchors.betas[:1])
    effects = np.array([(each.at(anchors.betas[1:]) - each.at(zero)) for each in models])
    effects = effects.reshape(*effects.shape[:2], -1, 3)
    for number in range(len(models)):
        others = np.delete(np.arange(len(models)), number)
        weights = np.zeros((len(distances[0]), len(models)))
        weights[:, others] = anchor_weights(distances[number][:, others], **config.blending)
        results.append(np.einsum("va,asvi->svi", regions @ weights, effects))
    return np.array(results)


def _joint_kernel_mm(
    coordinates: np.ndarray,
    changes: np.ndarray,
    distances: np.ndarray,
    regions: np.ndarray,
    validation: Sequence[int],
    test: Sequence[int],
) -> float:
    """Returns the test error of the kernel with the width and ridge of least validation error [mm]."""
    basis, outputs = principal_of_rows(changes.reshape(changes.shape[0] * changes.shape[1], -1), BASIS_MODES)
    count, shapes = changes.shape[:2]
    poses = np.repeat(np.arange(count), shapes)
    training = ShapeChanges(poses, np.tile(coordinates, (count, 1)), outputs, poses)
    modes, errors = basis.reshape(len(basis), -1, 3), []
    for width in SHAPE_WIDTHS:
        for ridge in SHAPE_RIDGES:
            fit = fit_shape_kernel(distances, training, width=width, ridge=ridge)
            residuals = fit.leave_one_out.reshape(len(fit.leave_one_out), count, shapes, -1)

            def error(anchors: Sequence[int], residuals: np.ndarray = residuals) -> float:
                terms = [(regions, residuals[:, n], modes) for n in anchors]
                return _mm([np.einsum("vg,gsk,kvi->svi", *each, optimize=True) for each in terms])

            errors.append((error(validation), error(test)))
    return min(errors, key=lambda each: each[0])[1]


def _mm(differences: Sequence[np.ndarray]) -> float:
    return 1e3 * float(np.mean([np.linalg.norm(each, axis=-1).mean() for each in differences]))


def main() -> None:
    """Fits all variants, measures, records and writes the page."""
    options = parse_options(__doc__, "anchors", "test", pairs=(400, "the same number as for errors.py"), seed=0)
    use_threads(1)
    dataset = open_dataset(options.anchors)
    anchors, body = AnchorSet.of(dataset), bodies.load(dataset.garment.body_name)
    pairs = list(settle_pairs(options.test, dataset.garment, count=options.pairs, seed=options.seed, jobs=1))
    model, own = _fit(dataset, anchors), fit_own_shapes(dataset, anchors, pairs)
    variants = {
        "as it ships": model,
        "shape models of five anchors, blended (Eq. 4)": _fit(
            dataset, anchors, AgentDressConfig(shape_model="blended")
        ),
        "bodies compared by betas alike": _fit(dataset, anchors, scale=np.eye(len(body.shapedirs))),
        "sensitivities of the body's own shape": None,
        "sensitivities with what skinning does (the paper's)": _fit(
            dataset, replace(anchors, sensitivity=(anchors.sensitivity[0],) * 2)
        ),
        "without random bodies in the fit": fit_without_random_bodies(dataset, anchors),
    }
    row = {
        "garment": dataset.garment.name,
        "anchors": len(anchors.rotations),
        "pairs": len(pairs),
        "random_bodies_mm": {
            name: error_mm(lambda pair, variant=variant: variant or own[pair.betas], pairs, body)
            for name, variant in variants.items()
        },
        "shape_left_out_mm": shape_errors(model, anchors),
    }
    print(write_page(*record(NAME, row)))


if __name__ == "__main__":
    main()
