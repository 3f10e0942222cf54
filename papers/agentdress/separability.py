"""Whether pose and shape separate near an anchor: `python -m papers.agentdress.separability MODEL ANCHORS TEST`.

MODEL is a model file or the name of a shipped model, ANCHORS the dataset that it was fitted to, TEST a folder for the
garments settled here, made and continued. From one anchor on the mean shape, poses and betas change together in random
directions (unit vectors of three numbers per joint and four betas) by a distance r. The garment settles there from two
starts and is compared with Eq. 3 of the paper, with three simulated garments as terms (theoretical) or with the models
(practical). The anchor is the first one, in random order, whose garment can be balanced where it lies. If it can also
be balanced without friction, which holds cloth where it came to lie, that is a third start.

Writes papers/agentdress/pages/separability.md with its picture, and a row per start in
benchmarks/results/agentdress_separability.jsonl.
"""

import sys
from collections.abc import Mapping, Sequence
from typing import TypeVar

import numpy as np

import hemline
from hemline import bodies
from hemline.animators.agentdress.config import AgentDressConfig
from hemline.animators.agentdress.fit.anchor_set import AnchorSet
from hemline.animators.agentdress.fit.rigged_anchors import anchor_blend
from hemline.animators.agentdress.fit.shape_fit import shape_models
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.animators.agentdress.shape_model import pad_betas
from hemline.arrays import Float, Transforms, Vertices
from hemline.compiled import use_threads
from hemline.datasets import Dataset, open_dataset
from hemline.garments import Garment
from hemline.motions.motion import Pose
from hemline.sim import Rest, settle
from papers.agentdress.models.rigged_examples import rig_anchors
from papers.agentdress.settled.neighbours import (
    Neighbour,
    SettleFromAnchor,
    SettleFromRest,
    balance,
    random_directions,
    step_from,
    without_friction,
)
from papers.agentdress.settled.pairs import mean_distance_mm
from papers.report import ROOT, Page, Row, join_numbers, origin_of, parse_options, record, verdict
from papers.rope_chains.drawing.figure import axes, save_sheet

NAME = "agentdress_separability"
PAGES = ROOT / "papers" / "agentdress" / "pages"
DISTANCES = (1.0, 0.5, 0.25, 0.125)
NEAR = 1 / 128
"""Distance at which hardly anything changes; the error there is the floor of the settling itself."""
SLOPE_DISTANCES = (0.5, 0.25, 0.125)
"""Distances over which the slope is measured."""
GOAL = 1.5
"""Least slope of the theoretical error."""

Value = TypeVar("Value")


def write_page(rows: Sequence[Row]) -> str:
    """Writes the page; returns the text.

    Args:
        rows: One row per start.
    """
    first, distances = rows[0], (*DISTANCES, NEAR)
    page = Page("Separability of pose and shape near an anchor")
    page.text(origin_of(first, "python -m papers.agentdress.separability MODEL ANCHORS TEST"))
    page.text(f"""
        {first["garment"]}, {first["anchors"]} anchors. Section 2 and Fig. 1 of the appendix of Wu et al. 2021.
    """)
    page.picture("error against distance", "separability.png").text(f"""
        From anchor {first["anchor"]} on the mean shape, 72 joint angles and four betas change together in random
        directions, such that the 76 numbers [rad; standard deviations] have the length r. Errors are mean distances of
        vertices from the simulation, averaged over the directions. "Theoretical" is Eq. 3 with three simulated
        garments. "Practical" is the model with all anchors (Eq. 4), whose pose model is a kernel regression or, in
        "practical, rigging", sensitivity-optimised rigging. "The anchor, skinned" has no effect of pose or shape. At r
        = {NEAR:g} only the settling itself matters, which gives the floor of the errors. The slope is the exponent of r
        over r = {join_numbers(SLOPE_DISTANCES)}, once with the square of the floor subtracted; it is left out where the
        error is not above the floor.
    """)
    for row in rows:
        page.section(row["start"].capitalize())
        counts = ", ".join(f"{by_distance(row['settled'], r)} at r = {r:g}" for r in distances)
        page.text(f"Of {row['directions']} directions came to rest: {counts}.")
        page.table(
            {
                "prediction": "",
                **{f"error at r = {r:g}, mm": ".3f" for r in distances},
                "slope": ".2f",
                "slope without floor": ".2f",
            },
            (
                [name, *(by_distance(errors, r) for r in distances)]
                + [row["slope"][name]["plain"], row["slope"][name]["floor_removed"]]
                for name, errors in row["error_mm"].items()
            ),
        )
        slopes = row["slope"]["theoretical"]
        best = float(np.nanmax([slopes["plain"], slopes["floor_removed"]]))
        page.text(f"""
            The theoretical error falls with a slope of {slopes["plain"]:.2f} to a floor of
            {by_distance(row["error_mm"]["theoretical"], NEAR):.3f} mm. A slope of {GOAL} is
            {verdict(best, at_least=GOAL)}.
        """)
    page.section("The paper").text("""
        In the paper both errors converge to zero with r, and the theoretical one is smaller (100 directions from a
        random anchor, curves without numbers).
    """)
    if len(rows) < 3:
        page.text("Without friction, which holds cloth where it came to lie, the garment of the anchor has no balance.")
    page.text(f"""
        Differs: anchor {first["anchor"]} is number {first["anchors_tried"]} in random order, the first whose settled
        garment can be balanced. Offsets from skinning are kept in rotated vertex frames, with one binding for all
        shapes.
    """)
    return page.write(PAGES / "separability.md")


