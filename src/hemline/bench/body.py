"""Times the stages of the body on one core: `python -m hemline.bench.body`.

Prints the minimum and the median of many repetitions after the first; other load on the machine shows in the median.
"""

import sys
import time
from collections.abc import Callable

import numpy as np

from hemline.bodies import load
from hemline.bodies.untangling.overlap import overlapping
from hemline.bodies.untangling.untangling import untangle
from hemline.motions import JOINT_NAMES, Pose
from hemline.motions.quaternions import from_axis_angle


def milliseconds(call: Callable[[], object], repetitions: int) -> tuple[float, float]:
    """Returns the minimum and the median time of a call [ms]."""
    call()
    times = []
    for _ in range(repetitions):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return 1e3 * float(np.min(times)), 1e3 * float(np.median(times))


def main() -> None:
    """Prints one line per stage."""
    body, rng = load("anny24"), np.random.default_rng(0)
    shaped = body.shaped([0.5, -1.0])
    pose = Pose(from_axis_angle(rng.normal(scale=0.4, size=(len(JOINT_NAMES), 3))), np.zeros(3))
    down = pose.rotations.copy()
    for name, turn in (("left_shoulder", -1.5), ("right_shoulder", 1.5)):
        down[JOINT_NAMES.index(name)] = from_axis_angle(np.array([0, 0, turn]))
    tangled = Pose(down, pose.translation)
    posed = shaped.posed(tangled)
    stages: dict[str, tuple[Callable[[], object], int]] = {
        "read the file": (load.__wrapped__, 10),
        "shape": (lambda: body.shaped([0.5, -1.0]), 20),
        "pose 24 joints": (lambda: shaped.posed(pose), 2000),
        "pose and skin, linear": (lambda: shaped.posed(pose).vertices, 2000),
        "pose and skin, dual quaternions": (lambda: shaped.posed(pose, blending="dual").vertices, 1000),
        "pose and skinned normals": (lambda: shaped.posed(pose).skinned_normals, 1000),
        "pose, skin and area-weighted normals": (lambda: shaped.posed(pose).normals, 1000),
        "untangle a pose with overlaps": (lambda: untangle(shaped, tangled), 20),
        "untangle a pose without overlaps": (lambda: untangle(shaped, pose), 20),
        "count overlapping vertices": (lambda: overlapping(posed), 20),
    }
    for name, (call, repetitions) in stages.items():
        minimum, median = milliseconds(call, repetitions)
        sys.stdout.write(f"{name:40s} min {minimum:8.3f} ms   median {median:8.3f} ms\n")


if __name__ == "__main__":
    main()
