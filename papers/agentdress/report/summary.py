"""The summary of all experiments on AgentDress: the paper, the goals of this project, and the measurements."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

from papers.agentdress import (
    arm_lift,
    beyond,
    damping,
    errors,
    limits,
    loose_shapes,
    sampling,
    separability,
    shape_models,
    watched,
)
from papers.agentdress.models import in_motion
from papers.report import ROOT, Page, Row, last_row, latest_rows, mean_of, read_rows, verdict

PAGES = ROOT / "papers" / "agentdress" / "pages"
GARMENT = "tshirt-light"
GARMENTS = (GARMENT, "longsleeve-light", "trousers-light")
PAPER, OURS = "the paper's system", "AgentDress, as shown"
"""Names of the paper's system, and of ours as it is played, among what is measured."""
FIGURES_PAGE = "[figures](../../../docs/figures.md)"


@dataclass(frozen=True)
class Figure:
    """One measured number.

    Attributes:
        what: Description of the number.
        value: The number.
        unit: Unit of the number.
        paper: Report of the paper, in words or as a number of the same unit.
        at_most: Goal: the largest wanted value.
        at_least: Goal: the least wanted value.
    """

    what: str
    value: float
    unit: str
    paper: str = ""
    at_most: float | None = None
    at_least: float | None = None

    @property
    def cells(self) -> list[str | float]:
        """Description, paper, goal, value, unit and verdict."""
        value, goal, reached = float(f"{self.value:.3g}"), "", ""
        for sign, limit in (("<=", self.at_most), (">=", self.at_least)):
            if limit is not None:
                goal = f"{sign} {limit:.3g}"
                side = {"at_most": limit} if sign == "<=" else {"at_least": limit}
                reached = verdict(self.value, **side)
        return [self.what, self.paper, goal, value, self.unit, reached]


def write_pages() -> None:
    """Writes all pages again from the recorded rows, without their pictures."""
    for garment in GARMENTS:
        errors.write_page(last_row(errors.NAME, garment=garment))
        watched.write_page(last_row(watched.NAME, garment=garment))
    for module in (beyond, limits, loose_shapes, sampling):
        module.write_page(last_row(module.NAME))
    shape_models.write_page(last_row(shape_models.NAME, random_betas=shape_models.PAPER_BETAS))
    arm_lift.write_page(latest_rows(arm_lift.NAME, "garment"))
    damping.write_page(latest_rows(damping.NAME, "decay_seconds"))
    separability.write_page(latest_rows(separability.NAME, "start"))
    write_summary()


def write_summary() -> str:
    """Writes papers/agentdress/pages/experiments.md; returns the text."""
    of_errors = last_row(errors.NAME, garment=GARMENT)
    machines, lines = set(), []
    for row, page, figures in _all_figures(of_errors):
        machines.add(row["machine"])
        lines += [[*figure.cells, page, row["commit"]] for figure in figures]
    page = Page("All experiments on AgentDress")
    page.text(f"""
        Written by `python -m papers.agentdress.experiments FOLDER --motion FILE...`, which also makes the data and runs
        all experiments of this page. Each row names the commit of its measurement; the machine is
        {" or ".join(sorted(machines))}. The light T-shirt has 3,150 vertices. Goals are those of this project, not of
        the paper.
    """)
    page.text(f"""
        Differs: the paper has 150 anchors on 17 shapes. Here there are {of_errors["anchors"]} anchors,
        {of_errors["poses"]} poses on the mean shape, and {of_errors["random_bodies"]} random bodies in one of these
        poses each; the effect of the shape is learned from all of them. The test set consists of {of_errors["pairs"]}
        pairs of a pose of people who appear in no fit and one of 16 random bodies, where the paper has 16 bodies in 400
        poses each.
    """)
    columns = ("figure", "paper", "goal", "measured", "unit", "verdict", "page", "commit")
    page.table({name: "g" if name == "measured" else "" for name in columns}, lines)
    return page.write(PAGES / "experiments.md")


