"""The page of all claims about AgentDress: what the paper says, what was asked, what was measured."""

import json
from pathlib import Path
from typing import Any

from hemline.animators.agentdress.config import AgentDressConfig

DECAY = AgentDressConfig().decay_seconds
PAGE = """\
# All claims about AgentDress

Written by `python -m papers.agentdress.claims FOLDER --motion FILE...`, which makes the data, too, and runs
every command of this page. Each row names the commit that it was measured at; all of them on {machines}. The light
T-shirt has 3,150 vertices. "Asked" is the goal of this project, not of the paper.

Differs: the paper has 150 anchors on 17 shapes. Here {anchors} are, {poses} poses on the mean shape, and
{random_bodies} random bodies in one of these poses each; the shape is learned from all of them together. The test set
is {pairs} pairs of a pose of people who are in no fit and one of 16 random bodies, where the paper has 16 bodies in 400
poses each.

| what | the paper | asked | measured | page | commit |
|---|---|---|---|---|---|
{rows}
"""
Row = dict[str, Any]


def write_page(results: Path) -> str:
    """Write papers/agentdress/pages/claims.md.

    Args:
        results: The folder of the rows.

    Returns:
        The page.
    """
    errors = _last(results, "agentdress_errors", garment="tshirt-light")
    lines, machines = [], set()
    for found, what, paper, asked, measured, page in _claims(results, errors):
        machines.add(found["machine"])
        lines.append(f"| {what} | {paper} | {asked} | {measured} | {page} | {found['commit']} |")
    kept = {name: errors[name] for name in ("anchors", "poses", "random_bodies", "pairs")}
    text = PAGE.format(machines=" or ".join(sorted(machines)), rows="\n".join(lines), **kept)
    (results.parents[1] / "papers" / "agentdress" / "pages" / "claims.md").write_text(text)
    return text


def _rows(results: Path, name: str) -> list[Row]:
    return [json.loads(line) for line in (results / f"{name}.jsonl").read_text().splitlines()]


def _last(results: Path, name: str, **wanted: str) -> Row:
    return next(row for row in reversed(_rows(results, name)) if wanted.items() <= row.items())


def _claims(results: Path, errors: Row) -> list[tuple[Row, str, str, str, str, str]]:
    """Row, what, the paper's figure, the goal, ours, the page."""
    return [
        *_of_errors(errors),
        _of_model_file(_last(results, "agentdress_model_files", model="tshirt-light")),
        *_of_experiments(results),
        *_of_watched(_last(results, "agentdress_watched", garment="tshirt-light")),
        *_of_times(results),
    ]


def _of_errors(row: Row) -> list[tuple[Row, str, str, str, str, str]]:
    page, random, mean = "[errors](errors-tshirt-light.md)", row["random_bodies_mm"], row["mean_body_mm"]
    order = ("simulation as pose model", "AgentDress", "rigging as pose model", "pose model, no shape", "skinning")
    told = ", ".join(f"{name} {random[name][0]:.1f}" for name in order)
    curve = ", ".join(f"{each['AgentDress']:.1f}" for each in row["by_anchors_mm"].values())
    sizes = ", ".join(row["by_anchors_mm"])
    falls = [each["AgentDress"] for each in row["by_anchors_mm"].values()]
    loose, floor = row["loose_bodies_mm"]["AgentDress"][0], row["steadiness_mm"]
    return [
        (
            row,
            "random bodies in new poses (4.5)",
            "10.6 mm with rigging",
            "<= 8 mm; rigging stated",
            f"{random['AgentDress'][0]:.1f} mm; rigging {random['rigging as pose model'][0]:.1f}",
            page,
        ),
        (row, f"the same, first beta at most {row['loosest']:g}", "", "its own row", f"{loose:.1f} mm", page),
        (
            row,
            "order of errors (4.5, 4.6, Figs. 8 to 10)",
            "simulation, rigging, no first order, skinning",
            "the same",
            f"{told} mm",
            page,
        ),
        (
            row,
            f"over {sizes} anchors, other poses in proportion (Fig. 9)",
            "falls to 150",
            "falls",
            f"{curve} mm: {'falls' if falls == sorted(falls, reverse=True) else 'does not fall'}",
            page,
        ),
        (
            row,
            "mean body; the truth, every joint turned by a degree",
            "",
            "<= 5 mm",
            f"{mean['kernel regression'][0]:.1f} mm; {floor:.1f}",
            page,
        ),
    ]


