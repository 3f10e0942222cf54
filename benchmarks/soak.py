"""Many garments through many recordings, looking for what breaks: `python -m benchmarks.soak [GARMENT ...]`.

Light cape, skirt, T-shirt and trousers over all recordings of ../shared/data/motion, their large siblings over twenty
of them, every garment that `wearing.py` put on the body over five; the most violent five seconds of each recording.
Takes go to out/soak/GARMENT, a dataset each, which is continued where it was stopped; one JSON line a take goes to
benchmarks/results/soak.jsonl, pictures of failures and of each garment's worst takes to docs/wardrobe/soak/. `--table`
prints what is there.

A take fails where the simulator says so, where a vertex is not finite or farther from the pelvis than cloth can be
(`FARTHEST_BODY`), where one is inside the body that is not pinched, where an opening of the garment lost its limb for good,
or where a limb is through cloth at its end (`still_worn.py`). In one frame a take, the one with most crossings, libigl
counts the vertices inside, and those of the body that stand out of the cloth.
"""

import argparse
import json
import time
from collections.abc import Iterable
from pathlib import Path

import igl
import numpy as np

from benchmarks.clips import MOTION, every_clip, fastest, spread
from benchmarks.standing_out import standing_out
from benchmarks.still_worn import still_worn
from hemline import bodies, garments, motions, pictures
from hemline.bench.machine import commit, machine
from hemline.datasets import Dataset, Row, Take, open_dataset
from hemline.errors import HemlineError
from hemline.garments import Garment
from hemline.meshes import crossing_edges
from hemline.sim import Clip, produce

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / "benchmarks" / "results" / "soak.jsonl"
PICTURES = ROOT / "docs" / "wardrobe" / "soak"
OUT = ROOT / "out" / "soak"
LIGHT, LARGE = (
    ("cape-light", "skirt-light", "tshirt-light", "trousers-light"),
    ("cape", "skirt", "tshirt", "trousers"),
)
SECONDS = 5.0
OFTEN, SELDOM = 20, 5
"""Recordings for a large garment, and for each of a stranger."""
AT_ONCE = 20
"""Takes until lines are written."""
EVERY = 5
"""Frames from one that is looked at closely to the next."""
FARTHEST = 3.0
"""A vertex that is farther from the pelvis flew off [m]."""
STANDS_OUT = 0.002
"""A vertex of the body that stands so far out of the cloth is counted [m]."""
FIGURES = (
    "edge_strain_p99",
    "edge_tension_p99",
    "edge_strain_max",
    "inside",
    "deepest_mm",
    "pinched",
    "residual_share",
    "self_crossing_percent",
    "self_crossing_percent_max",
)


def clips_of(name: str, files: list[Path]) -> list[Path]:
    """The recordings that a garment goes through."""
    if name in LIGHT:
        return files
    return spread(files, OFTEN if name in LARGE else SELDOM)


def strangers() -> dict[str, Path]:
    """The garments that `wearing.py` kept and found worn, by folder and file, as two have the same file name."""
    from benchmarks.wearing import DATA, KEPT, done

    rows = [mesh for (mesh, shape), row in done().items() if shape == 0 and row["reason"] is None]
    kept = [KEPT / f"{(DATA / mesh).parent.name}-{Path(mesh).name}.safetensors" for mesh in sorted(rows)]
    return {file.stem: file for file in kept if file.exists()}


def _clip(file: Path) -> str:
    return file.relative_to(MOTION).with_suffix("").as_posix()


def known() -> dict[tuple[str, str], dict]:
    """Lines that are there, by garment and clip."""
    if not RESULTS.exists():
        return {}
    rows = [json.loads(line) for line in RESULTS.read_text().splitlines()]
    return {(row["garment"], row["clip"]): row for row in rows}


def soak(name: str, garment: Garment, files: Iterable[Path], jobs: int) -> None:
    """One garment through the recordings that have no line yet, a few at a time."""
    there = known()
    files = [file for file in files if (name, _clip(file)) not in there]
    for first in range(0, len(files), AT_ONCE):
        _soak(name, garment, files[first : first + AT_ONCE], jobs)


