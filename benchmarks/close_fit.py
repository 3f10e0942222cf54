"""Measures close-fitting garments over clips and bodies: `python -m benchmarks.close_fit [MODEL]... [--clips CLIP...]`.

Every frame of every clip is played on every body, with limbs lifted out of each other. Per garment: the 99th percentile
of stretch, mean of all frames and worst frame; edges more than 30 % too long; the longest edge, mean of all frames and
longest of all; covered skin that can be seen, mean of all frames and worst clip; pinched vertices; vertices inside by
another count than the projection's; and the time of a frame's steps after the animator. The animator alone is the row
beside it. Nothing here chose a setting but the clips `kick`, `dance` and `walk`.
"""

import argparse

import numpy as np

import hemline
from hemline import metrics, motions
from hemline.animators import Animator
from hemline.bench.machine import commit, machine
from hemline.collide import inside
from hemline.meshes import edge_strains, vertex_normals

MODELS = ("tshirt-light", "longsleeve-light", "trousers-light")
BODIES = {"mean": (), "small": (-1.0, 1.0), "tall": (2.0, -1.0)}
STEPS = ("whole", "cover", "projection")
FPS = 30.0
EVERY = 3
"""Frames between two in which skin and inside are counted."""


def measure(model: Animator, clip: str, betas: tuple[float, ...]) -> dict[str, np.ndarray]:
    """Returns the figures of each frame by name."""
    body = hemline.bodies.load(model.body_name).shaped(betas)
    motion = body.untangle_motion(motions.open_motion(clip).resample(FPS))
    player = hemline.Player.prepare(model, body)
    garment, state = player.garment, player.start(motion[0])
    rest = player.animator.at_rest(state.animator, body)
    skin = metrics.skin_under_cloth(rest, garment.faces, body.vertices, body.normals)
    rows: dict[str, list[float]] = {}
    for index in range(len(motion)):
        state, frame = player.step(state, motion[index], 1 / FPS)
        for name, vertices in (("animator", frame.animated), ("shown", frame.vertices)):
            strain = 100 * edge_strains(vertices, garment.faces, garment.rest_edges)
            for figure, value in (
                ("p99", np.percentile(strain, 99)),
                ("long", 100 * np.mean(strain > 30)),
                ("longest", strain.max()),
            ):
                rows.setdefault(f"{name} {figure}", []).append(float(value))
        rows.setdefault("ms", []).append(sum(frame.milliseconds[step] for step in STEPS))
        rows.setdefault("pinched", []).append(100 * len(frame.report.pinched) / len(frame.vertices))
        if index % EVERY == 0:
            skin_now, faces = frame.body.vertices, frame.body.faces
            normals = vertex_normals(skin_now, faces)
            buried = inside(skin_now, faces, (skin_now + 0.001 * normals).astype(np.float32))[skin]
            through = metrics.skin_through_percent(frame.vertices, garment.faces, skin_now, normals, skin, buried)
            within = inside(skin_now, faces, frame.vertices)
            within[frame.report.pinched] = False
            rows.setdefault("seen", []).append(through)
            rows.setdefault("inside", []).append(float(within.sum()))
    return {name: np.array(values) for name, values in rows.items()}


def main() -> None:
    """Measures and prints."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("models", nargs="*", default=list(MODELS), metavar="MODEL")
    parser.add_argument("--clips", nargs="+", default=list(motions.names()), metavar="CLIP")
    options = parser.parse_args()
    print(f"{machine()}, {commit()}; {len(options.clips)} clips, bodies {', '.join(BODIES)}")
    print(f"{'':26}{'p99 %':>14}{'> 30 %':>8}{'longest %':>14}{'seen %':>14}{'pinched %':>10}{'inside':>7}{'ms':>7}")
    for name in options.models:
        model = hemline.load(name)
        for body, betas in BODIES.items():
            clips = [measure(model, clip, betas) for clip in options.clips]
            joined = {key: np.concatenate([clip[key] for clip in clips]) for key in clips[0]}
            seen = f"{joined['seen'].mean():.3f} / {max(clip['seen'].mean() for clip in clips):.3f}"
            rest = f"{seen:>14}{joined['pinched'].mean():>10.2f}{joined['inside'].sum():>7.0f}"
            rest += f"{np.median(joined['ms']):>7.2f}"
            for row in ("animator", "shown"):
                p99, longest = joined[f"{row} p99"], joined[f"{row} longest"]
                print(
                    f"{name + ', ' + body if row == 'animator' else '  ' + row:26}"
                    f"{f'{p99.mean():.1f} / {p99.max():.1f}':>14}{joined[f'{row} long'].mean():>8.2f}"
                    f"{f'{longest.mean():.0f} / {longest.max():.0f}':>14}" + (rest if row == "shown" else ""),
                    flush=True,
                )


if __name__ == "__main__":
    main()