def _all_figures(of_errors: Row) -> Iterator[tuple[Row, str, list[Figure]]]:
    """Yields rows, links to their pages, and figures."""
    yield of_errors, f"[errors](errors-{GARMENT}.md)", list(_of_errors(of_errors))
    row = last_row("agentdress_model_files", model=GARMENT)
    yield (
        row,
        "[notes](notes.md#distances-between-bodies)",
        [
            Figure("shipped model, random bodies in new poses", row["random_bodies_mm"]["AgentDress"], "mm", at_most=8),
            Figure("shipped model, mean body", row["mean_body_mm"]["kernel regression"], "mm", at_most=5),
        ],
    )
    row = last_row(shape_models.NAME, random_betas=shape_models.PAPER_BETAS)
    yield row, "[shape models](shape_models.md)", list(_of_shape_models(row))
    row = last_row(sampling.NAME)
    yield row, "[sampling](sampling.md)", list(_of_sampling(row))
    rows = latest_rows(separability.NAME, "start")
    yield rows[0], "[separability](separability.md)", list(_of_separability(rows))
    row = next(row for row in reversed(read_rows(damping.NAME)) if row["decay_seconds"] == damping.DEFAULT)
    mean, worst = mean_of(row["clips"], "jerk_ratio"), max(clip["jerk_ratio"] for clip in row["clips"])
    what, goal = "jerk relative to the simulation (appendix, Fig. 3)", damping.MOST_JERK
    figures = [
        Figure(f"{what}, mean", mean, "1", at_most=goal),
        Figure(f"{what}, worst clip", worst, "1", at_most=goal),
    ]
    yield row, "[damping](damping.md)", figures
    row = last_row(limits.NAME)
    bodies = ("first beta -2", "of Fig. 13", "heaviest")
    figures = [
        Figure(f"error on the body '{name}'", row["by_body"][name]["error_mm"], "mm", "may fail") for name in bodies
    ]
    yield row, "[limits](limits.md)", figures
    row = last_row(loose_shapes.NAME)
    ropes = {
        name: mean_of([each for each in row["rows"] if each["way"] == f"ropes, {name}"], "error_mm")
        for name in ("garment dressed", "redressed")
    }
    better = Figure(
        "skirt of ropes on other shapes, by AgentDress", ropes["redressed"], "mm", at_most=ropes["garment dressed"]
    )
    yield (
        row,
        "[skirt](loose_shapes.md)",
        [Figure("skirt of ropes on other shapes, dressed", ropes["garment dressed"], "mm"), better],
    )
    row = last_row(beyond.NAME)
    yield row, "[beyond](beyond.md)", list(_of_beyond(row))
    for material in ("silk", "denim", "cotton", "wool"):
        row = last_row("agentdress_materials", to=material)
        yield row, "[beyond](beyond.md#material-as-a-third-dimension)", list(_of_material(row))
    row = last_row(watched.NAME, garment=GARMENT)
    yield row, f"[watched](watched-{GARMENT}.md)", list(_of_watched(row))
    for name in ("tshirt", "tshirt-paper-size", "crowd-tshirt"):
        row = last_row(name)
        yield row, FIGURES_PAGE, list(_of_times(name, row["figures"]))


def _of_errors(row: Row) -> Iterator[Figure]:
    if "played" in row:
        yield from _of_played(row["played"]["errors_mm"])
        distances = row["played"]["in_motion_mm"]
        least = distances[in_motion.SETTLED]
        yield Figure(
            f"from a simulation in motion, walk; at rest {least:.1f}", distances[OURS], "mm", at_most=least + 2
        )
    random = {name: values[0] for name, values in row["random_bodies_mm"].items()}
    yield Figure("random bodies in new poses (4.5)", random["AgentDress"], "mm", at_most=8)
    yield Figure(
        "with rigging as pose model", random["rigging as pose model"], "mm", "10.6", at_least=random["AgentDress"]
    )
    if PAPER in random:
        yield Figure("the paper's system, fitted to the same anchors", random[PAPER], "mm", "10.6")
        dressed = 100 * (1 - random["AgentDress"] / random["skinning, dressed on the body"])
        yield Figure("error below skinning that is dressed on the body", dressed, "%", at_least=60)
    order = ("simulation as pose model", "rigging as pose model", "pose model, no shape", "skinning")
    yield Figure(f"with {order[0]}", random[order[0]], "mm", "below rigging", at_most=random[order[1]])
    for before, name in pairwise(order[1:]):
        yield Figure(name, random[name], "mm", f"above {before}", at_least=random[before])
    loose = row["loose_bodies_mm"]["AgentDress"][0]
    yield Figure(f"random bodies, first beta at most {row['loosest']:g}", loose, "mm")
    by_size = [(size, each["AgentDress"]) for size, each in row["by_anchors_mm"].items()]
    for number, (size, error) in enumerate(by_size):
        before = by_size[number - 1][1] if number else None
        yield Figure(f"fit to {size} anchors (Fig. 9)", error, "mm", "falls to 150", at_most=before)
    yield Figure("mean body", row["mean_body_mm"]["kernel regression"][0], "mm", at_most=5)
    yield Figure("change of the simulation, every joint rotated by a degree", row["steadiness_mm"], "mm")


def _of_played(errors: dict[str, list[float]]) -> Iterator[Figure]:
    """Figures of the errors as played, on the mean body in the walk and in all clips, then on random bodies."""
    for name, goals in ((OURS, (3.0, None, None, 6.0)), (PAPER, (None,) * 4)):
        whose = "" if name == OURS else f", {name}"
        where = ("mean body, walk with hanging arms", "mean body", "random bodies, the walk", "random bodies")
        for place, value, goal in zip(where, errors.get(name, ()), goals, strict=False):
            yield Figure(f"as played, {place}{whose}", value, "mm", at_most=goal)


