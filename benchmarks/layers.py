"""Measures layered garments before and after they are kept apart: `python -m benchmarks.layers`.

Each pair is played twice on a clip: first each garment is kept out of the body alone, then the outer one is kept out
of the inner one, too. A vertex is behind if it is inside the inner garment, closed at its rims (`collide/layers`), by
winding numbers in float64. Stretch is that of the outer garment's edges. Times are medians on one thread. Writes
docs/layers.md and docs/layers.webp, and one JSON line per clip to benchmarks/results/layers.jsonl.
"""

import argparse
import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from hemline import Player, bodies, metrics, motions, pictures
from hemline.animators import Animator, Wearable, load, together
from hemline.bench.machine import commit, machine
from hemline.collide import LayeredProjector, Projector, inside
from hemline.collide.layers.closed_cloth import ClosedCloth
from hemline.garments import load as load_garment
from hemline.garments import split_pieces, wear_together
from hemline.meshes import rest_lengths

ROOT = Path(__file__).parents[1]
PAGE, PICTURE, RESULTS = (
    ROOT / "docs" / "layers.md",
    ROOT / "docs" / "layers.webp",
    ROOT / "benchmarks" / "results" / "layers.jsonl",
)
COLOURS = ((0.25, 0.45, 0.75), (0.85, 0.55, 0.25))
"""Colours of the inner and the outer garment."""
FPS = 30.0


@dataclass(frozen=True)
class Case:
    """Pair of an inner and an outer garment with the model that plays them and a clip."""

    inner: str
    outer: str
    clip: str
    model: str | None = None
    """Model that plays any garment; None for the models of these names."""

    @property
    def title(self) -> str:
        """Name of the case on the page."""
        return f"{self.outer} over {self.inner}, {self.clip}"

    def animator(self, body: bodies.ShapedBody) -> Animator:
        """Returns an animator of both garments together."""
        if self.model is None:
            return together([load_with_garment(self.inner), load_with_garment(self.outer)])
        model = load(self.model)
        assert isinstance(model, Wearable)
        return model.animator_for(wear_together([load_garment(self.inner), load_garment(self.outer)]), body)


CASES = (
    Case("trousers-light", "skirt", "walk"),
    Case("trousers-light", "skirt", "dance"),
    Case("tshirt-light", "cape", "dance"),
    Case("trousers-light", "dress-light", "walk", "lag"),
    Case("trousers-light", "skirt-light", "walk", "live"),
    Case("tshirt-light", "dress-light", "walk", "lag"),
    Case("tshirt-light", "cape-light", "dance", "lag"),
)


def load_with_garment(name: str) -> Animator:
    """Loads a model with a garment of its own."""
    model = load(name)
    assert isinstance(model, Animator)
    return model


def measure(case: Case, frames: int) -> tuple[dict[str, Any], np.ndarray]:
    """Returns the figures of a case, and pictures of its worst frame before and after."""
    body, clip = bodies.load("anny24").shaped(), motions.load(case.clip).resample(FPS)
    player = Player.prepare(case.animator(body), body)
    projector, garment = player.projector, player.garment
    assert isinstance(projector, LayeredProjector)
    alone = replace(
        player,
        projector=Projector.prepare(body, garment.vertices, garment.faces, measure=False, on_body=projector.on_body),
    )
    inner, outer = split_pieces(garment)
    closed, start = ClosedCloth.of(len(inner.vertices), inner.faces), len(inner.vertices)
    edges, lengths = rest_lengths(outer.faces, outer.rest_edges)
    states, rows, strains, times, worst = [each.start(clip[0]) for each in (alone, player)], [], [], [], (-1, None)
    for index in range(min(frames, len(clip))):
        shown = []
        for at, each in enumerate((alone, player)):
            states[at], frame = each.step(states[at], clip[index], 1 / FPS)
            shown.append(frame)
        before, after = (
            inside(closed.vertices(frame.vertices[:start]), closed.faces, frame.vertices[start:]) for frame in shown
        )
        buried = inside(shown[1].body.vertices, shown[1].body.faces, shown[1].vertices[start:])
        pinched = shown[1].report.pinched
        buried[pinched[pinched >= start] - start] = False
        rows.append((before.mean(), after.mean(), len(shown[1].report.caught), buried.sum()))
        strains.append([metrics.stretch_percent(f.vertices[start:], edges, lengths) for f in shown])
        times.append((sum(shown[0].milliseconds.values()), shown[1].milliseconds["layers"]))
        if before.sum() > worst[0]:
            worst = int(before.sum()), [(frame.body, frame.vertices) for frame in shown]
    counts, stretch = np.array(rows), np.array(strains)
    assert worst[1] is not None
    made = [_picture(posed, vertices, inner.faces, outer.faces, start) for posed, vertices in worst[1]]
    row = {
        "case": case.title,
        "by": case.model
        or " + ".join(part.name for part in (load_with_garment(case.inner), load_with_garment(case.outer))),
        "vertices": len(outer.vertices),
        "frames": len(rows),
        "behind_percent": [100 * counts[:, 0].mean(), 100 * counts[:, 0].max()],
        "behind_after_percent": [100 * counts[:, 1].mean(), 100 * counts[:, 1].max()],
        "behind_not_reported": round(float((counts[:, 1] * len(outer.vertices)).sum() - counts[:, 2].sum())),
        "inside_body": int(counts[:, 3].sum()),
        "stretch_p99_percent": [float(stretch[:, at, 0].mean()) for at in (0, 1)],
        "too_long_percent": [float(stretch[:, at, 1].mean()) for at in (0, 1)],
        "frame_ms": float(np.median([one for one, _ in times])),
        "layers_ms": float(np.median([added for _, added in times])),
    }
    return row, pictures.side_by_side(made, [f"{case.title}: out of the body", "and out of the garment beneath"])


