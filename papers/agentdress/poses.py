"""Pictures of the anchors: `python -m papers.agentdress.poses ANCHORS`.

ANCHORS is a dataset made by `hemline drape GARMENT --anchors ...`. Draws each pose that was settled on several bodies,
on the mean one, sorted by the rotation of the arms. Writes papers/agentdress/pages/anchors-GARMENT.png.
"""

import numpy as np

from hemline import bodies, pictures
from hemline.datasets import Dataset, Take, open_dataset
from hemline.motions.motion import JOINT_NAMES
from hemline.motions.quaternions import angle
from papers.report import ROOT, parse_options

PAGES = ROOT / "papers" / "agentdress" / "pages"
PICTURE_SIZE, COLUMNS = (100, 140), 15
ARMS = [JOINT_NAMES.index(name) for name in ("left_shoulder", "right_shoulder")]


def anchors_of(dataset: Dataset) -> list[Take]:
    """Returns the takes of the mean body in poses that were settled on other shapes too."""
    by_pose: dict[str, list[Take]] = {}
    for row in dataset.anchors():
        take = dataset.take(row)
        if not take.derivatives:
            by_pose.setdefault(take.motion[0].hash, []).append(take)
    several = [takes for takes in by_pose.values() if len(takes) > 1]
    mean = [next((take for take in takes if not take.betas.any()), None) for takes in several]
    return [take for take in mean if take is not None]


def main() -> None:
    """Draws the picture."""
    dataset = open_dataset(parse_options(__doc__, "anchors").anchors)
    body, faces = bodies.load(dataset.garment.body_name).shaped(), dataset.garment.faces
    takes = sorted(anchors_of(dataset), key=lambda take: -float(angle(take.motion.rotations[0, ARMS]).sum()))
    views = []
    for take in takes:
        posed = body.posed(take.motion[0])
        meshes = [(posed.vertices, posed.faces, "body"), (take.vertices[0], faces, "cloth")]
        views.append(pictures.picture_of(meshes, "three_quarter", size=PICTURE_SIZE))
    views += [np.full_like(views[0], 255)] * (-len(views) % COLUMNS)
    rows = [pictures.side_by_side(views[begin : begin + COLUMNS]) for begin in range(0, len(views), COLUMNS)]
    path = PAGES / f"anchors-{dataset.garment.name}.png"
    pictures.write_png(path, np.concatenate(rows, axis=0))
    print(f"{path}: {len(takes)} anchors")


if __name__ == "__main__":
    main()
