"""Writes docs/making.md about the models of `benchmarks.making`: `python -m benchmarks.making_page [--pictures]`.

Everything on the page is computed from benchmarks/results/making.jsonl. With `--pictures`, the worst frame of each
model is drawn beside the simulation, from out/making, into docs/making.
"""

import argparse
import json
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.making import FOLDER, LIMIT_MS, ROOT, WARDROBE, model_file, rows
from hemline import animators, bodies, pictures
from hemline.animators import Animator
from hemline.datasets import open_dataset
from hemline.make import MakeSettings
from hemline.make.choice import ALIKE, SKIN_SEEN, STRETCH_ABOVE, THROUGH_ABOVE, WORST_ABOVE, faults
from hemline.make.clips import CHECK_CLIP, clean_part
from hemline.make.trial import Trial, run_trial, truth_vertices
from hemline.motions import open_motion

PAGE, PICTURES = ROOT / "docs" / "making.md", ROOT / "docs" / "making"
BLENDS = ROOT / "benchmarks" / "results" / "blends.jsonl"
LONGER_RUNS = ROOT / "benchmarks" / "results" / "making_longer.jsonl"
MINUTES, LONGER = 10.0, 60.0
SIZE = (220, 300)
"""Width and height of a picture [pixels]."""
QUICK_SHARE, QUICK_ERROR, REGRET = 0.2, 1.2, 1.1
"""A model that takes this share of the time of `live` may have this multiple of its error; and the largest regret."""
HEAD = """# What `hemline make` made of a wardrobe

{rows} of the {total} garments of the wardrobe were run. Each went through `hemline make --minutes 10` with one process,
two garments at once on two cores, some beside other programs. The figures are of {seconds:.0f} seconds of `{clip}`, a
clip that nothing was fitted to, beside a fresh simulation of the garment itself. Errors are means over vertices and
frames. `skinned` is the garment moved by the body's skin alone, `live` the simulation of a coarse copy. A model is
sound if no vertex is inside the body, the 99th percentile of its stretch is at most {stretch:.0f} points above that of
the simulation ({worst:.0f} in the worst frame), at most {skin} % of the covered skin shows, and limbs go through the
cloth at most {through} points more often than in the simulation.

`python -m benchmarks.making` makes the models, `python -m benchmarks.making_page --pictures` this page. {machine},
commits {commits}.
"""
COLUMNS: dict[str, Callable[[dict[str, Any]], str]] = {
    "garment": lambda row: row["name"],
    "kind": lambda row: row["kind"],
    "model": lambda row: chosen(row).method,
    "error [mm]": lambda row: f"{chosen(row).error_mm:.1f}",
    "error of `live` [mm]": lambda row: error_of(row, "live"),
    "error of `skinned` [mm]": lambda row: error_of(row, "skinned"),
    "stretch p99 [%]": lambda row: f"{chosen(row).stretch_p99:.0f}",
    "in the simulation [%]": lambda row: f"{row['truth']['stretch_p99']:.0f}",
    "skin seen [%]": lambda row: f"{chosen(row).skin_seen:.2f}",
    "limbs through [%]": lambda row: f"{chosen(row).limbs_through:.1f}",
    "frame [ms]": lambda row: f"{chosen(row).frame_ms:.1f}",
    "file [MB]": lambda row: f"{chosen(row).model_mb:.1f}",
    "made in [s]": lambda row: f"{row['seconds']:.0f}",
    "sound": lambda row: "no" if row["faults"] else "yes",
}


def trials(row: dict[str, Any]) -> dict[str, Trial]:
    """Returns the figures of the methods that played, by name."""
    return {each["method"]: Trial(**each) for each in row["trials"] if not each["failed"]}


def chosen(row: dict[str, Any]) -> Trial:
    """Returns the figures of the method that was chosen."""
    return trials(row)[row["chosen"]]


def error_of(row: dict[str, Any], method: str) -> str:
    """Returns the error of a method [mm]; an empty string if it did not play."""
    found = trials(row).get(method)
    return "" if found is None else f"{found.error_mm:.1f}"


def regret(row: dict[str, Any], limit_ms: float) -> float:
    """Returns the error of the chosen method over the smallest of a sound and fast one; NaN if there is none."""
    truth = Trial(**row["truth"])
    good = [each for each in trials(row).values() if not faults(each, truth) and each.frame_ms <= limit_ms]
    return chosen(row).error_mm / min(each.error_mm for each in good) if good else float("nan")