def by_distance(values: Mapping[str, Value], distance: float) -> Value | None:
    """Returns the value at a distance from a recorded row, whose keys are texts; None if there is none."""
    return values.get(str(distance))


def draw(rows: Sequence[Row]) -> None:
    """Draws errors over distance, a plot per start."""
    sheet, (plots,) = axes(1, len(rows), width=4.2, height=3.4)
    for plot, row in zip(plots, rows, strict=True):
        error = row["error_mm"]["theoretical"]
        distances = [r for r in DISTANCES if str(r) in error]
        for name, errors in row["error_mm"].items():
            plot.loglog(distances, [errors[str(r)] for r in distances], "o-", label=name, ms=3)
        plot.axhline(error[str(NEAR)], color="grey", ls=":", label="floor of the settling")
        start = error[str(distances[0])]
        plot.loglog(distances, [start * (r / distances[0]) ** 2 for r in distances], "k--", lw=0.6, label="r^2")
        plot.set(title=row["start"], xlabel="distance r", ylabel="error, mm")
    plots[0].legend(fontsize=6)
    save_sheet(sheet, PAGES, "separability.png")


Betas = tuple[float, ...]
Offsets = Float[np.ndarray, "verts 3"]


class Synthesis:
    """Predictions of the garment in a pose and on a shape near an anchor on the mean shape.

    Skinning is that of the library: offsets from the skinned rest garment are kept in rotated vertex frames, and one
    binding serves all shapes.
    """

    def __init__(self, model: AnimatorAgentDress, dataset: Dataset, anchors: AnchorSet):
        self.model, self.anchors, self.body = model, anchors, bodies.load(model.body_name)
        self.rigged = rig_anchors(dataset, model, anchors)
        self.effects = shape_models(anchors, AgentDressConfig())

    def predict(
        self, anchor: Pose, pose: Pose, betas: Betas, at_anchor: Vertices, posed: Vertices, shaped: Vertices
    ) -> dict[str, Vertices]:
        """Returns predictions by name, in the world [m].

        Args:
            anchor: Pose of the anchor.
            pose: Pose of the prediction.
            betas: Shape of the prediction.
            at_anchor: Simulated garment in the pose of the anchor on the mean shape, $f(b_0, t_0)$ [m].
            posed: Simulated garment in the pose on the mean shape, $f(b_0, t)$ [m].
            shaped: Simulated garment in the pose of the anchor on the shape, $f(b, t_0)$ [m].
        """
        anchor_offsets, pose_offsets = self._offsets(anchor, (), at_anchor), self._offsets(pose, (), posed)
        change = self._offsets(anchor, betas, shaped) - anchor_offsets
        return {
            "theoretical": self._skin(pose, betas, pose_offsets + change),
            "practical": self.model.drape(self.body.shaped(np.asarray(betas, np.float32)).posed(pose)),
            "practical, rigging": self._skin(pose, betas, self.rigged(pose) + self._shape_effect(pose, betas)),
            "the anchor, skinned": self._skin(pose, betas, anchor_offsets),
        }

    def _shape_effect(self, pose: Pose, betas: Betas) -> Offsets:
        """Returns the effect of the shape, blended over the nearest anchors (Eq. 4)."""
        weights = anchor_blend(self.model, self.anchors.rotations, pose)
        row = self._pad(betas)
        total = np.zeros((len(weights), 3))
        for anchor in np.flatnonzero(weights.any(axis=0)):
            effect = self.effects[anchor]
            total += weights[:, anchor, None] * (effect.at(row) - effect.at(np.zeros_like(row))).reshape(-1, 3)
        return total

    def _pad(self, betas: Betas) -> Float[np.ndarray, "1 betas"]:
        return pad_betas(np.asarray(betas, np.float64)[None], self.anchors.betas.shape[1])

    def _rest(self, betas: Betas) -> Offsets:
        return self.anchors.rest.at(self._pad(betas)).reshape(-1, 3)

    def _transforms(self, pose: Pose, betas: Betas) -> Transforms:
        return self.body.shaped(np.asarray(betas, np.float32)).posed(pose).transforms

    def _offsets(self, pose: Pose, betas: Betas, vertices: Vertices) -> Offsets:
        """Returns the offsets of a garment from its skinned rest garment, in rotated vertex frames [m]."""
        binding, transforms = self.anchors.binding, self._transforms(pose, betas)
        return binding.offsets(transforms, self._rest(betas), vertices.astype(np.float64))

    def _skin(self, pose: Pose, betas: Betas, offsets: Offsets) -> Vertices:
        return self.anchors.binding.skin(self._transforms(pose, betas), self._rest(betas), offsets)