def _soak(name: str, garment: Garment, files: list[Path], jobs: int) -> None:
    clips = [Clip(fastest(file, SECONDS), motions.subject_of(file)) for file in files]
    began = time.perf_counter()
    try:
        rows = produce(OUT / name, garment, clips, jobs=jobs, quantised=True)
    except HemlineError as error:
        for file in files:
            _note({"garment": name, "clip": _clip(file), "take": "", "failed": str(error)})
        return
    print(f"{name}: {len(rows)} takes in {time.perf_counter() - began:.0f} s", flush=True)
    dataset = open_dataset(OUT / name)
    for file, row in zip(files, rows, strict=True):
        _note({"garment": name, "clip": _clip(file), **judged(dataset, row, f"{name}-{file.stem}")})


def _note(row: dict) -> None:
    with RESULTS.open("a") as stream:
        stream.write(json.dumps(row | {"machine": machine(), "commit": commit()}) + "\n")
    print(f"{row['garment']:<44}{row['clip']:<24}{row['failed'] or 'ok'}", flush=True)


def judged(dataset: Dataset, row: Row, title: str) -> dict:
    """Figures of a take and why it failed, if it did; then a picture is drawn of its last or its worst frame."""
    take, garment = dataset.take(row), dataset.garment
    crossed = [len(crossing_edges(frame, garment.faces)) for frame in take.vertices[::EVERY]]
    worst = EVERY * int(np.argmax(crossed))
    shaped = bodies.load(garment.body_name).shaped(take.betas)
    worn = still_worn(take, garment, shaped, EVERY)
    body = shaped.posed(take.motion[worst])
    turns = np.abs(
        igl.winding_number(
            body.vertices.astype(np.float64), body.faces.astype(np.int64), take.vertices[worst].astype(np.float64)
        )
    )
    out = standing_out(take.vertices[worst], garment.faces, body.vertices, body.normals) > STANDS_OUT
    failed = take.failed or _broken(take)
    at = len(take.vertices) - 1 if take.failed else worst
    if not failed and worn.lost:
        at, joint = worn.lost
        failed = f"frame {at}: nothing goes through its opening near the {joint} any more"
    if not failed and worn.at_end:
        at, joint = worn.at_end
        failed = f"frame {at}: the limb below the {joint} is through its cloth, to the end"
    if failed:
        PICTURES.mkdir(parents=True, exist_ok=True)
        _draw(take, garment, shaped, at).save(PICTURES / f"{title}.png")
    return {
        "vertices": len(garment.vertices),
        "take": row.name,
        "frames": row.frames,
        "failed": failed,
        "figures": {key: round(float(take.figures[key]), 5) for key in FIGURES},
        "worst_frame": worst,
        "inside_by_libigl": int((turns > 0.5).sum()),
        "pinched_then": int(take.pinched[worst]),
        "body_vertices_out": int(out.sum()),
        "limb_through_percent": round(worn.through_percent, 2),
        "limb_through_at_end": worn.at_end is not None,
    }


def _broken(take: Take) -> str | None:
    """What is wrong with a take of which the simulator does not say so."""
    away = np.linalg.norm(take.vertices - take.motion.translations[:, None], axis=2).max(axis=1)
    lost = np.flatnonzero(~(away < FARTHEST))
    if len(lost):
        return f"frame {lost[0]}: a vertex is {away[lost[0]]:.1f} m from the pelvis"
    if take.figures["inside"]:
        return f"{take.figures['inside']:.0f} vertices inside the body in one frame"
    return None


def _draw(take: Take, garment: Garment, shaped, frame: int):
    from PIL import Image

    body = shaped.posed(take.motion[frame])
    drawn = [(body.vertices, body.faces, "body"), (take.vertices[frame], garment.faces, "cloth")]
    return Image.fromarray(pictures.picture_of(drawn, size=(360, 460)))