def _of_shape_models(row: Row) -> Iterator[Figure]:
    lower, explained, count = row["lower_than_drape_percent"], row["explained_percent"], row["components"]
    yield Figure("error below DRAPE's, same drapes (4.3, Fig. 7)", lower["all"], "%", "60", at_least=60)
    yield Figure("error below DRAPE's, as played", lower["as played"], "%")
    for name, paper in (("coordinates", "98.6"), ("gradients", "87.2")):
        value = explained[f"{name}, fitted"][count - 1]
        yield Figure(f"variance of {name} in {count} components (Fig. 6)", value, "%", paper)
    yield Figure("reduction of the error by the square term", row["squares_gain_percent"], "%", "3")


def _of_sampling(row: Row) -> Iterator[Figure]:
    names = {"residual_n": "residual", "residual_weights": "residual on the median vertex", "error_mm": "error"}
    for measure, name in names.items():
        for size in sampling.sizes_above_one(row):
            value = sampling.reduction(row, size, measure)
            paper, goal = ("22 to 43", sampling.GOAL) if measure == "residual_n" else ("", None)
            yield Figure(f"{name} below greedy sampling, {size} poses (4.2, Table 2)", value, "%", paper, at_least=goal)


def _of_separability(rows: list[Row]) -> Iterator[Figure]:
    for row in rows:
        if row["start"].startswith("followed"):
            slope, goal = row["slope"]["theoretical"]["plain"], separability.GOAL
            what = f"exponent of the theoretical error, {row['start']} (appendix, Fig. 1)"
            yield Figure(what, slope, "1", "converges to zero", at_least=goal)


def _of_beyond(row: Row) -> Iterator[Figure]:
    left_out, random = row["shape_left_out_mm"], row["random_bodies_mm"]
    blended, kernel = "shape models of five anchors, blended (Eq. 4)", "kernel over pose and shape"
    yield Figure(f"anchors left out, {blended}", left_out[blended], "mm")
    yield Figure(f"anchors left out, {kernel}", left_out[kernel], "mm", "future work", at_most=left_out[blended])
    betas = random["bodies compared by betas alike"]
    yield Figure("random bodies, compared by betas", betas, "mm")
    yield Figure("random bodies, compared by the skin under the garment", random["as it ships"], "mm", at_most=betas)


def _of_material(row: Row) -> Iterator[Figure]:
    error, name = row["error_mm"], row["to"] + ("" if row["known"] else ", never draped")
    yield Figure(f"{name}: without material", error["material left out"], "mm")
    if "mean change" in error:
        yield Figure(f"{name}: mean change of its drapes", error["mean change"], "mm")
    best = min(error[key] for key in ("material left out", "mean change") if key in error)
    yield Figure(f"{name}: kernel over materials", error["told"], "mm", "future work", at_most=best)


def _of_watched(row: Row) -> Iterator[Figure]:
    rows = row["rows"]
    clips = len({each["clip"] for each in rows})
    frames = f"{clips} clips, {len(row['shapes'])} bodies, {sum(each['frames'] for each in rows):,} frames"
    yield Figure(f"inside, not pinched, worst frame ({frames})", max(e["inside_after"] for e in rows), "%", at_most=0)
    yield Figure("covered skin outside the cloth, mean", mean_of(rows, "through"), "%", at_most=0.1)
    yield Figure(
        "covered skin outside the cloth, worst clip and body", max(e["through"] for e in rows), "%", at_most=0.1
    )
    if "longest" not in rows[0]:
        return
    longest = max(each["longest"] for each in rows)
    yield Figure("longest edge of all, over its length on the pattern", longest, "%", at_most=300)
    simulated = [each for each in rows if "simulated" in each]
    truth = mean_of([each["simulated"] for each in simulated], "stretch_p99")
    beside = f"stretch p99, {len(simulated)} of these clips and bodies; in the simulation {truth:.1f}"
    yield Figure(beside, mean_of(simulated, "stretch_p99"), "%", at_most=truth + 2)


def _of_times(name: str, figures: Row) -> Iterator[Figure]:
    if name == "crowd-tshirt":
        yield Figure("a hundred agents on two cores, each", figures["agent_ms"], "ms", at_most=1)
        yield Figure("a hundred agents on two cores, each, half detail", figures["agent_ms_half"], "ms", at_most=1)
        return
    light = name == "tshirt"
    size = (
        "light T-shirt" if light else f"{figures['vertices']:,} vertices, {figures['anchors']} anchors (interpolated)"
    )
    goals = (0.7, 1.5, 2.25) if light else (1.8, 3.5, 5.25)
    frame, paper = figures["frame_ms"], "" if light else "17.9"
    before = figures["before_the_projection_ms"]["median"]
    yield Figure(f"frame on one core, {size}, before the projection", before, "ms", at_most=goals[0])
    yield Figure(f"frame on one core, {size}", frame["median"], "ms", paper, at_most=goals[1])
    yield Figure(f"frame on one core, {size}, p95", frame["p95"], "ms", at_most=goals[2])
    if not light:
        yield Figure("new shape, all anchors", figures["new_shape_ms"], "ms", at_most=100)
    paper, goal = ("", 8) if light else ("56.0 (T-shirt, compressed)", 40)
    yield Figure(f"model file, {size}", figures["model_mb"], "MB", paper, at_most=goal)
