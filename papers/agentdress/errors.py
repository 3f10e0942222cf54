"""AgentDress against settled garments: `python -m papers.agentdress.errors ANCHORS TEST`.

ANCHORS is a dataset made by `hemline drape GARMENT --anchors ...`; with `--derivatives`, the system of the paper and
rigging are measured too. TEST and TEST-played are folders for the test sets, made and continued here: the garment
settled in poses of people who appear in no fit, on sixteen random bodies and on the mean one, with arms lifted as in
the anchors and as played (`settled/pairs.py`). The model is fitted anew.

Writes papers/agentdress/pages/errors-GARMENT.md with its pictures, and a row in
benchmarks/results/agentdress_errors.jsonl.
"""

from argparse import Namespace
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np

import hemline
from hemline import pictures
from hemline.animators.agentdress.config import AgentDressConfig
from hemline.animators.agentdress.fit.anchor_set import AnchorSet
from hemline.animators.agentdress.fit.fit import fit, fit_anchors
from hemline.animators.agentdress.fit.rigged_anchors import RiggedAnchors, rows_with_derivatives
from hemline.animators.agentdress.fit.rigged_model import with_rigging
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.bodies import load as load_body
from hemline.bodies.lifted_arms import LIFT_DEG
from hemline.compiled import use_threads
from hemline.datasets import Dataset, leave_out_faulty, open_dataset
from hemline.datasets.joint_sensitivity import joint_weights
from hemline.errors import BadDataset
from hemline.garments import Garment
from papers.agentdress.models import in_motion
from papers.agentdress.models.ablations import (
    Errors,
    PoseModel,
    binding_of,
    blend_nearest,
    errors_on_mean_body,
    errors_on_random_bodies,
    model_errors_mm,
    nearest_anchor,
    ridge_regression,
    variants_of,
)
from papers.agentdress.models.as_played import errors_as_played
from papers.agentdress.models.paper_system import PaperSystem
from papers.agentdress.report.drawing import draw_errors
from papers.agentdress.settled.pairs import (
    Pair,
    choose_pairs,
    cluster_centres,
    mean_distance_mm,
    settle_as_played,
    settle_nearby,
    settle_pairs,
)
from papers.report import ROOT, Page, Row, origin_of, parse_options, record
from papers.rope_chains.drawing.figure import axes, save_sheet

NAME = "agentdress_errors"
PAGES = ROOT / "papers" / "agentdress" / "pages"
LOOSE = -0.5
"""First beta up to which the garment hangs loose on a body."""
TURN_DEG = 1.0
"""Rotation of every joint that measures how steady the ground truth is [degrees]."""
NEARBY = 24
"""Number of poses in which it is measured."""
PICTURE_SIZE = (270, 360)
DRAWN = (
    "simulation as pose model",
    "AgentDress",
    "rigging as pose model",
    "simulation of the mean shape, no shape",
    "pose model, no shape",
    "skinning",
)
"""Variants in the pictures, from left to right; the last but one is the ablation of the paper (section 4.6)."""
COLUMNS = {"mean, mm": ".1f", "90th percentile, mm": ".1f", "worst, mm": ".1f"}
OURS = "AgentDress"
WALKING = "walk"
"""Clip with hanging arms."""
PLAYED = {"mean body, walk": ".1f", "mean body": ".1f", "random bodies, walk": ".1f", "random bodies": ".1f"}


