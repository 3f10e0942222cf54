"""Measures sizes, errors and times of the export formats for `docs/export.md`: `python -m benchmarks.export [CLIP]`.

Plays ten seconds of the shipped cape at 30 fps and writes every format into a temporary folder.
"""

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np

from hemline import motions
from hemline.cli.clip import cut
from hemline.cli.model import open_model
from hemline.collide import inside
from hemline.export import Clip, skin_clip, write
from hemline.playback import play, record

VARIANTS = (
    ("npz", False, False),
    ("glb", False, False),
    ("glb", False, True),
    ("glb", True, False),
    ("glb", True, True),
    ("usdc", False, False),
    ("usdc", True, False),
    ("vat", False, False),
    ("pc2", False, False),
    ("mdd", False, False),
    ("obj", False, False),
)
"""Ending, and whether the garment is skinned and quantised."""


def play_cape(name: str) -> Clip:
    """Plays ten seconds of the shipped cape on a clip."""
    motion = cut(motions.open_motion(name), 0.0, 10.0)
    cape, body = open_model("cape", None, None, ())
    frames = play(cape, body, motion, fps=30)
    return record(frames, garment_name="cape", garment_faces=cape.garment.faces, motion=motion, fps=30)


def inside_percent(clip: Clip) -> tuple[float, float]:
    """Returns mean and maximum of skinned vertices inside the body, on every 15th frame [percent]."""
    skeleton, percents = clip.skin.skeleton, []
    points = np.concatenate([skeleton.vertices, np.ones((len(skeleton.vertices), 1))], axis=1)
    for frame in range(0, clip.frame_count, 15):
        moved = np.einsum("vkrc,vc->vkr", skeleton.transforms[frame][skeleton.weight_indices], points)
        vertices = np.einsum("vk,vkr->vr", skeleton.weights, moved).astype(np.float32)
        percents.append(100 * inside(clip.body_vertices[frame], clip.body_faces, vertices).mean())
    return float(np.mean(percents)), float(np.max(percents))


def main() -> None:
    """Measures and prints the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("clip", nargs="?", default="dance", help="Clip to play (default: dance, 7 s).")
    name = parser.parse_args().clip
    clip = play_cape(name)
    print(f"{name}: {clip.frame_count} frames of {clip.vertices.shape[1]} + {clip.body_vertices.shape[1]} vertices")
    for bones in (20, 40, 120):
        skin = skin_clip(clip, bones).skin
        print(f"| {bones} bones | mean {skin.mean_error_mm:.1f} mm, max {skin.max_error_mm:.0f} mm |")
    started = time.perf_counter()
    with_skin = skin_clip(clip)
    fitted, skin = time.perf_counter() - started, with_skin.skin
    errors = f"mean {skin.mean_error_mm:.1f} mm, max {skin.max_error_mm:.0f} mm"
    print(f"| {skin.bone_count} bones | {errors} | {fitted:.1f} s |")
    print("| vertices of it inside the body: mean {:.2f} %, worst frame {:.2f} % |".format(*inside_percent(with_skin)))
    with tempfile.TemporaryDirectory() as folder:
        for ending, bones, quantized in VARIANTS:
            started = time.perf_counter()
            paths = write(Path(folder) / f"cape.{ending}", with_skin if bones else clip, quantized=quantized)
            seconds = time.perf_counter() - started
            megabytes = sum(path.stat().st_size for path in paths) / 1e6
            words = f".{ending}{' --skinned' if bones else ''}{' --quantized' if quantized else ''}"
            print(f"| {words} | {megabytes:.1f} MB in {len(paths)} files | {seconds:.1f} s |")
            for path in paths:
                path.unlink()


if __name__ == "__main__":
    main()