def _of_model_file(row: Row) -> tuple[Row, str, str, str, str, str]:
    random, mean = row["random_bodies_mm"], row["mean_body_mm"]
    return (
        row,
        "the model that ships, of 388 random bodies: random bodies in new poses; mean body",
        "",
        "<= 8; 5 mm",
        f"{random['AgentDress']:.1f}; {mean['kernel regression']:.1f} mm",
        "[how far apart bodies are](../../src/hemline/animators/agentdress/README.md#how-far-apart-bodies-are)",
    )


def _of_experiments(results: Path) -> list[tuple[Row, str, str, str, str, str]]:
    shape, limits = _last(results, "agentdress_shape_models"), _last(results, "agentdress_limits")
    near = _last(results, "agentdress_separability", start="followed from the anchor")
    slopes = [
        f"{row['slope']['theoretical']['plain']:.2f}"
        for row in _rows(results, "agentdress_separability")
        if row["commit"] == near["commit"] and row["start"].startswith("followed")
    ]
    slippery = "; without friction" if len(slopes) > 1 else ""
    sampling, loose = _last(results, "agentdress_sampling"), _last(results, "agentdress_loose_shapes")
    decay = next(row for row in reversed(_rows(results, "agentdress_damping")) if row["decay_seconds"] == DECAY)
    beyond, jerks = _last(results, "agentdress_beyond"), [clip["jerk_ratio"] for clip in decay["clips"]]
    explained, by_body = shape["explained_percent"], limits["by_body"]
    lower = shape["lower_than_drape_percent"]
    left_out, random = beyond["shape_left_out_mm"], beyond["random_bodies_mm"]
    blended, kernel = (
        left_out[name] for name in ("shape models of five anchors, blended (Eq. 4)", "kernel over pose and shape")
    )
    materials = [_last(results, "agentdress_materials", to=name) for name in ("silk", "denim", "cotton", "wool")]
    return [
        (
            shape,
            "error below DRAPE's, the same drapes (4.3, Fig. 7)",
            "60 %",
            ">= 60 %",
            f"{lower['all']:.0f} %; as played {lower['as played']:.0f}",
            "[shape models](shape_models.md)",
        ),
        (
            shape,
            "variance in 5 components; of DRAPE's gradients (Fig. 6)",
            "98.6; 87.2 %",
            "",
            f"{explained['coordinates, fitted'][4]:.1f}; {explained['gradients, fitted'][4]:.1f} %",
            "[shape models](shape_models.md)",
        ),
        (
            shape,
            "error lower with the square term",
            "3 %",
            "stated",
            f"{shape['squares_gain_percent']:.0f} %",
            "[shape models](shape_models.md)",
        ),
        (
            sampling,
            f"residual below that of SOR's sampling, {', '.join(_sizes(sampling))} poses (4.2, Table 2)",
            "22 to 43 %",
            ">= 22 %",
            f"{', '.join(_gains(sampling, 'residual_n'))} %; "
            f"on the median vertex {', '.join(_gains(sampling, 'residual_weights'))} %; "
            f"in millimetres {', '.join(_gains(sampling, 'error_mm'))} %",
            "[sampling](sampling.md)",
        ),
        (
            near,
            f"separability near an anchor: exponent of the theoretical error{slippery} (appendix, Fig. 1)",
            "converges to zero",
            ">= 1.5",
            "; ".join(slopes),
            "[separability](separability.md)",
        ),
        (
            decay,
            "jerk against the simulation's, mean; worst clip (appendix, Fig. 3)",
            "",
            "<= 1.5",
            f"{sum(jerks) / len(jerks):.2f}; {max(jerks):.2f}",
            "[damping](damping.md)",
        ),
        (
            limits,
            "too loose, too tight: first beta -2; the body of Fig. 13; the heaviest",
            "may fail",
            "stated",
            "; ".join(f"{by_body[name]['error_mm']:.1f}" for name in ("first beta -2", "of Fig. 13", "heaviest"))
            + " mm",
            "[limits](limits.md)",
        ),
        (
            loose,
            "a skirt of rope chains on other shapes: dressed; by AgentDress",
            "left out",
            "the better is kept",
            f"{_way(loose, 'ropes, garment dressed'):.1f}; {_way(loose, 'ropes, redressed'):.1f} mm",
            "[skirt](loose_shapes.md)",
        ),
        (
            beyond,
            "shape models blended (Eq. 4); a kernel over pose and shape, anchors left out",
            "future work",
            "kept if better",
            f"{blended:.1f}; {kernel:.1f} mm",
            "[beyond](beyond.md)",
        ),
        (
            beyond,
            "random bodies: compared by betas alike; by the skin under the garment",
            "left out",
            "kept if better",
            f"{random['bodies compared by betas alike']:.1f}; {random['as it ships']:.1f} mm",
            "[beyond](beyond.md)",
        ),
        *(
            (
                row,
                _of_material(row),
                "future work",
                "kept if better",
                _told_mm(row),
                "[beyond](beyond.md)",
            )
            for row in materials
        ),
    ]