def write_page(row: Row) -> str:
    """Writes the page of a garment and its curve; returns the text."""
    garment = row["garment"]
    page = Page(f"AgentDress against the simulation: {garment}")
    page.text(origin_of(row, "python -m papers.agentdress.errors ANCHORS TEST"))
    page.text(f"""
        The model is fitted to {row["anchors"]} anchors on 17 shapes, {row["poses"]} poses on the mean shape (anchors
        included) and {row["random_bodies"]} random bodies in one of these poses each. The test set consists of
        {row["pairs"]} poses of people who appear in no fit, each on one of 16 random bodies with all 16 betas drawn
        ({row["without_rest"]} more did not come to rest). Errors are mean distances of the vertices from the settled
        garment, before the projection; tables give their mean over the pairs, 90th percentile and maximum.
    """)
    if "played" in row:
        _write_played(page, row["played"], row["anchors"])
    page.section("Random bodies, arms lifted").text("""
        The paper uses 150 anchors and 16 bodies with 400 poses each. It reports 10.6 mm with rigging as pose model,
        less with the simulation as pose model, and more without the first-order module (sections 4.5 and 4.6, Fig. 9).
    """)
    page.table({"pose model and shape model": "", **COLUMNS}, _sorted(row["random_bodies_mm"]))
    page.text(f"""
        The {row["loose_pairs"]} pairs whose first beta is {row["loosest"]:g} or less, where the garment hangs loose:
    """)
    page.table({"pose model and shape model": "", **COLUMNS}, _sorted(row["loose_bodies_mm"]))
    page.picture("Three pairs", f"errors-{garment}-pairs.png").text(f"""
        The pairs with the median error, the 90th percentile and the largest error. From left to right:
        {"; ".join(row["drawn"])}. Vertices farther than 10 mm from the simulation are green, as in Figs. 8 and 10 of
        the paper. The pictures show the output of the animator; cover and projection of the player, which move skin and
        cloth apart, come after it.
    """)
    page.section("Pose models on the mean body, arms lifted").table(
        {"pose model": "", **COLUMNS}, _sorted(row["mean_body_mm"])
    )
    if row["rigged"]:
        page.text(f"""
            For rigging, {row["rigged"]} of the anchors have derivatives. Its stiffness, {row["rigging_stiffness"]:g},
            has the least error ({row["rigging_validation_mm"]} mm) on every fourth pose that was settled on the mean
            shape alone, which rigging is not trained on. Packed and played by `hemline fit --pose-model sor`, it errs
            by {row["rigging_played_mm"]} mm on the random bodies.
        """)
    page.text(f"""
        When every joint is rotated by one degree, the simulation itself moves by {row["steadiness_mm"]} mm relative to
        skinning. No pose model can be expected to be much closer.
    """)
    by_size = row["by_anchors_mm"]
    names = list(by_size[max(by_size, key=int)])
    page.section("Fig. 9: error over the number of anchors")
    page.picture("Error over the number of anchors", f"errors-{garment}.png")
    page.table(
        {"error, mm": "", **{f"{size} anchors": ".1f" for size in by_size}},
        ([name, *(errors.get(name) for errors in by_size.values())] for name in names),
    )
    return page.write(PAGES / f"errors-{garment}.md")


def _write_played(page: Page, played: Row, anchors: int) -> None:
    page.section("As played").text(f"""
        Mean errors [mm] in {played["poses"]} poses of {played["clips"]} clips on the mean body and
        {played["random_poses"]} on random ones, arms where they are. What is shown is the output of the player, after
        its corrections. The settled garments are pinched in the armpits there: {played["pinched_percent"]:.1f} % of
        their vertices have no free place. The walk is the clip with hanging arms. The system of the paper is fitted to
        the {anchors} anchors on 17 shapes and their derivatives, and knows neither the other poses nor the random
        bodies; beside it stands our model with the drapes of these anchors alone. With arms lifted, our model takes the
        garment of a pose whose hanging arms are lifted by {LIFT_DEG:g} degrees, as in the anchors, and skinning hands
        it back. Other names are files of models of the same garment.
    """)
    page.table({"what is compared": "", **PLAYED}, _sorted(played["errors_mm"]))
    page.section("Against a simulation in motion").text(f"""
        Distance [mm] from the garment simulated in motion, in frames of the {in_motion.CLIP} on the mean body.
    """)
    page.table(
        {"what is compared": "", "mean, mm": ".1f"}, _sorted({k: [v] for k, v in played["in_motion_mm"].items()})
    )


def _sorted(errors: dict[str, list[float]]) -> list[list]:
    return sorted(([name, *values] for name, values in errors.items()), key=lambda each: each[1])


ANCHOR_COUNTS = (2, 5, 10, 20, 40)
"""Numbers of anchors in Fig. 9, as far as there are more."""


def errors_by_anchor_count(
    garment: Garment,
    anchors: AnchorSet,
    rigged: RiggedAnchors | None,
    system: PaperSystem | None,
    pairs: Sequence[Pair],
) -> dict[int, dict[str, float]]:
    """Returns mean errors by number of anchors [mm]; the number of single poses is reduced in proportion."""
    weights, errors = joint_weights(anchors.sensitivity[0]), {}
    for size in (each for each in ANCHOR_COUNTS if each < len(anchors.rotations)):
        some = cluster_centres(anchors.rotations, weights, size)
        count = round(size * len(anchors.single_rotations) / len(anchors.rotations))
        singles = cluster_centres(anchors.single_rotations, weights, count) if count else np.empty(0, int)
        fewer = anchors.subset(some, singles)
        model = fit_anchors(garment, fewer, AgentDressConfig(), progress=lambda stage, done, total: None)
        models = {}
        if rigged:
            rigged_size = min(size, len(rigged.rotations))
            models["rigging"] = rigged.subset(cluster_centres(rigged.rotations, weights, rigged_size))
        fewer_anchors = system and system.subset(cluster_centres(system.rotations, weights, size))
        of_size = errors_on_random_bodies(model, pairs, models, fewer_anchors)
        errors[size] = {name: float(np.mean(each)) for name, each in of_size.items()}
    return errors