def _picture(posed: bodies.PosedBody, vertices: np.ndarray, inner: np.ndarray, outer: np.ndarray, start: int):
    meshes = [
        (posed.vertices, posed.faces, "body"),
        (vertices[:start], inner, COLOURS[0]),
        (vertices[start:], outer, COLOURS[1]),
    ]
    return pictures.picture_of(meshes, ["three_quarter", "side"], size=(320, 420))


def page(rows: list[dict[str, Any]]) -> str:
    """Returns the page docs/layers.md."""
    unreported = sum(row["behind_not_reported"] for row in rows)
    buried = sum(row["inside_body"] for row in rows)
    head = (
        "# Garments over garments\n\n"
        "`hemline animate trousers-light --over skirt -m dance` combines two models; `hemline animate lag --garment "
        "trousers-light --over dress-light -m walk` combines two garments of one model. In the order of `--over`, each "
        "garment is kept out of the body and of the garments beneath it: "
        "[how](../src/hemline/collide/layers/README.md). `lag` and `live` settle garments together first. If they "
        "intersect where they were made, such as a dress with sleeves over a shirt, they settle one by one and are "
        "moved apart before playing.\n\n"
        "![Before and after](layers.webp)\n\n"
        f"Measured by `python -m benchmarks.layers` on {rows[-1]['machine']}, one thread. *Behind* is the fraction of "
        "vertices of the outer garment that are inside the inner one, closed at its rims; the report of each frame "
        "names those that remain (`caught`). *Before* means kept out of the body only, *after* also out of the inner "
        f"garment. In all rows, {unreported} vertices behind were not reported, and {buried} were inside the body "
        "without being pinched.\n\n"
        "| outer over inner, clip | models | behind before, mean [%] | behind after, mean [%] "
        "| behind after, worst [%] | edges over 30 % too long, after [%] | added time [ms] |\n"
        "|---|---|---|---|---|---|---|\n"
    )
    return head + "".join(_line(row) for row in rows)


def _line(row: dict[str, Any]) -> str:
    before, after = row["behind_percent"], row["behind_after_percent"]
    return (
        f"| {row['case']} | {row['by']} | {before[0]:.2f} | {after[0]:.3f} | {after[1]:.3f} "
        f"| {row['too_long_percent'][1]:.3f} | {row['layers_ms']:.1f} |\n"
    )


def main() -> None:
    """Measures, prints and writes."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=150, help="Number of frames of each clip, at 30 frames/s.")
    parser.add_argument(
        "--only", nargs="*", metavar="CASE", help="Cases to measure, as named on the page; other rows are kept."
    )
    parser.add_argument("--pictures", type=Path, help="Folder for a picture of each case.")
    options, rows, shown = parser.parse_args(), [], []
    known = {row["case"]: row for row in map(json.loads, RESULTS.read_text().splitlines())} if options.only else {}
    for case in CASES:
        if options.only and case.title not in options.only:
            rows += [known[case.title]] if case.title in known else []
            continue
        row, picture = measure(case, options.frames)
        rows.append(row | {"machine": machine(), "commit": commit()})
        shown.append(picture)
        if options.pictures:
            options.pictures.mkdir(parents=True, exist_ok=True)
            pictures.write_png(options.pictures / f"{case.inner}_{case.outer}_{case.clip}.png", picture)
        print(_line(row), end="", flush=True)
    RESULTS.write_text("".join(json.dumps(row) + "\n" for row in rows))
    PAGE.write_text(page(rows))
    if not options.only:
        pictures.write_webp(PICTURE, shown, fps=0.5)


if __name__ == "__main__":
    main()