def holds_against_live(row: dict[str, Any]) -> bool:
    """Returns whether a model errs no more than `live`, or little more in a fifth of the time."""
    model, live = chosen(row), trials(row).get("live")
    if live is None or model.error_mm <= live.error_mm:
        return True
    return model.frame_ms <= QUICK_SHARE * live.frame_ms and model.error_mm <= QUICK_ERROR * live.error_mm


def demands(run: int, made: list[dict[str, Any]], limit_ms: float) -> list[str]:
    """Returns the table of what was asked of all garments and how many fulfil it."""
    regrets = [regret(row, limit_ms) for row in made]
    known = [each for each in regrets if np.isfinite(each)]
    total = len(WARDROBE)
    lines = [
        ("a model", f"{total}", len(made)),
        ("made within ten minutes", f"{total}", sum(row["seconds"] <= 60 * MINUTES for row in made)),
        ("sound", ">= 22", sum(not row["faults"] for row in made)),
        (
            f"error at most that of `live`, or {QUICK_ERROR} times that in a fifth of its time",
            ">= 20",
            sum(holds_against_live(row) for row in made),
        ),
        (
            f"error at most {REGRET} times that of the best sound method below {limit_ms:.0f} ms, "
            f"of {len(known)} garments that have one",
            ">= 22",
            sum(each <= REGRET for each in known),
        ),
        ("smaller error than `skinned`", "", sum(beats_skinned(row) for row in made)),
    ]
    found = [f"| demand | goal, of {total} | measured, of {run} |", "|---|---|---|"]
    return found + [f"| {name} | {goal} | {count} |" for name, goal, count in lines]


def beats_skinned(row: dict[str, Any]) -> bool:
    """Returns whether the chosen method errs less than skinning."""
    skinned = trials(row).get("skinned")
    return skinned is not None and chosen(row).error_mm < skinned.error_mm


def table(made: list[dict[str, Any]]) -> list[str]:
    """Returns the table of all garments."""
    lines = ["| " + " | ".join(COLUMNS) + " |", "|" + "---|" * len(COLUMNS)]
    return lines + ["| " + " | ".join(cell(row) for cell in COLUMNS.values()) + " |" for row in made]


def unsound(made: list[dict[str, Any]]) -> list[str]:
    """Returns what is wrong with each model that is not sound."""
    found = [f"- {row['name']}, by `{row['chosen']}`: {'; '.join(row['faults'])}." for row in made if row["faults"]]
    return ["", "What is wrong with those that are not sound:", "", *found] if found else []


def longer_runs() -> list[str]:
    """Returns the table of garments that were also made in an hour, both models on the same clip."""
    if not LONGER_RUNS.exists():
        return []
    found: dict[str, dict[float, Trial]] = {}
    recorded = [json.loads(text) for text in LONGER_RUNS.read_text().splitlines()]
    commits = ", ".join(sorted({row["commit"] for row in recorded}))
    for row in recorded:
        found.setdefault(row["name"], {})[row["minutes"]] = Trial(**row["trial"])
    lines = [
        "",
        "## An hour instead of ten minutes",
        "",
        "Both models on the clip of the longer run, which is longer than that of the table above "
        f"(`python -m benchmarks.making_longer`, commits {commits}).",
        "",
        "| garment | model after 10 min | error [mm] | model after 60 min | error [mm] | ratio |",
        "|---|---|---|---|---|---|",
    ]
    ratios = []
    for name, by_minutes in found.items():
        before, after = by_minutes[MINUTES], by_minutes[LONGER]
        ratios.append(after.error_mm / before.error_mm)
        lines.append(
            f"| {name} | {before.method} | {before.error_mm:.1f} | {after.method} | {after.error_mm:.1f} "
            f"| {ratios[-1]:.2f} |"
        )
    return [*lines, "", f"Median of the {len(ratios)} ratios: {np.median(ratios):.2f} (goal: at most 0.85)."]


def fitted_trials() -> list[str]:
    """Returns the table of the fitted methods, whether chosen or not."""
    lines = [
        "",
        "## Methods that are fitted",
        "",
        "Errors of the methods that were fitted in the time, beside those that need no fit [mm].",
        "",
        "| garment | minutes | `agentdress` | `ropes` | `lag` | `swingar` | `live` | `skinned` |",
        "|---|---|---|---|---|---|---|---|",
    ]
    order = ("agentdress", "ropes", "lag", "swingar", "live", "skinned")
    for minutes in (MINUTES, LONGER):
        for row in rows(minutes).values():
            if not row["reason"] and {"agentdress", "ropes"} & set(trials(row)):
                cells = " | ".join(error_of(row, method) for method in order)
                lines.append(f"| {row['name']} | {minutes:.0f} | {cells} |")
    return lines