def draw_curve(row: Row) -> None:
    """Draws Fig. 9."""
    by_size = row["by_anchors_mm"]
    sheet, ((plot,),) = axes(1, 1, width=6.4, height=3.8)
    for name in by_size[max(by_size, key=int)]:
        plot.plot(
            [int(size) for size in by_size], [errors.get(name) for errors in by_size.values()], marker="o", label=name
        )
    plot.set(xlabel="anchors", ylabel="mean error [mm]", ylim=(0, None))
    plot.legend(fontsize=7)
    save_sheet(sheet, PAGES, f"errors-{row['garment']}.png")


def draw_pairs(path: Path, model: AnimatorAgentDress, pairs: Sequence[Pair], models: dict[str, PoseModel]) -> list[str]:
    """Draws Figs. 8 and 10, a row of pictures for each pair; returns what they show, from left to right."""
    rows, names = [], []
    for pair in pairs:
        variants = variants_of(model, pair, models)
        names = [name for name in DRAWN if name in variants]
        posed = variants["AgentDress"][1].posed(pair.pose)
        garments = [("", variants[name][0].drape(posed)) for name in names]
        rows.append(draw_errors(posed, model.garment.faces, pair.worn, garments, PICTURE_SIZE))
    pictures.write_png(path, np.concatenate(rows, axis=0))
    return ["simulation", *names]


