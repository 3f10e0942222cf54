"""Simulates garments in violent motion: `python -m benchmarks.worn [GARMENT ...]`.

Skirt, T-shirt and trousers are those of GarmentCode in ../shared/data, boxes of panels around the body whose waist is
first fitted to the skin; the cape ships. The motions are a synthetic spin, and recordings of squat kicks, a roundhouse
kick and bending over. Writes one row per scene to benchmarks/results/worn.jsonl, and the worst frames to
docs/ground_truth/worn.png.
"""

import argparse
import json
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import trimesh

from benchmarks.clips import MOTION, fastest_section
from benchmarks.protrusion import protrusion
from hemline import bodies, garments, pictures, sim
from hemline.bench.machine import commit, machine
from hemline.bodies import ShapedBody
from hemline.garments import Garment
from hemline.garments.clearance import push_out_of_body, smooth_field
from hemline.garments.dressing import body_tree
from hemline.garments.pins import Pins
from hemline.meshes import boundary_loops, crossing_edges, self_crossings
from hemline.motions.motion import Motion
from hemline.motions.quaternions import from_axis_angle, multiply
from hemline.sim.step.dressed_body import make_garment_sheet

ROOT = Path(__file__).parents[1]
DATA = ROOT.parent / "shared" / "data"
MESHES = {
    "skirt": "skirt_circle_mean_all.obj",
    "shirt": "tshirt_mean_all.obj",
    "trousers": "pants_mean_all.obj",
}
CLIPS = {"squat kicks": "90_30.bvh", "roundhouse kick": "daz_rig/135_07.bvh", "bend over": "02_06.bvh"}
SECONDS, FPS = 2.0, 30.0
MIN_PROTRUSION = 0.002
"""Protrusion from the cloth beyond which a vertex of the body is counted [m]."""

WAIST_GAP = 0.006
"""Distance of a waist from the skin [m]."""


def spin(shaped: ShapedBody, turns_per_second: float = 1.5) -> Motion:
    """Makes a spin about the vertical in the rest pose: 0.5 s to full speed, 1 s at it, 0.4 s to a stop."""
    pose, times = shaped.rest_pose, np.arange(round(SECONDS * FPS)) / FPS
    speed = 2 * np.pi * turns_per_second * np.clip(np.minimum(times / 0.5, (SECONDS - 0.4 - times) / 0.4), 0, 1)
    rotations = np.repeat(pose.rotations[None].astype(np.float64), len(times), axis=0)
    for index, angle in enumerate(np.cumsum(speed) / FPS):
        rotations[index, 0] = multiply(from_axis_angle(np.array([0.0, angle, 0.0])), rotations[index, 0])
    translations = np.repeat(pose.translation[None], len(times), axis=0)
    return Motion(rotations.astype(np.float32), translations, fps=FPS, leg_length=shaped.leg_length, name="spin")


def recorded_motion(shaped: ShapedBody, name: str) -> Motion:
    """Returns the fastest section of a recording, placed on the body."""
    return shaped.untangle_motion(shaped.placed(fastest_section(MOTION / CLIPS[name], SECONDS, FPS)))


def make_garment(name: str, shaped: ShapedBody) -> Garment:
    """Makes a garment on the body; skirts and trousers are pinned with the waist on the skin."""
    if name == "cape":
        return garments.load("cape-light")
    text = f'mesh = "{MESHES[name]}"\norigin = "floor"\npins = "none"\n'
    folder = ROOT / "out" / "worn"
    folder.mkdir(parents=True, exist_ok=True)
    source = DATA / "garments" / "garmentcode_mit" / MESHES[name]
    (folder / source.name).write_bytes(source.read_bytes())
    (folder / f"{name}.toml").write_text(text)
    garment = garments.read(folder / f"{name}.toml", shaped)
    return garment if name == "shirt" else _fit_waist(garment, shaped)


def _fit_waist(garment: Garment, shaped: ShapedBody) -> Garment:
    """Fits the highest rim to the body where girths agree, and moves the rest of the mesh along smoothly."""
    rim = max(boundary_loops(garment.faces), key=lambda loop: garment.vertices[loop, 1].mean())
    sheet = make_garment_sheet(garment)
    lengths = {tuple(edge): length for edge, length in zip(sheet.edges.tolist(), sheet.edge_length, strict=True)}
    # lengths of the pattern, as panels are still apart at the seams
    start = np.array(
        [lengths[min(edge), max(edge)] for edge in zip(rim.tolist(), np.roll(rim, -1).tolist(), strict=True)]
    )
    around = _circumference(shaped, float(start.sum()))
    arc = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(around, axis=0), axis=1))])
    along = np.concatenate([[0], np.cumsum(start)[:-1]]) / start.sum()
    placed = []
    for sense in (1, -1):
        for shift in np.linspace(0, 1, 200, endpoint=False):
            at = (shift + sense * along) % 1 * arc[-1]
            placed.append(np.stack([np.interp(at, arc, around[:, axis]) for axis in range(3)], axis=1))
    target = min(placed, key=lambda points: ((points - garment.vertices[rim]) ** 2).sum())
    field, trust = np.zeros(garment.vertices.shape), np.zeros(len(garment.vertices))
    field[rim], trust[rim] = target - garment.vertices[rim], 1e3
    tree = body_tree(shaped)
    moved = garment.vertices + smooth_field(field, garment.faces, trust, 1.0)
    vertices = push_out_of_body(moved, tree, WAIST_GAP).astype(np.float32)
    pins = Pins.bind(rim, vertices[rim], tree, shaped.normals)
    return replace(garment, vertices=vertices, pins=pins, key_joint="pelvis")


