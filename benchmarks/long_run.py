"""Simulates many garments on many recordings to find failures: `python -m benchmarks.long_run [GARMENT ...]`.

Light cape, skirt, T-shirt and trousers are simulated on all recordings of ../shared/data/motion, their large versions
on twenty of them, and every garment that `wearing.py` tried on successfully on five; each time on the most violent
five seconds. Each garment has a dataset in out/soak/GARMENT, which is continued after a stop. Writes one JSON line per
take to benchmarks/results/soak.jsonl, and pictures of failures and of each garment's worst takes to
docs/wardrobe/soak/.

A take fails if the simulator reports it, if a vertex is not finite or too far from the pelvis, if an unpinched vertex
is inside the body, if an opening of the garment loses its limb for good, or if a limb is through cloth at the end
(`wear_check.py`). In the frame with most crossings of each take, libigl counts the vertices inside, and body vertices
that protrude from the cloth.
"""

import argparse
import json
import time
from collections.abc import Iterable
from pathlib import Path

import igl
import numpy as np

from benchmarks.clips import MOTION, all_clips, fastest_section, select_evenly
from benchmarks.protrusion import protrusion
from benchmarks.wear_check import check_wear
from hemline import bodies, garments, motions, pictures
from hemline.bench.machine import commit, machine
from hemline.datasets import Dataset, Row, Take, open_dataset
from hemline.errors import HemlineError
from hemline.garments import Garment
from hemline.meshes import crossing_edges
from hemline.sim import ClipRequest, produce

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / "benchmarks" / "results" / "soak.jsonl"
PICTURES = ROOT / "docs" / "wardrobe" / "soak"
OUT = ROOT / "out" / "soak"
LIGHT, LARGE = (
    ("cape-light", "skirt-light", "tshirt-light", "trousers-light"),
    ("cape", "skirt", "tshirt", "trousers"),
)
SECONDS = 5.0
LARGE_CLIPS, TRIED_ON_CLIPS = 20, 5
"""Number of recordings for a large garment, and for a garment that was tried on."""
BATCH = 20
"""Number of takes after which lines are written."""
STRIDE = 5
"""Number of frames between two closely checked ones."""
FARTHEST = 3.0
"""Distance from the pelvis beyond which a vertex has flown off [m]."""
MIN_PROTRUSION = 0.002
"""Protrusion from the cloth beyond which a vertex of the body is counted [m]."""
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
    """Returns the recordings that a garment is simulated on."""
    if name in LIGHT:
        return files
    return select_evenly(files, LARGE_CLIPS if name in LARGE else TRIED_ON_CLIPS)


def tried_on_garments() -> dict[str, Path]:
    """Returns the garments that `wearing.py` tried on successfully, by folder and file name."""
    from benchmarks.wearing import DATA, GARMENTS_FOLDER, recorded_rows

    rows = [mesh for (mesh, shape), row in recorded_rows().items() if shape == 0 and row["reason"] is None]
    files = [GARMENTS_FOLDER / f"{(DATA / mesh).parent.name}-{Path(mesh).name}.safetensors" for mesh in sorted(rows)]
    return {file.stem: file for file in files if file.exists()}


def _clip(file: Path) -> str:
    return file.relative_to(MOTION).with_suffix("").as_posix()


def recorded_rows() -> dict[tuple[str, str], dict]:
    """Returns the recorded lines by garment and clip."""
    if not RESULTS.exists():
        return {}
    rows = [json.loads(line) for line in RESULTS.read_text().splitlines()]
    return {(row["garment"], row["clip"]): row for row in rows}


def run_garment(name: str, garment: Garment, files: Iterable[Path], jobs: int) -> None:
    """Simulates a garment on the recordings that have no line yet, in batches."""
    recorded = recorded_rows()
    files = [file for file in files if (name, _clip(file)) not in recorded]
    for first in range(0, len(files), BATCH):
        _run_clips(name, garment, files[first : first + BATCH], jobs)


def _run_clips(name: str, garment: Garment, files: list[Path], jobs: int) -> None:
    clips = [ClipRequest(fastest_section(file, SECONDS), motions.subject_of(file)) for file in files]
    began = time.perf_counter()
    try:
        rows = produce(OUT / name, garment, clips, jobs=jobs, quantised=True)
    except HemlineError as error:
        for file in files:
            _record({"garment": name, "clip": _clip(file), "take": "", "failed": str(error)})
        return
    print(f"{name}: {len(rows)} takes in {time.perf_counter() - began:.0f} s", flush=True)
    dataset = open_dataset(OUT / name)
    for file, row in zip(files, rows, strict=True):
        _record({"garment": name, "clip": _clip(file), **check_take(dataset, row, f"{name}-{file.stem}")})