def main() -> None:
    """Settles what the test set lacks, measures, records, draws and writes the page."""
    options = parse_options(
        __doc__,
        "anchors",
        "test",
        others=([], "drapes of other materials"),
        beside=([], "models of the garment to play beside, by name or file"),
        pairs=(400, "number of poses with lifted arms, each with a random body"),
        played=(24, "number of poses of each clip as played, on the mean body and on random ones"),
        seed=0,
        jobs=1,
    )
    use_threads(1)
    dataset = leave_out_faulty(open_dataset(options.anchors))
    garment, anchors = dataset.garment, AnchorSet.of(dataset)
    model = fit(dataset, materials=[leave_out_faulty(open_dataset(folder)) for folder in options.others])
    rigged = system = None
    with suppress(BadDataset):  # no anchor has derivatives
        rigged = RiggedAnchors.search(dataset, rows_with_derivatives(dataset), model, anchors)
        system = PaperSystem.fit(dataset)
    pairs = list(settle_pairs(options.test, garment, count=options.pairs, seed=options.seed, jobs=options.jobs))
    rigging: dict[str, PoseModel] = {"rigging": rigged} if rigged else {}
    beside = {Path(name).stem: hemline.load(name) for name in options.beside}
    fewer = anchors.subset(np.arange(len(anchors.rotations)), np.empty(0, int))
    alone = fit_anchors(garment, fewer, AgentDressConfig(), progress=lambda *_: None)
    alone = replace(alone, stretch_limit=model.stretch_limit)
    plays = {OURS: model, f"{OURS}, arms lifted": replace(model, lift_deg=LIFT_DEG), f"{OURS}, anchors alone": alone}
    plain = {
        "ridge": ridge_regression(anchors),
        "blend of five": blend_nearest(model, anchors),
        "nearest": nearest_anchor(model, anchors),
    }
    random = errors_on_random_bodies(model, pairs, rigging, system)
    by_size = errors_by_anchor_count(garment, anchors, rigged, system, pairs)
    by_size[len(anchors.rotations)] = {name: float(np.mean(each)) for name, each in random.items()}
    loose = [pair.betas[0] <= LOOSE for pair in pairs]
    order = np.argsort(random["AgentDress"])
    some = [pairs[order[len(order) // 2]], pairs[order[9 * len(order) // 10]], pairs[order[-1]]]
    row = {
        "garment": garment.name,
        "anchors": len(anchors.rotations),
        "poses": len(anchors.rotations) + len(anchors.single_rotations),
        "rigged": len(rigged.rotations) if rigged else 0,
        "rigging_stiffness": rigged.stiffness if rigged else None,
        "rigging_validation_mm": round(rigged.validation_mm, 2) if rigged else None,
        "rigging_played_mm": round(float(np.mean(model_errors_mm(with_rigging(rigged), pairs))), 2) if rigged else None,
        "random_bodies": _count_random_bodies(dataset, anchors),
        "pairs": len(pairs),
        "loose_pairs": sum(loose),
        "loosest": LOOSE,
        "without_rest": len(choose_pairs(options.pairs, options.seed, garment.body_name)) - len(pairs),
        "random_bodies_mm": _summary(random),
        "loose_bodies_mm": _summary(
            {
                name: [error for error, is_loose in zip(each, loose, strict=True) if is_loose]
                for name, each in random.items()
            }
        ),
        "mean_body_mm": _summary(errors_on_mean_body(model, pairs, rigging | plain)),
        "steadiness_mm": round(_steadiness_mm(options.test, model, pairs, options.seed, options.jobs), 2),
        "by_anchors_mm": {
            size: {name: round(value, 2) for name, value in errors.items()} for size, errors in by_size.items()
        },
        "played": _played(options, garment, plays | beside, system),
        "paper_left_out_mm": round(system.left_out_mm, 2) if system else None,
        "drawn": draw_pairs(PAGES / f"errors-{garment.name}-pairs.png", model, some, rigging),
    }
    (row,) = record(NAME, row)
    draw_curve(row)
    print(write_page(row))


def _count_random_bodies(dataset: Dataset, anchors: AnchorSet) -> int:
    """Returns the number of bodies with betas that no anchor has."""
    known = anchors.betas.shape[1]
    return sum(any(row.betas[known:]) for row in dataset.anchors())


def _summary(errors: Errors) -> dict[str, list[float]]:
    """Returns mean, 90th percentile and maximum over the pairs."""
    return {
        name: [round(float(value), 2) for value in (np.mean(each), np.percentile(each, 90), np.max(each))]
        for name, each in errors.items()
        if each
    }


def _played(
    options: Namespace, garment: Garment, models: dict[str, AnimatorAgentDress], system: PaperSystem | None
) -> Row:
    """Returns the errors as played on the mean body and on random ones, in the walk and in all clips [mm]."""
    how = {"count": options.played, "seed": options.seed, "jobs": options.jobs}
    folder, by_name = Path(f"{options.test}-played"), {}
    worn = {kind: list(settle_as_played(folder, garment, random=kind, **how)) for kind in (False, True)}
    for settled in worn.values():
        walking = [each.clip == WALKING for each in settled]
        for name, errors in errors_as_played(models, system, settled).items():
            means = np.mean(np.array(errors)[walking]), np.mean(errors)
            by_name.setdefault(name, []).extend(round(float(mean), 2) for mean in means)
    everything = [each for settled in worn.values() for each in settled]
    return {
        "poses": len(worn[False]),
        "random_poses": len(worn[True]),
        "clips": len({each.clip for each in everything}),
        "pinched_percent": 100 * float(np.mean([each.pinched for each in everything])) / len(garment.vertices),
        "errors_mm": by_name,
        "in_motion_mm": {
            name: round(float(np.mean(each)), 2)
            for name, each in in_motion.distances_in_motion(
                Path(f"{options.test}-in-motion"), models, system, jobs=options.jobs
            ).items()
        },
    }


def _steadiness_mm(folder: Path, model: AnimatorAgentDress, pairs: Sequence[Pair], seed: int, jobs: int) -> float:
    """Returns how far a settled garment moves relative to skinning when every joint rotates by a degree [mm]."""
    some, body, binding = pairs[:NEARBY], load_body(model.body_name).shaped(), binding_of(model)
    poses, rest, distances = [pair.pose for pair in some], model.tables.rest, []
    turn = float(np.radians(TURN_DEG))
    for number, pose, vertices in settle_nearby(folder, model.garment, poses, turn=turn, seed=seed, jobs=jobs):
        before = binding.offsets(body.posed(poses[number]).transforms, rest, some[number].mean)
        after = binding.offsets(body.posed(pose).transforms, rest, vertices)
        distances.append(mean_distance_mm(after, before))
    return float(np.mean(distances))


if __name__ == "__main__":
    main()