def blends() -> list[str]:
    """Returns what was tried to play one garment by two methods."""
    if not BLENDS.exists():
        return []
    lines = [
        "",
        "## Two methods in one model",
        "",
        "Cloth that hangs by `ropes` and cloth that lies close by `agentdress`, blended by how much each vertex hangs, "
        "as played (`python -m benchmarks.blends`). It would ship if its error were 15 % below that of the better "
        "method alone.",
        "",
        "| garment | hangs [%] | `agentdress` [mm] | `ropes` [mm] | blend [mm] | blend / better one | "
        "`agentdress` p99 [%] | `ropes` p99 [%] | blend p99 [%] | `live` [mm] |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for text in BLENDS.read_text().splitlines():
        row = json.loads(text)
        one, two, both = (row[name] for name in ("agentdress", "ropes", "blend"))
        ratio = both["error_mm"] / min(one["error_mm"], two["error_mm"])
        lines.append(
            f"| {row['name']} | {100 * row['hanging']:.0f} | {one['error_mm']:.1f} | {two['error_mm']:.1f} "
            f"| {both['error_mm']:.1f} | {ratio:.2f} | {one['stretch_p99']:.0f} | {two['stretch_p99']:.0f} "
            f"| {both['stretch_p99']:.0f} | {row['live_mm']:.1f} |"
        )
    return lines


def gallery(made: list[dict[str, Any]]) -> list[str]:
    """Returns the pictures of all models."""
    lines = [
        "",
        "## Worst frames",
        "",
        "The frame with the largest error of each model: the simulation, the model, and the model coloured by its "
        "error.",
        "",
    ]
    for row in made:
        name = row["name"]
        if (PICTURES / f"{name}.webp").exists():
            lines += [f"![{name}](making/{name}.webp)", "", f"{row['kind']}, by `{row['chosen']}`", ""]
    return lines[:-1]


def draw_worst(name: str, minutes: float) -> None:
    """Plays the model of a garment again and draws its worst frame beside the simulation."""
    file = model_file(name, minutes)
    animator = animators.load(file)
    assert isinstance(animator, Animator)
    check, body = open_dataset(file.with_suffix(".making") / "check"), bodies.load(animator.body_name).shaped()
    motion = clean_part(open_motion(CHECK_CLIP))
    truth = truth_vertices(check, motion)
    played = run_trial(animator, body, motion[: len(truth)], check, 0.0)
    worst = played.worst[0]
    frame = played.frames[worst]
    picture = pictures.comparison(
        frame.vertices, truth[worst], animator.garment.faces, body=(frame.body.vertices, frame.body.faces), size=SIZE
    )
    PICTURES.mkdir(exist_ok=True)
    pictures.write_webp(PICTURES / f"{name}.webp", [picture], 1.0)


def page(recorded: dict[str, dict[str, Any]]) -> str:
    """Returns the page in Markdown."""
    made = [row for row in recorded.values() if not row["reason"]]
    settings = MakeSettings(minutes=MINUTES)
    first = made[0]
    head = HEAD.format(
        seconds=settings.check_seconds,
        clip=CHECK_CLIP,
        stretch=STRETCH_ABOVE,
        worst=WORST_ABOVE,
        skin=SKIN_SEEN,
        through=THROUGH_ABOVE,
        machine=first["machine"],
        commits=", ".join(sorted({row["commit"] for row in recorded.values()})),
        rows=len(recorded),
        total=len(WARDROBE),
    )
    refused = [f"- {row['name']}: {row['reason']}" for row in recorded.values() if row["reason"]]
    parts = [head, *demands(len(recorded), made, LIMIT_MS), "", *table(made), *unsound(made)]
    parts += ["", "No model:", "", *refused] if refused else []
    parts += [
        "",
        f"Frames were to take at most {LIMIT_MS:.0f} ms, since two garments at once slow each other down; alone, the "
        f"limit is {settings.ms:.0f} ms. Errors that differ by less than {100 * ALIKE:.0f} % count "
        "as equal, and then the fastest method is chosen.",
        *fitted_trials(),
        *longer_runs(),
        *blends(),
        *gallery(made),
    ]
    return "\n".join(parts) + "\n"


def main() -> None:
    """Writes the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pictures", action="store_true", help=f"Draw the worst frames again, from {FOLDER.name}.")
    options = parser.parse_args()
    recorded = rows(MINUTES)
    if options.pictures:
        for name, row in recorded.items():
            if not row["reason"]:
                draw_worst(name, MINUTES)
    PAGE.write_text(page(recorded))


if __name__ == "__main__":
    main()