def slope_of(errors: dict[float, float], floor: float = 0.0) -> float:
    """Returns the exponent p of error ~ r^p over `SLOPE_DISTANCES`, by least squares of the logarithms.

    Args:
        errors: Errors by distance.
        floor: An independent error that is present at every distance; its square is subtracted.
    """
    squares = np.array([errors[r] ** 2 - floor**2 for r in SLOPE_DISTANCES])
    if not (squares > 0).all():
        return float("nan")
    return float(np.polyfit(np.log(SLOPE_DISTANCES), 0.5 * np.log(squares), 1)[0])


def choose_anchor(anchors: AnchorSet, garment: Garment, seed: int) -> tuple[int, int, Rest]:
    """Returns the index of the anchor, the number of anchors tried, and its garment in balance."""
    shaped = bodies.load(garment.body_name).shaped()
    for tried, number in enumerate(np.random.default_rng(seed).permutation(len(anchors.rotations)), 1):
        pose = Pose(anchors.rotations[number].astype(np.float32), shaped.rest_pose.translation)
        rest = balance(settle(garment, shaped, pose, method="walked"))
        if rest is not None:
            return int(number), tried, rest
    raise SystemExit("the garment of no anchor can be balanced where it lies")


def errors_mm(
    start: SettleFromRest | SettleFromAnchor, synthesis: Synthesis, anchor: Pose, steps: np.ndarray
) -> dict[str, list[float]]:
    """Returns the mean distance of vertices from the simulation, by prediction and settled direction [mm]."""
    at_anchor, errors = start.at((anchor, ())), {}
    if at_anchor is None:
        raise SystemExit("the garment of the anchor does not settle")
    for step in steps:
        pose, betas = step_from(anchor, step)
        neighbours: list[Neighbour] = [(pose, betas), (pose, ()), (anchor, betas)]
        truth, posed, shaped = (start.at(neighbour) for neighbour in neighbours)
        if truth is None or posed is None or shaped is None:
            continue
        for name, vertices in synthesis.predict(anchor, pose, betas, at_anchor, posed, shaped).items():
            errors.setdefault(name, []).append(mean_distance_mm(vertices, truth))
    return errors


def main() -> None:
    """Settles what is missing, measures, records, draws and writes the page."""
    options = parse_options(
        __doc__,
        "model",
        "anchors",
        "test",
        walked=(5, "number of directions from rest; the paper has 100"),
        followed=(20, "number of directions from the anchor"),
        seed=0,
    )
    use_threads(1)
    model, dataset = hemline.load(options.model), open_dataset(options.anchors)
    anchors = AnchorSet.of(dataset)
    number, tried, rest = choose_anchor(anchors, model.garment, options.seed)
    print(f"anchor {number}, {tried} tried", file=sys.stderr, flush=True)
    synthesis, rows = Synthesis(model, dataset, anchors), []
    starts = [
        (SettleFromRest(options.test, rest), options.walked),
        (SettleFromAnchor(options.test, rest), options.followed),
    ]
    slippery = without_friction(rest)
    if slippery is not None:
        folder = options.test / "without-friction"
        starts.append((SettleFromAnchor(folder, slippery, "followed without friction"), options.followed))
    for start, count in starts:
        errors: dict[str, dict[float, float]] = {}
        settled = {}
        for r in (*DISTANCES, NEAR):
            at_distance = errors_mm(start, synthesis, rest.pose, r * random_directions(count, options.seed))
            settled[r] = len(next(iter(at_distance.values()), []))
            for name, each in at_distance.items():
                errors.setdefault(name, {})[r] = float(np.mean(each))
            print(start.name, r, settled[r], {name: by_r[r] for name, by_r in errors.items()}, flush=True)
        slopes = {
            name: {"plain": slope_of(by_r), "floor_removed": slope_of(by_r, by_r[NEAR])}
            for name, by_r in errors.items()
        }
        rows.append(
            {
                "garment": model.garment.name,
                "start": start.name,
                "anchor": number,
                "anchors_tried": tried,
                "anchors": len(anchors.rotations),
                "directions": count,
                "settled": settled,
                "error_mm": errors,
                "slope": slopes,
            }
        )
    rows = record(NAME, *rows)
    draw(rows)
    print(write_page(rows))


if __name__ == "__main__":
    main()