def worst_takes(name: str, count: int) -> tuple[list[np.ndarray], list[str]]:
    """Pictures and captions of those takes of a garment in which most edges cross, each at its worst frame."""
    rows = [row for row in known().values() if row["garment"] == name and row["take"]]
    worst = sorted(rows, key=lambda row: -row["figures"]["self_crossing_percent_max"])[:count]
    dataset = open_dataset(OUT / name) if (OUT / name).exists() else None
    made = {row.name for row in dataset.rows()} if dataset else set()
    if dataset is None or not made.issuperset(row["take"] for row in worst):
        print(f"{name}: its worst takes are not in out/soak, so they are not drawn")
        return [], []
    tiles = []
    for row in worst:
        take = dataset.take(row["take"])
        shaped = bodies.load(dataset.garment.body_name).shaped(take.betas)
        tiles.append(np.asarray(_draw(take, dataset.garment, shaped, row["worst_frame"])))
    shares = [row["figures"]["self_crossing_percent_max"] for row in worst]
    return tiles, [f"{name}, {row['clip']}, {share:.2g} %" for row, share in zip(worst, shares, strict=True)]


def draw_worst(names: Iterable[str]) -> None:
    """A picture of three takes for each garment by name; one of a take each for those of strangers."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    tiles, captions = [], []
    for name in names:
        named = name in (*LIGHT, *LARGE)
        some, said = worst_takes(name, 3 if named else 1)
        if named and some:
            pictures.write_webp(PICTURES / f"{name}.webp", [pictures.side_by_side(some, said)], 1.0)
        elif not named:
            tiles += [each[::2, ::2] for each in some]
            captions += [name.partition("-")[2] for _ in said]
    if tiles:
        lines = [pictures.side_by_side(tiles[at : at + 8], captions[at : at + 8]) for at in range(0, len(tiles), 8)]
        wide = max(line.shape[1] for line in lines)
        lines = [np.pad(line, ((0, 0), (0, wide - line.shape[1]), (0, 0)), constant_values=255) for line in lines]
        pictures.write_webp(PICTURES / "strangers.webp", [np.concatenate(lines)], 1.0)


def table() -> None:
    """One line a garment."""
    print("| garment | vertices | takes; frames | failed | inside | crossings %, mean; worst | out | through | by |")
    print("|---|---|---|---|---|---|---|---|---|")
    rows = list(known().values())
    for name in dict.fromkeys(row["garment"] for row in rows):
        of = [row for row in rows if row["garment"] == name]
        made, commits = [row for row in of if row["take"]], ", ".join(dict.fromkeys(row["commit"] for row in of))
        failed = sum(row["failed"] is not None for row in of)
        if not made:
            print(f"| {name} | - | {len(of)} | {failed} | - | - | - | - | {commits} |")
            continue
        crossing = [row["figures"]["self_crossing_percent"] for row in made]
        inside = max(row["figures"]["inside"] for row in made)
        out = np.mean([row["body_vertices_out"] for row in made])
        known_ends = [row["limb_through_at_end"] for row in made if "limb_through_at_end" in row]
        through = f"{sum(known_ends)} of {len(known_ends)}" if known_ends else "-"
        print(
            f"| {name} | {made[0]['vertices']} | {len(of)}; {sum(row['frames'] for row in made)} | {failed} "
            f"| {inside:.0f} | {np.mean(crossing):.2f}; {max(crossing):.2f} | {out:.1f} | {through} | {commits} |"
        )
    for row in rows:
        if row["failed"]:
            print(f"- {row['garment']}, {row['clip']}: {row['failed']}")


def main() -> None:
    """Parse, soak, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help="garments by name or mesh file; none: all")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    parser.add_argument("--table", action="store_true", help="only print what is there")
    arguments = parser.parse_args()
    kept = strangers()
    names = arguments.names or [*LIGHT, *LARGE, *kept]
    if not arguments.table:
        files = every_clip()
        for name in names:
            garment = Garment.load(kept[name]) if name in kept else garments.load(name)
            soak(name, garment, clips_of(name, files), arguments.jobs)
        draw_worst(names)
    table()


if __name__ == "__main__":
    main()
