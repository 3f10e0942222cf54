"""Measures what lifting hanging arms costs and gains: `python -m papers.agentdress.arm_lift GARMENT`.

The armpit of a hanging arm leaves no room for cloth, which makes settled garments there a matter of chance. So poses
are settled with arms lifted, and skinning hands the garment back. The more the arms are lifted, the less of the cloth
is pinched, and the farther is what is handed back from the garment that is settled in the pose itself.

The garment is settled in poses with hanging arms, from the shipped excerpts of people who appear in no fit, on some
bodies, with several angles. Writes papers/agentdress/pages/arm_lift.md and rows in
benchmarks/results/agentdress_arm_lift.jsonl.
"""

from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor

import numpy as np

from hemline import bodies, garments, motions
from hemline.animators.agentdress.binding import Binding
from hemline.bodies.lifted_arms import HANGING_DEG, LIFT_DEG, lift_rotations
from hemline.errors import SimulationFailed
from hemline.motions.motion import JOINT_NAMES, Motion, Pose
from hemline.motions.pose_clusters import without_heading
from hemline.sim import random_shapes, settle
from hemline.sim.rest.rest import Rest
from hemline.sim.rest.settle import rest_state
from papers.agentdress.settled.pairs import CLIPS, mean_distance_mm
from papers.report import ROOT, Page, Row, latest_rows, origin_of, parse_options, record

NAME = "agentdress_arm_lift"
PAGES = ROOT / "papers" / "agentdress" / "pages"
LIFTS_DEG = (5.0, 8.0, 10.0, 12.0, 15.0, 20.0)
STEP = 8
"""Step between the frames of a clip that are looked at."""
SHOULDERS = [JOINT_NAMES.index(name) for name in ("left_shoulder", "right_shoulder")]


def write_page(rows: Sequence[Row]) -> str:
    """Writes the page; returns the text.

    Args:
        rows: One row per garment.
    """
    page = Page("How far hanging arms are lifted")
    page.text("""
        The armpit of a hanging arm leaves no room for cloth. Poses are therefore settled with arms lifted, and skinning
        hands the garment back. Each pose was settled with arms where they are and with arms lifted by several angles.
        A vertex is pinched if it has no free place. The distance is that of the garment that is handed back from the
        one that was settled in the pose itself, which is pinched most.
    """)
    for row in rows:
        page.section(row["garment"])
        page.text(origin_of(row, _command(row)))
        page.text(f"""
            {row["poses"]} poses of {", ".join(CLIPS)} with hanging arms on {row["bodies"]} bodies, the first of which
            is the mean one. With arms where they are, {row["hanging_pinched_percent"]:.1f} % of the vertices are
            pinched, at most {row["hanging_most_percent"]:.1f} %. Drapes lift arms by {LIFT_DEG:g} degrees.
        """)
        columns = {"lift, degrees": "g", "pinched, %": ".2f", "pinched at most, %": ".1f", "distance, mm": ".2f"}
        page.table(columns, row["lifts"])
    return page.write(PAGES / "arm_lift.md")


def _command(row: Row) -> str:
    options = f"--poses {row['poses']} --bodies {row['bodies']}"
    return f"python -m papers.agentdress.arm_lift {row['garment']} {options}"


def hanging_poses(count: int, seed: int) -> list[np.ndarray]:
    """Returns rotations of poses in which both upper arms hang, drawn from the clips."""
    found = [rotations for name in CLIPS for rotations in _hanging(motions.load(name).resample(30.0))]
    order = np.random.default_rng(seed).permutation(len(found))[:count]
    return [found[index] for index in order]


def _hanging(clip: Motion) -> Iterator[np.ndarray]:
    shaped = bodies.load("anny24").shaped()
    for frame in range(0, len(clip), STEP):
        joints = shaped.posed(clip[frame]).joints
        arms = joints[[shoulder + 2 for shoulder in SHOULDERS]] - joints[SHOULDERS]
        angles = np.rad2deg(np.arccos(-arms[:, 1] / np.linalg.norm(arms, axis=1)))
        if angles.max() < HANGING_DEG:
            yield without_heading(clip[frame].rotations[None].astype(np.float64))[0]


def measure(garment_name: str, rotations: np.ndarray, betas: tuple[float, ...]) -> list[tuple[float, float, float]]:
    """Settles a garment on a body in a pose, with all lifts; returns lift [deg], pinched [%] and distance [mm].

    The first is the pose itself, without a distance. A lift in which the garment does not come to rest is left out; the
    list is empty if it does not in the pose itself.
    """
    garment = garments.load(garment_name)
    shaped = bodies.load(garment.body_name).shaped(betas)
    start = rest_state(garment, shaped)
    rest = start.vertices.astype(np.float64)
    binding = Binding.of(start.vertices, garment.faces, shaped.posed(shaped.rest_pose))

    def settled(lift_deg: float) -> Rest:
        pose = Pose(lift_rotations(rotations, lift_deg).astype(np.float32), shaped.rest_pose.translation)
        return settle(garment, shaped, pose, start=start, method="walked", most_pinched=1.0)

    try:
        truth = settled(0.0)
    except SimulationFailed:
        return []
    found = [(0.0, 100 * float(truth.pinched.mean()), 0.0)]
    transforms = shaped.posed(truth.pose).transforms
    for lift_deg in LIFTS_DEG:
        try:
            lifted = settled(lift_deg)
        except SimulationFailed:
            continue
        offsets = binding.offsets(shaped.posed(lifted.pose).transforms, rest, lifted.vertices)
        back = binding.skin(transforms, rest, offsets)
        found.append((lift_deg, 100 * float(lifted.pinched.mean()), mean_distance_mm(back, truth.vertices)))
    return found


def main() -> None:
    """Settles, measures, records and writes the page."""
    options = parse_options(
        __doc__, "model", poses=(6, "number of poses"), bodies=(3, "number of bodies"), seed=0, jobs=1
    )
    shapes = [(), *random_shapes(bodies.load("anny24"), options.bodies - 1, options.seed)]
    tasks = [(pose, betas) for betas in shapes for pose in hanging_poses(options.poses, options.seed)]
    names = [options.model] * len(tasks)
    with ProcessPoolExecutor(options.jobs) as pool:
        results = [each for each in pool.map(measure, names, *zip(*tasks, strict=True)) if each]
    by_lift: dict[float, list[tuple[float, float]]] = {}
    for result in results:
        for lift_deg, pinched, distance in result:
            by_lift.setdefault(lift_deg, []).append((pinched, distance))
    table = []
    for lift_deg in LIFTS_DEG:
        pinched, distances = np.array(by_lift[lift_deg]).T
        table.append([lift_deg, *(round(float(n), 3) for n in (pinched.mean(), pinched.max(), distances.mean()))])
    hanging = np.array(by_lift[0.0])[:, 0]
    row = {
        "garment": options.model,
        "poses": options.poses,
        "bodies": options.bodies,
        "hanging_pinched_percent": round(float(hanging.mean()), 2),
        "hanging_most_percent": round(float(hanging.max()), 2),
        "lifts": table,
    }
    record(NAME, row, threads=options.jobs)
    print(write_page(latest_rows(NAME, "garment")))


if __name__ == "__main__":
    main()