def _circumference(shaped: ShapedBody, length: float) -> np.ndarray:
    """Returns the horizontal section between hips and ribs whose length with the gap is nearest to `length`."""
    mesh = trimesh.Trimesh(shaped.vertices, shaped.body.faces, process=False)
    lines = []
    for height in np.arange(0.0, 0.3, 0.005):
        section = mesh.section(plane_origin=[0, height, 0], plane_normal=[0, 1, 0])
        lines += [line for line in section.discrete if abs(line[:, 0].mean()) < 0.1]
    gap = 2 * np.pi * WAIST_GAP
    return min(lines, key=lambda line: abs(np.linalg.norm(np.diff(line, axis=0), axis=1).sum() + gap - length))


def scenes(names: list[str], shaped: ShapedBody) -> Iterator[tuple[str, str, dict, np.ndarray]]:
    """Yields garment, motion, figures and the picture of the worst frame of each scene."""
    for name in names:
        garment = make_garment(name, shaped)
        rest = sim.rest_drape(garment, shaped)
        settled = self_crossings(rest.vertices[0], garment.faces)["edge_percent"]
        for motion in (spin(shaped), *(recorded_motion(shaped, clip) for clip in CLIPS)):
            began = time.perf_counter()
            take = sim.simulate(garment, shaped, motion, start=rest)
            spent = 1000 * (time.perf_counter() - began) / len(take.vertices)
            crossed = np.array([len(crossing_edges(frame, garment.faces)) for frame in take.vertices])
            worst = int(crossed.argmax()) if crossed.any() else len(crossed) // 2
            figures = {
                key: round(float(take.figures[key]), 5)
                for key in (
                    "edge_tension_p99",
                    "edge_strain_max",
                    "inside",
                    "pinched",
                    "residual_share",
                    "self_crossing_percent",
                    "self_crossing_percent_max",
                )
            }
            bodies_then = (shaped.posed(pose) for pose in (take.motion[frame] for frame in range(len(take.motion))))
            out = np.array(
                [
                    (protrusion(frame, garment.faces, body.vertices, body.normals) > MIN_PROTRUSION).sum()
                    for frame, body in zip(take.vertices, bodies_then, strict=True)
                ]
            )
            figures |= {"body_vertices_out": round(float(out.mean()), 2), "body_vertices_out_most": int(out.max())}
            figures |= {"settled_crossing_percent": settled, "frame_ms": round(spent, 1), "worst_frame": worst}
            posed = shaped.posed(take.motion[worst])
            drawn = [(posed.vertices, posed.faces, "body"), (take.vertices[worst], garment.faces, "cloth")]
            yield name, take.motion.name, figures | {"failed": take.failed}, pictures.picture_of(drawn, size=(360, 460))


def main() -> None:
    """Simulates the scenes, prints and records."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("garments", nargs="*", default=[*MESHES, "cape"], help="Of skirt, shirt, trousers and cape.")
    options = parser.parse_args()
    from hemline.compiled import threads

    tiles, captions = [], []
    for name, motion, figures, picture in scenes(options.garments, bodies.load("anny24").shaped()):
        row = {
            "garment": name,
            "motion": motion,
            "figures": figures,
            "machine": machine(),
            "threads": threads(),
            "commit": commit(),
            "date": time.strftime("%Y-%m-%d"),
        }
        print(f"{name:<9}{motion:<18}" + "  ".join(f"{key} {value}" for key, value in figures.items()), flush=True)
        with (ROOT / "benchmarks" / "results" / "worn.jsonl").open("a") as stream:
            stream.write(json.dumps(row) + "\n")
        tiles.append(picture)
        captions.append(f"{name}, {motion}, frame {figures['worst_frame']}")
    rows = [pictures.side_by_side(tiles[at : at + 4], captions[at : at + 4]) for at in range(0, len(tiles), 4)]
    (ROOT / "docs" / "ground_truth").mkdir(exist_ok=True)
    pictures.write_png(ROOT / "docs" / "ground_truth" / "worn.png", np.concatenate(rows))


if __name__ == "__main__":
    main()