def _of_watched(row: Row) -> list[tuple[Row, str, str, str, str, str]]:
    rows = row["rows"]
    clips, seen = {each["clip"] for each in rows}, [each["through"] for each in rows]
    frames = sum(each["frames"] for each in rows)
    watched = f"{len(clips)} clips, {len(row['shapes'])} bodies, {frames:,} frames"
    page = "[watched](watched-tshirt-light.md)"
    inside = max(each["inside_after"] for each in rows)
    return [
        (row, f"inside, not pinched, worst frame ({watched})", "", "0", f"{inside:g} %", page),
        (
            row,
            "covered skin outside the cloth: mean; worst of a clip on a body",
            "",
            "<= 0.1 %, then 0",
            f"{sum(seen) / len(seen):.3f}; {max(seen):.3f} %",
            page,
        ),
    ]


def _of_times(results: Path) -> list[tuple[Row, str, str, str, str, str]]:
    light, paper, crowd = (_last(results, name) for name in ("tshirt", "tshirt-paper-size", "crowd-tshirt"))
    page = "[figures](../figures.md)"

    def frame(row: Row) -> str:
        figures = row["figures"]
        whole, before = figures["frame_ms"], figures["before_the_projection_ms"]
        return f"{before['median']:.2f}; {whole['median']:.2f}; {whole['p95']:.2f} ms"

    figures, agents = paper["figures"], crowd["figures"]
    return [
        (
            light,
            "frame, one core: before the projection; whole; p95",
            "17.9 ms (56 FPS) at 12,000",
            "<= 0.7; 1.5; 2.25 ms",
            frame(light),
            page,
        ),
        (
            paper,
            f"the same at {figures['vertices']:,} vertices, {figures['anchors']} anchors (interpolated)",
            "17.9 ms (56 FPS)",
            "<= 1.8; 3.5; 5.25 ms",
            frame(paper),
            page,
        ),
        (paper, "a new shape, all anchors", "", "<= 100 ms", f"{figures['new_shape_ms']:.1f} ms", page),
        (
            paper,
            "model file: light; 12,414 vertices",
            "56.0 MB, compressed (T-shirt)",
            "<= 8; 40 MB",
            f"{light['figures']['model_mb']:.1f}; {figures['model_mb']:.1f} MB",
            page,
        ),
        (
            crowd,
            "a hundred agents, two cores, each; at half detail",
            "",
            "<= 1 ms",
            f"{agents['agent_ms']:.2f}; {agents['agent_ms_half']:.2f} ms",
            page,
        ),
    ]


def _sizes(row: Row) -> list[str]:
    return [size for size in row["found"]["k-means"] if int(size) > 1]


def _gains(row: Row, measure: str) -> list[str]:
    ours, theirs = row["found"]["k-means"], row["found"]["greedy"]
    return [f"{100 * (1 - ours[size][measure] / theirs[size][measure]):.0f}" for size in _sizes(row)]


def _of_material(row: Row) -> str:
    if row["known"]:
        return f"material, {row['to']}: left out; the mean change of its drapes; told"
    return f"material, {row['to']}, never draped: left out; told"


def _told_mm(row: Row) -> str:
    ways = ("material left out", "mean change", "told")
    return "; ".join(f"{row['error_mm'][way]:.1f}" for way in ways if way in row["error_mm"]) + " mm"


def _way(row: Row, name: str) -> float:
    found = [each["error_mm"] for each in row["rows"] if each["way"] == name]
    return sum(found) / len(found)