def _record(row: dict) -> None:
    with RESULTS.open("a") as stream:
        stream.write(json.dumps(row | {"machine": machine(), "commit": commit()}) + "\n")
    print(f"{row['garment']:<44}{row['clip']:<24}{row['failed'] or 'ok'}", flush=True)


def check_take(dataset: Dataset, row: Row, title: str) -> dict:
    """Returns the figures of a take and its fault; draws the last or the worst frame of a failed take."""
    take, garment = dataset.take(row), dataset.garment
    crossed = [len(crossing_edges(frame, garment.faces)) for frame in take.vertices[::STRIDE]]
    worst = STRIDE * int(np.argmax(crossed))
    shaped = bodies.load(garment.body_name).shaped(take.betas)
    wear = check_wear(take, garment, shaped, STRIDE)
    body = shaped.posed(take.motion[worst])
    turns = np.abs(
        igl.winding_number(
            body.vertices.astype(np.float64), body.faces.astype(np.int64), take.vertices[worst].astype(np.float64)
        )
    )
    out = protrusion(take.vertices[worst], garment.faces, body.vertices, body.normals) > MIN_PROTRUSION
    failed = take.failed or _fault(take)
    at = len(take.vertices) - 1 if take.failed else worst
    if not failed and wear.lost:
        at, joint = wear.lost
        failed = f"frame {at}: nothing goes through its opening near the {joint} any more"
    if not failed and wear.at_end:
        at, joint = wear.at_end
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
        "limb_through_percent": round(wear.through_percent, 2),
        "limb_through_at_end": wear.at_end is not None,
    }


def _fault(take: Take) -> str | None:
    """Returns a fault that the simulator did not report, or None."""
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
    """Returns pictures and captions of the takes of a garment with most crossing edges, each at its worst frame."""
    rows = [row for row in recorded_rows().values() if row["garment"] == name and row["take"]]
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
    percents = [row["figures"]["self_crossing_percent_max"] for row in worst]
    return tiles, [f"{name}, {row['clip']}, {percent:.2g} %" for row, percent in zip(worst, percents, strict=True)]


def draw_worst(names: Iterable[str]) -> None:
    """Draws three takes of each shipped garment, and one take of each garment that was tried on."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    tiles, captions = [], []
    for name in names:
        named = name in (*LIGHT, *LARGE)
        pictures_of_takes, labels = worst_takes(name, 3 if named else 1)
        if named and pictures_of_takes:
            pictures.write_webp(PICTURES / f"{name}.webp", [pictures.side_by_side(pictures_of_takes, labels)], 1.0)
        elif not named:
            tiles += [each[::2, ::2] for each in pictures_of_takes]
            captions += [name.partition("-")[2] for _ in labels]
    if tiles:
        lines = [pictures.side_by_side(tiles[at : at + 8], captions[at : at + 8]) for at in range(0, len(tiles), 8)]
        wide = max(line.shape[1] for line in lines)
        lines = [np.pad(line, ((0, 0), (0, wide - line.shape[1]), (0, 0)), constant_values=255) for line in lines]
        pictures.write_webp(PICTURES / "strangers.webp", [np.concatenate(lines)], 1.0)


def table() -> None:
    """Prints one line per garment."""
    print("| garment | vertices | takes; frames | failed | inside | crossings %, mean; worst | out | through | by |")
    print("|---|---|---|---|---|---|---|---|---|")
    rows = list(recorded_rows().values())
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
    """Simulates the missing takes and prints the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help="Garments by name. Defaults to all.")
    parser.add_argument("--jobs", type=int, default=2, help="Number of processes.")
    parser.add_argument("--table", action="store_true", help="Print the results and simulate nothing.")
    options = parser.parse_args()
    tried_on = tried_on_garments()
    names = options.names or [*LIGHT, *LARGE, *tried_on]
    if not options.table:
        files = all_clips()
        for name in names:
            garment = Garment.load(tried_on[name]) if name in tried_on else garments.load(name)
            run_garment(name, garment, clips_of(name, files), options.jobs)
        draw_worst(names)
    table()


if __name__ == "__main__":
    main()
